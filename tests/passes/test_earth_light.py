"""Light of the Earth on spacecraft: plates and mirrors at 400 km, through the whole renderer."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import moderngl
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simgl.environment_map import SkyRadiance
from simgl.passes.background.environment_probe import EnvironmentProbeStore
from simgl.passes.drawn_spacecraft import EnvironmentProbe
from simgl.scenario.scenario import Scenario
from simgl.view.background import SKY_TEXELS, TERMINATOR_TEXELS, SkyView, sky_view
from tests.scenes import IN_BANDS, TOTAL, Table, lambert, radiance, scene

Array = np.ndarray[Any, np.dtype[np.float64]]

R, ALTITUDE = 6.371e6, 4.0e5
EARTH = {"shape": "sphere", "radius_km": 6371.0, "albedo": 0.3, "atmosphere": "none"}
BARE = {**EARTH, "albedo": 0.0}
UP = np.array([1.0, 0.0, 0.0])
PLACE = (R + ALTITUDE) * UP

# Irradiance [W m-2] of a plate at 400 km from a Lambertian Earth of albedo 0.3 under 1367 W m-2 of
# 0.526 deg: nadir, and vertical at 0, 90 and 180 deg from the Sun's azimuth; direct quadrature.
IRRADIANCE = {
    0.0: (361.6074, 117.4835, 117.4835, 117.4835),
    60.0: (180.8037, 67.1348, 58.7418, 50.3487),
    90.0: (8.3209, 9.6915, 3.0872, 6.7e-5),
}
# The same under a Sun whose light comes from along the limb: three of those plates, and two at 45
# and 70 deg from nadir towards the Sun's azimuth.
LOW_SUN = {
    97.0: (0.5498, 1.2308, 0.2308, 1.2591, 1.3446),
    100.0: (0.1614, 0.3966, 0.0619, 0.3946, 0.4279),
    104.0: (0.0194, 0.0512, 0.0059, 0.0499, 0.0547),
    108.0: (0.0003, 0.0007, 0.0000, 0.0007, 0.0008),
}
LOW_PLATES = ((0.0, 0.0), (90.0, 0.0), (90.0, 90.0), (45.0, 0.0), (70.0, 0.0))
TILT_AZIMUTH = ((0.0, 0.0), (90.0, 0.0), (90.0, 90.0), (90.0, 180.0))


def sun_at(zenith_deg: float) -> tuple[float, float, float]:
    z = np.radians(zenith_deg)
    return float(np.cos(z)), float(np.sin(z)), 0.0


def facing(tilt_deg: float, azimuth_deg: float) -> Array:
    """Normal of a plate: tilt from nadir, azimuth from the Sun's."""
    t, a = np.radians([tilt_deg, azimuth_deg])
    return np.array([-np.cos(t), np.sin(t) * np.cos(a), np.sin(t) * np.sin(a)])


def attitude(normal: Array, roll: float = 0.0) -> Rotation:
    """Of a body whose +z points along a normal, rolled about it [rad]; ICRF from body."""
    x = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    x /= np.linalg.norm(x)
    R_icrf_from_body = np.stack([x, np.cross(normal, x), normal], axis=1)
    return Rotation.from_matrix(R_icrf_from_body) * Rotation.from_rotvec([0.0, 0.0, roll])


def before(
    model: Table,
    R_icrf_from_body: Rotation,
    towards_camera: Array,
    zenith_deg: float,
    *,
    earth: Table,
    turned: Rotation | None = None,
    beside: Table | None = None,
) -> Scenario:
    """A body at 400 km and a camera 20 m from it; the whole scene may be turned.

    beside : another spacecraft, listed first
    """
    turn = turned or Rotation.identity()
    sun = turn.apply(sun_at(zenith_deg))
    return scene(
        ({} if beside is None else {"beside": beside})
        | {
            "body": {
                "model": model,
                "position_icrf_m": turn.apply(PLACE).tolist(),
                "quaternion_icrf_from_body_xyzw": (turn * R_icrf_from_body).as_quat().tolist(),
            }
        },
        {
            "position_icrf_m": turn.apply(PLACE + 20.0 * towards_camera).tolist(),
            "look_at": "body",
            # Not parallel to any line of sight here, whatever the turn.
            "up": turn.apply([0.3, 0.2, 0.9]).tolist(),
            "focal_length_mm": 100.0,
        },
        sun_direction=(float(sun[0]), float(sun[1]), float(sun[2])),
        earth=earth,
    )


def plate(material: Table) -> Table:
    return {"plate": {"width_m": 4.0, "height_m": 4.0, "material": material}}


def earthshine(gl: moderngl.Context, *arguments: Any, **options: Any) -> Array:
    """(128, 128, 4) radiance less that with a black Earth, which leaves the sunlight alone."""
    with_earth = radiance(gl, before(*arguments, earth=EARTH, **options))
    without = radiance(gl, before(*arguments, earth=BARE, **options))
    return with_earth.astype(np.float64) - without


def as_irradiance(picture: Array) -> float:
    """Of a white Lambertian surface, as if all sunlight lay in the bands [W m-2]."""
    return float(np.pi * picture[60:68, 60:68].mean(axis=(0, 1)).sum() * TOTAL / IN_BANDS)


@pytest.mark.parametrize("zenith", IRRADIANCE)
@pytest.mark.parametrize("case", range(4))
def test_a_white_plate_has_the_earths_irradiance(
    gl: moderngl.Context, zenith: float, case: int
) -> None:
    normal = facing(*TILT_AZIMUTH[case])
    white = plate(lambert(1.0))
    got = as_irradiance(earthshine(gl, white, attitude(normal, 0.4), normal, zenith))
    expected = IRRADIANCE[zenith][case]
    # Sums over texels of 0.7 deg: 2e-4 measured, 1e-3 where only the terminator's twilight is seen.
    # The last value is 5e-8 of the sunlight, from a strip that is narrower than a texel towards the
    # limb: 4 % measured.
    tolerance = 2e-3 if expected > 1.0 else 0.05
    np.testing.assert_allclose(got, expected, rtol=tolerance)


@pytest.mark.parametrize("zenith", LOW_SUN)
@pytest.mark.parametrize("case", range(5))
def test_a_plate_has_the_irradiance_of_a_lit_limb(
    gl: moderngl.Context, zenith: float, case: int
) -> None:
    normal = facing(*LOW_PLATES[case])
    white = plate(lambert(1.0))
    got = as_irradiance(earthshine(gl, white, attitude(normal, 0.4), normal, zenith))
    # A strip as narrow as some texels; 0.0012 W m-2 measured where it is narrowest.
    np.testing.assert_allclose(got, LOW_SUN[zenith][case], rtol=0.01, atol=0.0015)


@pytest.mark.parametrize("case", range(4))
def test_finer_texels_change_nothing_where_the_sun_is_high_enough_for_coarse_ones(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, case: int
) -> None:
    normal = facing(*TILT_AZIMUTH[case])
    arguments = plate(lambert(1.0)), attitude(normal, 0.4), normal, 84.9
    coarse = as_irradiance(earthshine(gl, *arguments))
    monkeypatch.setattr("simgl.view.background.SKY_TEXELS", TERMINATOR_TEXELS)
    # An eighth of a texel's square times the second derivative: as far as C5 may be off itself.
    np.testing.assert_allclose(coarse, as_irradiance(earthshine(gl, *arguments)), rtol=2e-3)


@pytest.mark.parametrize("zenith", [0.0, 60.0])
def test_a_turned_sphere_has_the_earths_irradiance_between_the_maps_points(
    gl: moderngl.Context, zenith: float
) -> None:
    """The middle of a sphere's picture faces the camera, whatever the sphere's own axes."""
    ball = {"sphere": {"radius_m": 2.0, "material": lambert(1.0)}}
    R_icrf_from_body = Rotation.from_rotvec([0.7, -1.1, 0.4])
    for expected, (tilt, azimuth) in zip(IRRADIANCE[zenith], TILT_AZIMUTH, strict=True):
        normal = facing(tilt, azimuth)
        got = as_irradiance(earthshine(gl, ball, R_icrf_from_body, normal, zenith))
        # Linear between normals 7.5 deg apart: 7.5^2 / 8 of the second derivative, which is up to
        # some 5 times the value on the faint sides.
        np.testing.assert_allclose(got, expected, rtol=0.01)


@pytest.mark.parametrize("zenith", [0.0, 60.0])
def test_a_plate_beside_another_spacecraft_has_the_same_irradiance(
    gl: moderngl.Context, zenith: float
) -> None:
    """Two spacecraft 15 m apart share a sky, in the axes of the first."""
    turn = Rotation.from_rotvec([0.7, -1.1, 0.4])
    beside = {
        "model": plate(lambert(1.0)),
        "position_icrf_m": np.add(PLACE, [-9.0, 12.0, 0.0]).tolist(),
        "quaternion_icrf_from_body_xyzw": turn.as_quat().tolist(),
    }
    for expected, (tilt, azimuth) in zip(IRRADIANCE[zenith], TILT_AZIMUTH, strict=True):
        normal = facing(tilt, azimuth)
        arguments = plate(lambert(1.0)), attitude(normal, 0.4), normal, zenith
        scenario = before(*arguments, earth=EARTH, beside=beside)
        state = scenario.at(scenario.epoch_tai_ns)
        skies = [sky_view(state, name, body) for name, body in state.bodies.items()]
        assert len({None if sky is None else sky.key for sky in skies}) == 1
        # Between the map's points, as on the sphere above.
        got = as_irradiance(earthshine(gl, *arguments, beside=beside))
        np.testing.assert_allclose(got, expected, rtol=0.01)


def test_a_mirror_shows_the_ground_that_it_reflects(gl: moderngl.Context) -> None:
    """Tilted so that it shows the ground at the end of a ray 30 deg off nadir."""
    silver = plate({"reflectance": 1.0, "metallic": 1.0, "roughness": 0.01})
    view, a = np.array([0.0, 0.8, 0.6]), np.radians(30.0)
    ray = np.array([-np.cos(a), np.sin(a), 0.0])
    normal = (view + ray) / np.linalg.norm(view + ray)
    picture = earthshine(gl, silver, attitude(normal, 0.4), view, 60.0)[60:68, 60:68]
    along = float(np.dot(PLACE, ray))
    t = -along - np.sqrt(along**2 - np.dot(PLACE, PLACE) + R**2)
    cosine = float(np.dot((PLACE + t * ray) / R, sun_at(60.0)))
    expected = 0.3 / np.pi * IN_BANDS * cosine
    # Linear between texels of 0.7 deg, where the ground's cosine changes by 1e-3; the reflectance
    # of the smoothest metal comes from a table that is good to 1e-3.
    np.testing.assert_allclose(picture.sum(axis=2), expected, rtol=3e-3)


@pytest.mark.parametrize("roughness", [0.1, 0.3, 0.7])
def test_metal_towards_empty_sky_is_dark_and_towards_the_earth_bright(
    gl: moderngl.Context, roughness: float
) -> None:
    metal = plate({"reflectance": 1.0, "metallic": 1.0, "roughness": roughness})
    down = earthshine(gl, metal, attitude(-UP), -UP, 0.0)[64, 64].sum()
    up = earthshine(gl, metal, attitude(UP), UP, 0.0)[64, 64].sum()
    # Nadir is the brightest place. The Earth fills 140 deg of the sky, and less than 1 % of the
    # broadest lobe here reaches below the horizon of a plate that faces the zenith.
    brightest = 0.3 / np.pi * IN_BANDS
    assert 0.5 * brightest < down < 1.001 * brightest
    assert up < 0.01 * down


def test_turning_the_whole_scene_changes_nothing(gl: moderngl.Context) -> None:
    box = {"box": {"size_m": [1.0, 1.5, 2.0], "material": {"reflectance": 0.6, "roughness": 0.4}}}
    arguments = box, Rotation.from_rotvec([0.3, 0.2, -0.5]), facing(40.0, 120.0), 60.0
    still = earthshine(gl, *arguments)
    turned = earthshine(gl, *arguments, turned=Rotation.from_rotvec([1.0, -2.0, 0.7]))
    # float32 poses move edges by some 1e-5 of a pixel; away from them radiance follows to 1e-4.
    np.testing.assert_allclose(turned, still, rtol=2e-3, atol=2e-3 * still.max())


def test_there_is_no_earthshine_without_an_earth_or_at_midnight(gl: moderngl.Context) -> None:
    white = plate(lambert(1.0))
    nadir = facing(0.0, 0.0)
    deep_space = before(white, attitude(nadir), nadir, 0.0, earth={"shape": "none"})
    midnight = before(white, attitude(nadir), nadir, 180.0, earth=EARTH)
    assert radiance(gl, deep_space)[60:68, 60:68].max() == 0.0
    assert radiance(gl, midnight)[60:68, 60:68].max() == 0.0


def test_equal_skies_are_drawn_once(gl: moderngl.Context) -> None:
    drawn: list[SkyView] = []

    def sky(zenith_deg: float) -> SkyView | None:
        nadir = facing(0.0, 0.0)
        scenario = before(plate(lambert(1.0)), attitude(nadir), nadir, zenith_deg, earth=EARTH)
        state = scenario.at(scenario.epoch_tai_ns)
        return sky_view(state, "body", state.bodies["body"])

    executor = ThreadPoolExecutor(max_workers=1)
    probes = EnvironmentProbeStore(gl, executor)

    def probes_of(*views: SkyView | None) -> list[EnvironmentProbe | None]:
        for view in probes.missing(views):
            n = view.texels
            probes.add(view, SkyRadiance(radiance=np.ones((6, n, n, 4), dtype=np.float32)))
            drawn.append(view)
        return probes.of(views)

    first, again, none = probes_of(sky(10.0), sky(10.0), None)
    assert first is again
    assert none is None
    assert len(drawn) == 1
    assert probes_of(sky(10.0)) == [first]
    assert len(drawn) == 1
    assert probes_of(sky(20.0)) != [first]
    assert len(drawn) == 2
    assert first is not None
    np.testing.assert_array_equal(first.sky.radiance, 1.0)
    # Skies of another size push them out, and come back.
    sizes = [probes_of(sky(85.5 + 0.1 * index))[0].cube.size[0] for index in range(9)]  # type: ignore[union-attr]
    assert sizes == [TERMINATOR_TEXELS] * 9
    (back,) = probes_of(sky(10.0))
    assert back is not None
    assert back.cube.size == (SKY_TEXELS, SKY_TEXELS)
    np.testing.assert_array_equal(np.frombuffer(back.cube.read(0), "<f4"), 1.0)
    probes.release()
    executor.shutdown()
