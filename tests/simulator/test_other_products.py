"""Range, normals, irradiance and LIDAR of the same frame."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.camera.distortion import sight_lines
from simgl.camera.lidar import detected
from simgl.images import IrradianceFrame
from simgl.physics.spectrum import Bands, black_body_light
from simgl.simulator import Capture, Product, Simulator
from tests.scenes import lambert, scene

LASER = {
    "wavelength_nm": 905.0,
    "pulse_energy_mj": 20.0,
    "beam_half_angle_deg": 20.0,
    "quantum_efficiency": 0.3,
}


def taken(
    gl: moderngl.Context,
    distance: float,
    tilt: float = 0.0,
    *,
    optics: Any = None,
    focal_length_mm: float = 13.0,
    **laser: Any,
) -> Capture:
    """A dark plate of 6 m about the origin, turned about y by ``tilt`` [deg]."""
    half = 0.5 * np.radians(tilt)
    plate = {"plate": {"width_m": 6.0, "height_m": 6.0, "material": lambert(0.4)}}
    turn = [0.0, float(np.sin(half)), 0.0, float(np.cos(half))]
    scenario = scene(
        {
            "plate": {
                "model": plate,
                "position_icrf_m": [0, 0, 0],
                "quaternion_icrf_from_body_xyzw": turn,
            }
        },
        {
            "position_icrf_m": [0, 0, distance],
            "boresight": [0, 0, -1],
            "up": [0, 1, 0],
            "focal_length_mm": focal_length_mm,
            "lidar": {**LASER, **laser},
            "optics": optics or {},
        },
        sun_direction=(0.0, 0.0, -1.0),
    )
    with Simulator(scenario, gl) as simulator:
        state = scenario.at(scenario.epoch_tai_ns)
        wanted = {Product.LIDAR, Product.NORMALS, Product.TRUTH, Product.IRRADIANCE}
        return simulator.capture(state, "cam", wanted)


# Energy in the middle pixel by hand: intensity E / (2 pi (1 - cos half angle)) in the cone;
# irradiance I cos / d^2; radiance rho / pi of it; camera equation.
def by_hand(distance: float, cosine: float, half_angle_deg: float = 20.0) -> float:
    intensity = 0.02 / (2.0 * np.pi * (1.0 - np.cos(np.radians(half_angle_deg))))
    radiance = 0.4 / np.pi * intensity * cosine / distance**2
    return float(radiance * np.pi / 64.0 * 3.75e-6**2)


@pytest.mark.parametrize("distance", [20.0, 50.0, 200.0])
def test_the_return_falls_with_the_square_of_the_range(
    gl: moderngl.Context, distance: float
) -> None:
    lidar = taken(gl, distance).lidar
    assert lidar is not None
    # float32 through the lamp's products, and half a pixel off the axis: 1e-4.
    assert lidar.energy[64, 64] / by_hand(distance, 1.0) == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize("half_angle", [0.1, 1.0, 5.0])
def test_the_beam_is_a_cone_of_uniform_intensity_that_holds_the_pulse(
    gl: moderngl.Context, half_angle: float
) -> None:
    distance, radius = 100.0, 100.0 * np.tan(np.radians(half_angle))
    focal_length_mm = 60.0 * 3.75e-3 / np.tan(np.radians(half_angle))
    lidar = taken(gl, distance, focal_length_mm=focal_length_mm, beam_half_angle_deg=half_angle)
    assert lidar.lidar is not None
    row, column = np.indices(lidar.lidar.energy.shape) + 0.5
    # Of the place on the plate, in radii of the beam; the plate's edges are 3 m from its middle.
    off = np.hypot(row - 64.0, column - 64.0) / 60.0
    on = np.maximum(abs(row - 64.0), abs(column - 64.0)) / 60.0 * radius < 2.8
    lit = lidar.lidar.energy / by_hand(distance, 1.0, half_angle)
    # Lens, way and incidence fall by cos^7 in all. The edge takes 1 % of the radius on either side,
    # and half the diagonal of a pixel is 1.2 % of it.
    fall = np.cos(np.arctan(off * radius / distance)) ** 7
    inside, outside = on & (off < 0.975), on & (off > 1.025)
    assert inside.sum() > 100
    np.testing.assert_allclose(lit[inside], fall[inside], rtol=1e-4)
    assert not lit[outside].any()


def test_the_filter_passes_the_sunlight_of_its_wavelengths() -> None:
    for wavelength, low, high in (
        (905.0, 904.0, 906.0),
        (532.0, 531.0, 533.0),
        (999.5, 998.5, 1000.0),
    ):
        scenario = scene(
            {},
            {
                "position_icrf_m": [0, 0, 9.0],
                "boresight": [0, 0, -1],
                "lidar": {**LASER, "wavelength_nm": wavelength, "filter_nm": 2.0},
            },
        )
        lidar = scenario.cameras["cam"].lidar
        assert lidar is not None
        band = (500.0, 600.0) if wavelength < 600.0 else (700.0, 1000.0)
        edges = ((1e-9 * low, 1e-9 * high), (1e-9 * band[0], 1e-9 * band[1]))
        temperature = lidar.sun_temperature
        passed, whole = black_body_light(
            1.0, temperature, Bands(names=("filter", "band"), edges=edges)
        ).irradiance[:2]
        # The middles of 300 steps: 1e-6.
        assert lidar.filter_share == pytest.approx(passed / whole, rel=1e-5)


def test_the_return_falls_with_the_cosine_of_the_incidence(gl: moderngl.Context) -> None:
    lidar = taken(gl, 50.0, 60.0).lidar
    assert lidar is not None
    # Half a pixel off the axis the plate is 1e-4 nearer, and the cosine of 60 deg 2e-4 off.
    assert lidar.energy[64, 64] / by_hand(50.0, 0.5) == pytest.approx(1.0, abs=1e-3)


def test_ranges_scatter_as_the_light_allows(gl: moderngl.Context) -> None:
    exposure = taken(gl, 20.0, range_noise_m=0.005, pulse_energy_mj=2000.0)
    lidar, truth = exposure.lidar, exposure.truth
    assert lidar is not None
    assert truth is not None
    on = truth.depth > 0.0
    assert np.all(lidar.range[~on] == 0.0)
    hit = lidar.range > 0.0
    assert hit[on].all()
    # Pulse: c 10 ns / (2 x 2.355) = 0.64 m over the root of the electrons.
    electrons = lidar.electrons[on].mean()
    sigma = np.hypot(0.005, 0.6365 / np.sqrt(electrons))
    error = (lidar.range - truth.range)[on]
    count = on.sum()
    # Five standard errors; the electrons of the plate's rim are 5 % fewer.
    assert abs(error.mean()) < 5.0 * sigma / np.sqrt(count)
    assert error.std() == pytest.approx(sigma, rel=5.0 / np.sqrt(2.0 * count) + 0.03)


def test_an_emitter_beside_the_lens_measures_half_the_way(gl: moderngl.Context) -> None:
    exposure = taken(
        gl, 20.0, emitter_offset_m=[3.0, 0.0, 0.0], range_noise_m=0.0, pulse_energy_mj=1e6
    )
    assert exposure.lidar is not None
    # Pixel (64, 64) sees a point 3 mm off the axis.
    expected = 0.5 * (20.0 + np.hypot(20.0, 3.0))
    assert exposure.lidar.range[64, 64] == pytest.approx(expected, abs=2e-3)


def test_counts_follow_poissons_law() -> None:
    scenario = scene(
        {},
        {"position_icrf_m": [0, 0, 9.0], "boresight": [0, 0, -1], "lidar": LASER},
    )
    lidar = scenario.cameras["cam"].lidar
    assert lidar is not None
    lidar = replace(lidar, threshold=20.0)
    n = 200_000
    ranges, counted = detected(
        lidar, np.full(n, 30.0), np.full(n, 16.0), np.full(n, 9.0), np.random.default_rng(4)
    )
    # Five standard errors of mean and variance of 25 electrons.
    assert abs(counted.mean() - 25.0) < 5.0 * np.sqrt(25.0 / n)
    assert abs(counted.var() - 25.0) < 5.0 * np.sqrt((25.0 + 2 * 25.0**2) / n)
    np.testing.assert_array_equal(counted, np.round(counted))
    np.testing.assert_array_equal(ranges > 0.0, counted - 9.0 >= 20.0)


def test_the_same_pulse_gives_the_same_ranges(gl: moderngl.Context) -> None:
    first, again = taken(gl, 50.0).lidar, taken(gl, 50.0).lidar
    assert first is not None
    assert again is not None
    np.testing.assert_array_equal(first.range, again.range)


@pytest.mark.parametrize("optics", [{}, {"distortion": {"k1": -200.0, "p1": 0.3}}])
def test_range_is_the_distance_and_normals_are_those_of_the_plane(
    gl: moderngl.Context, optics: Any
) -> None:
    exposure = taken(gl, 200.0, 30.0, optics=optics)
    truth, normals = exposure.truth, exposure.normals
    assert truth is not None
    assert normals is not None
    seen = truth.depth > 0.0
    assert 0.1 < seen.mean() < 1.0
    # Camera axes: x right is ICRF x, y down, z along -z; the plate's normal leans to x.
    expected = np.array([np.sin(np.radians(30.0)), 0.0, -np.cos(np.radians(30.0))])
    np.testing.assert_allclose(normals.normals[seen], np.tile(expected, (seen.sum(), 1)), atol=1e-6)
    assert not normals.normals[~seen].any()
    # Every point lies on the plane n.p = n.(0, 0, 200).
    unit = sight_lines(truth.info.camera)
    unit /= np.linalg.norm(unit, axis=-1, keepdims=True)
    points = truth.range[..., None] * unit
    off = points[seen] @ expected - 200.0 * expected[2]
    # float32 depth and, with distortion, the nearest of pixels half as large: a quarter of a pixel
    # each way, of 200 m / 3467, times the sine of the tilt, and the barrel's stretch.
    assert np.abs(off).max() < (2e-4 if not optics else 0.01)
    np.testing.assert_array_equal(np.unique(truth.instance), [0, 1])


def test_photons_of_a_plate() -> None:
    """The worked example: 0.5, f/4, 1/2000 s, 3.75 um have 75 701 photons in 400-700 nm."""
    light = black_body_light(1367.0, 5777.0)
    irradiance = 0.5 / np.pi * light.irradiance * np.pi / 64.0
    irradiance[3] = 0.0
    scenario = scene({}, {"position_icrf_m": [0, 0, 9.0], "boresight": [0, 0, -1]})
    with_camera: Any = type("Info", (), {"camera": scenario.cameras["cam"]})
    frame = IrradianceFrame(
        info=with_camera,
        irradiance=irradiance[None, None].astype(np.float32),
        photons_per_joule=light.photons_per_joule,
    )
    assert frame.photons[0, 0] == pytest.approx(75701.26, rel=1e-6)
