"""Light of the Earth on spacecraft: plates and mirrors at 400 km, through the whole renderer."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from functools import cache

import moderngl
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simgl.environment_map import SkyRadiance
from simgl.passes.background.environment_probe import EnvironmentProbeStore
from simgl.passes.drawn_spacecraft import EnvironmentProbe
from simgl.view.background import SKY_TEXELS, TERMINATOR_TEXELS, SkyView, sky_view
from tests.passes import earth_light_scenes
from tests.passes.earth_light_scenes import (
    EARTH,
    IRRADIANCE,
    LOW_PLATES,
    LOW_SUN,
    PLACE,
    TILT_AZIMUTH,
    UP,
    Array,
    R,
    as_irradiance,
    attitude,
    before,
    earthshine,
    facing,
    opened_earthshine,
    plate,
    sun_at,
)
from tests.scenes import IN_BANDS, TOTAL, lambert, radiance

WHITE_PLATE = plate(lambert(1.0))


@pytest.fixture(scope="module")
def of_white_plate(module_gl: moderngl.Context) -> Iterator[Callable[..., Array]]:
    """Earthshine on a white plate: by attitude, direction to the camera, the Sun's zenith angle."""
    with opened_earthshine(module_gl, WHITE_PLATE) as drawn:
        yield drawn


@pytest.fixture(scope="module")
def of_white_ball(module_gl: moderngl.Context) -> Iterator[Callable[..., Array]]:
    """The same on a ball."""
    with opened_earthshine(
        module_gl, {"sphere": {"radius_m": 2.0, "material": lambert(1.0)}}
    ) as drawn:
        yield drawn


@pytest.fixture(scope="module")
def of_metal_plates(
    module_gl: moderngl.Context,
) -> Iterator[Callable[[float], Callable[..., Array]]]:
    """The same on a plate of metal, by its roughness."""
    with ExitStack() as stack:

        @cache
        def drawn(roughness: float) -> Callable[..., Array]:
            metal = plate({"reflectance": 1.0, "metallic": 1.0, "roughness": roughness})
            return stack.enter_context(opened_earthshine(module_gl, metal))

        yield drawn


@pytest.mark.parametrize("zenith", IRRADIANCE)
@pytest.mark.parametrize("case", range(4))
def test_a_white_plate_has_the_earths_irradiance(
    of_white_plate: Callable[..., Array], zenith: float, case: int
) -> None:
    normal = facing(*TILT_AZIMUTH[case])
    got = as_irradiance(of_white_plate(attitude(normal, 0.4), normal, zenith))
    expected = IRRADIANCE[zenith][case]
    # Sums over texels of 0.7 deg: 2e-4 measured, 1e-3 where only the terminator's twilight is seen.
    # The last value is 5e-8 of the sunlight, from a strip that is narrower than a texel towards the
    # limb: 4 % measured.
    tolerance = 2e-3 if expected > 1.0 else 0.05
    np.testing.assert_allclose(got, expected, rtol=tolerance)


@pytest.mark.parametrize("zenith", LOW_SUN)
@pytest.mark.parametrize("case", range(5))
def test_a_plate_has_the_irradiance_of_a_lit_limb(
    of_white_plate: Callable[..., Array], zenith: float, case: int
) -> None:
    normal = facing(*LOW_PLATES[case])
    got = as_irradiance(of_white_plate(attitude(normal, 0.4), normal, zenith))
    # A strip as narrow as some texels; 0.0012 W m-2 measured where it is narrowest.
    np.testing.assert_allclose(got, LOW_SUN[zenith][case], rtol=0.01, atol=0.0015)


def test_a_plate_at_200_km_has_the_irradiance_of_a_lit_limb(
    of_white_plate: Callable[..., Array], monkeypatch: pytest.MonkeyPatch
) -> None:
    """All that the Sun lights, 98 deg from the zenith, is seen within 2.4 deg of the limb."""
    monkeypatch.setattr(earth_light_scenes, "PLACE", (R + 2.0e5) * UP)
    normal = facing(65.0, 0.0)
    got = as_irradiance(of_white_plate(attitude(normal, 0.4), normal, 98.0))
    # By direct quadrature; the strip is 7 texels wide.
    np.testing.assert_allclose(got, 0.13632, rtol=0.01, atol=0.0015)


def by_quadrature(height: float, normal: Array, zenith_deg: float) -> float:
    """Irradiance of a plate from the Earth of these scenes [W m-2]; height [m]."""
    d = R + height
    cosine = np.linspace(R / d, 1.0, 1001)
    cosine = 0.5 * (cosine[1:] + cosine[:-1])
    azimuth = 2.0 * np.pi * (np.arange(360) + 0.5) / 360
    sine = np.sqrt(1.0 - cosine**2)[:, None]
    ground = np.stack(
        np.broadcast_arrays(cosine[:, None], sine * np.cos(azimuth), sine * np.sin(azimuth)),
        axis=-1,
    )
    seen = R * ground - d * UP
    distance = np.linalg.norm(seen, axis=-1)
    sunlit = np.clip(ground @ np.array(sun_at(zenith_deg)), 0.0, None)
    leaving = -(seen * ground).sum(axis=-1) / distance
    arriving = np.clip(seen @ normal / distance, 0.0, None)
    area = R**2 * (1.0 - R / d) / cosine.size * 2.0 * np.pi / azimuth.size
    share = (sunlit * leaving * arriving / distance**2).sum() * area
    return float(0.3 / np.pi * TOTAL * share)


@pytest.mark.parametrize("height", [2e6, 8e6, 36e6])
@pytest.mark.parametrize("zenith", [0.0, 100.0])
def test_a_plate_far_above_has_the_earths_irradiance(
    of_white_plate: Callable[..., Array],
    monkeypatch: pytest.MonkeyPatch,
    height: float,
    zenith: float,
) -> None:
    """Where the Earth is small it still spans many texels, wherever it lies among them."""
    monkeypatch.setattr(earth_light_scenes, "PLACE", (R + height) * UP)
    for tilt in (0.0, 50.0):
        normal = facing(tilt, 20.0)
        got = as_irradiance(of_white_plate(attitude(normal, 0.4), normal, zenith))
        np.testing.assert_allclose(got, by_quadrature(height, normal, zenith), rtol=5e-3)


@pytest.mark.parametrize("case", range(4))
def test_finer_texels_change_nothing_where_the_sun_is_high_enough_for_coarse_ones(
    of_white_plate: Callable[..., Array], monkeypatch: pytest.MonkeyPatch, case: int
) -> None:
    normal = facing(*TILT_AZIMUTH[case])
    arguments = attitude(normal, 0.4), normal, 84.9
    coarse = as_irradiance(of_white_plate(*arguments))
    monkeypatch.setattr("simgl.view.background.SKY_TEXELS", TERMINATOR_TEXELS)
    fine = as_irradiance(of_white_plate(*arguments))
    # Both were drawn, not one of them looked up.
    assert fine != coarse
    # An eighth of a texel's square times the second derivative: as far as C5 may be off itself.
    np.testing.assert_allclose(coarse, fine, rtol=2e-3)


@pytest.mark.parametrize("zenith", [0.0, 60.0])
def test_a_turned_sphere_has_the_earths_irradiance_between_the_maps_points(
    of_white_ball: Callable[..., Array], zenith: float
) -> None:
    """The middle of a sphere's picture faces the camera, whatever the sphere's own axes."""
    R_icrf_from_body = Rotation.from_rotvec([0.7, -1.1, 0.4])
    for expected, (tilt, azimuth) in zip(IRRADIANCE[zenith], TILT_AZIMUTH, strict=True):
        normal = facing(tilt, azimuth)
        got = as_irradiance(of_white_ball(R_icrf_from_body, normal, zenith))
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
        "model": WHITE_PLATE,
        "position_icrf_m": np.add(PLACE, [-9.0, 12.0, 0.0]).tolist(),
        "quaternion_icrf_from_body_xyzw": turn.as_quat().tolist(),
    }
    with opened_earthshine(gl, WHITE_PLATE, beside) as of_pair:
        for expected, (tilt, azimuth) in zip(IRRADIANCE[zenith], TILT_AZIMUTH, strict=True):
            normal = facing(tilt, azimuth)
            arguments = attitude(normal, 0.4), normal, zenith
            scenario = before(WHITE_PLATE, *arguments, earth=EARTH, beside=beside)
            state = scenario.at(scenario.epoch_tai_ns)
            skies = [sky_view(state, name, body) for name, body in state.bodies.items()]
            assert len({None if sky is None else sky.key for sky in skies}) == 1
            # Between the map's points, as on the sphere above.
            got = as_irradiance(of_pair(*arguments))
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


def lobes_light(normal: Array, view: Array, roughness: float, zenith_deg: float) -> float:
    """Radiance of metal that reflects the Earth, by 60,000 microfacets of the GGX distribution."""
    alpha, count = roughness**2, 60_000
    part = (np.arange(count) + 0.5) / count
    turn = np.pi * (1.0 + np.sqrt(5.0)) * np.arange(count)
    up = 1.0 / np.sqrt(1.0 + alpha**2 * part / (1.0 - part))
    sideways = np.sqrt(1.0 - up**2)
    axes = attitude(normal).as_matrix().T
    h = np.stack([sideways * np.cos(turn), sideways * np.sin(turn), up], axis=1) @ axes
    VoH = h @ view
    light = 2.0 * VoH[:, None] * h - view
    NoL, NoV = light @ normal, float(view @ normal)
    reflected = (VoH > 0.0) & (NoL > 0.0)
    h, VoH, light, NoL, up = (a[reflected] for a in (h, VoH, light, NoL, up))
    masking = 0.5 / (
        NoV * np.hypot(alpha, NoL * np.sqrt(1.0 - alpha**2))
        + NoL * np.hypot(alpha, NoV * np.sqrt(1.0 - alpha**2))
    )
    along = light @ PLACE
    inside = along**2 - PLACE @ PLACE + R**2
    met = (along < 0.0) & (inside > 0.0)
    ground = (PLACE + (-along - np.sqrt(np.maximum(inside, 0.0)))[:, None] * light) / R
    radiance_seen = 0.3 / np.pi * IN_BANDS * np.maximum(ground @ np.array(sun_at(zenith_deg)), 0.0)
    return float(np.sum(4.0 * masking * NoL * VoH / up * radiance_seen * met) / count)


@pytest.mark.parametrize("tilt_deg", [0.0, 69.7])
@pytest.mark.parametrize("slant_deg", [20.0, 70.0, 80.0])
def test_rough_metal_reflects_what_its_microfacets_see_of_the_earth(
    of_metal_plates: Callable[[float], Callable[..., Array]], tilt_deg: float, slant_deg: float
) -> None:
    """The mirror direction looks at the middle of the Earth, or along its limb."""
    seen, axis = facing(tilt_deg, 90.0), facing(90.0, 0.0)
    normal = Rotation.from_rotvec(np.radians(slant_deg) * axis).apply(seen)
    view = Rotation.from_rotvec(2.0 * np.radians(slant_deg) * axis).apply(seen)
    for roughness in (0.3, 0.7):
        got = of_metal_plates(roughness)(attitude(normal, 0.4), view, 0.0)[62:66, 62:66]
        light = lobes_light(normal, view, roughness, 0.0)
        # One round lobe for one that is narrower across the plane of incidence than along it errs
        # by 0.042 rms over all skies. A lobe about the mirror direction errs by up to 0.17 here.
        assert got.sum(axis=2).mean() == pytest.approx(light, abs=0.08 * 0.3 / np.pi * IN_BANDS)


@pytest.mark.parametrize("roughness", [0.1, 0.3, 0.7])
def test_metal_towards_empty_sky_is_dark_and_towards_the_earth_bright(
    of_metal_plates: Callable[[float], Callable[..., Array]], roughness: float
) -> None:
    of_metal = of_metal_plates(roughness)
    down = of_metal(attitude(-UP), -UP, 0.0)[64, 64].sum()
    up = of_metal(attitude(UP), UP, 0.0)[64, 64].sum()
    # Nadir is the brightest place. The Earth fills 140 deg of the sky, and less than 1 % of the
    # broadest lobe here reaches below the horizon of a plate that faces the zenith.
    brightest = 0.3 / np.pi * IN_BANDS
    assert 0.5 * brightest < down < 1.001 * brightest
    assert up < 0.01 * down


def test_turning_the_whole_scene_changes_nothing(gl: moderngl.Context) -> None:
    box = {"box": {"size_m": [1.0, 1.5, 2.0], "material": {"reflectance": 0.6, "roughness": 0.4}}}
    arguments = Rotation.from_rotvec([0.3, 0.2, -0.5]), facing(40.0, 120.0), 60.0
    with opened_earthshine(gl, box) as of_box:
        still = of_box(*arguments)
        turned = of_box(*arguments, turned=Rotation.from_rotvec([1.0, -2.0, 0.7]))
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
    assert sizes == [TERMINATOR_TEXELS + 2] * 9
    (back,) = probes_of(sky(10.0))
    assert back is not None
    assert back.cube.size == (SKY_TEXELS + 2, 6 * (SKY_TEXELS + 2))
    np.testing.assert_array_equal(np.frombuffer(back.cube.read(), "<f4"), 1.0)
    probes.release()
    executor.shutdown()
