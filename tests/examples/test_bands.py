"""The worked examples of bands: electrons against integrals over wavelength done here.

Each integral runs over the product of all spectra; in the program each of them is averaged by
itself in each band. The goal is 0.5 % of electrons.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array
from simgl.physics.airglow import GLOW_DEPTH, glow_bottom, path_in_layers, zenith_glow
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.simulator import Capture, Product, Simulator

EXAMPLES = Path(__file__).parents[2] / "examples" / "bands"
CAMERAS = Path(__file__).parents[2] / "simgl" / "data" / "cameras"
H, C, K, SIGMA = 6.62607015e-34, 299792458.0, 1.380649e-23, 5.670374419e-8
GOAL = 5e-3


def _example(name: str, size: int, **camera: Any) -> Scenario:
    """An example with few pixels."""
    path = EXAMPLES / f"{name}.toml"
    data = tomllib.loads(path.read_text())
    for table in data["camera"].values():
        table |= {"width_px": size, "height_px": size, **camera}
    return scenario_from_dict(data, source=path)


def _taken(gl: moderngl.Context, scenario: Scenario) -> Capture:
    with Simulator(scenario, gl) as simulator:
        state = scenario.at(scenario.epoch_tai_ns)
        return simulator.capture(state, next(iter(scenario.cameras)), {Product.ELECTRONS})


def _electrons(capture: Capture) -> Array:
    assert capture.electrons is not None
    return capture.electrons.electrons.astype(np.float64)


def _curve(nm: Array, name: str) -> Array:
    """A CSV file of the examples at wavelengths [nm]."""
    given, value = np.loadtxt(EXAMPLES / name, delimiter=",", skiprows=1).T
    return np.interp(nm, given, value)


def _efficiency(nm: Array, preset: Path) -> Array:
    table = tomllib.loads(preset.read_text())["qe"]
    return np.interp(nm, table["wavelength_nm"], table["value"])


def _planck(nm: Array, temperature: float) -> Array:
    """Black-body radiance [W m-2 sr-1 nm-1]."""
    m = nm * 1e-9
    return 1e-9 * 2.0 * H * C**2 / m**5 / np.expm1(H * C / (m * K * temperature))


def _sunlight(nm: Array) -> Array:
    """[W m-2 nm-1] at 1 au."""
    return 1361.0 * _planck(nm, 5772.0) * np.pi / (SIGMA * 5772.0**4)


def _of_a_pixel(nm: Array, radiance: Array, efficiency: Array, **lens: float) -> float:
    """Electrons by a radiance [W m-2 sr-1 nm-1], at equal steps of wavelength."""
    photons = np.sum(radiance * efficiency * nm * 1e-9) * (nm[1] - nm[0]) / (H * C)
    per_photon = np.pi * lens["transmission"] / (4.0 * lens["f_number"] ** 2)
    return float(photons * per_photon * lens["pitch"] ** 2 * lens["time"])


def test_a_board_in_the_light_of_an_led_behind_its_filter(gl: moderngl.Context) -> None:
    seen = _electrons(_taken(gl, _example("led_camera", 49)))
    nm = np.arange(790.0, 915.0, 0.02) + 0.01
    led = _curve(nm, "led_850.csv")
    solid_angle = _beam(np.radians(12.0), np.radians(2.0))
    # The lamp stands 4.5 m from the board and 0.1 m aside of the pixel in the middle.
    distance = np.hypot(4.5, 0.1)
    irradiance = 2.0 / solid_angle / distance**2 * (4.5 / distance)
    through = np.interp(nm, [836, 841, 859, 864], [0, 0.92, 0.92, 0])
    spectral = led / (np.sum(led) * 0.02) * through
    radiance = irradiance * spectral * _curve(nm, "white_paint.csv") / np.pi
    expected = _of_a_pixel(
        nm,
        radiance,
        _efficiency(nm, CAMERAS / "imx174.toml"),
        transmission=0.9,
        f_number=4.0,
        pitch=5.86e-6,
        time=0.1,
    )
    assert seen[24, 24] == pytest.approx(expected, rel=GOAL)


def _beam(half: float, edge: float) -> float:
    """Solid angle of a beam, weighted by its profile [sr]: half a cosine beyond the cone."""
    angle = np.linspace(0.0, half + edge, 20_001)
    profile = 0.5 + 0.5 * np.cos(np.pi * np.clip((angle - half) / edge, 0.0, 1.0))
    return float(2.0 * np.pi * np.trapezoid(profile * np.sin(angle), angle))


def test_a_painted_board_in_sunlight_from_1000_to_1700_nm(gl: moderngl.Context) -> None:
    seen = _electrons(_taken(gl, _example("swir", 129)))
    nm = np.arange(1000.0, 1700.0, 0.05) + 0.025
    cosine = 0.9 / np.sqrt(0.3**2 + 0.2**2 + 0.9**2)
    radiance = _sunlight(nm) * cosine * _curve(nm, "white_paint.csv") / np.pi
    expected = _of_a_pixel(
        nm,
        radiance,
        _efficiency(nm, EXAMPLES / "swir_ingaas.toml"),
        transmission=0.9,
        f_number=4.0,
        pitch=15e-6,
        time=0.00002,
    )
    # 5 px of 4 mm left of the middle: cos^4 of 5e-4 rad is 1.
    assert seen[64, 30] == pytest.approx(expected, rel=GOAL)


# Stars of the example with their pixel, V, B-V and V-I: one as the Sun, and Rigel.
STARS = {27435: (169, 344, 5.965, 0.639, 0.700), 24436: (458, 486, 0.12, -0.03, 0.03)}


def _star(nm: Array, v: float, b_v: float, v_i: float) -> Array:
    """Spectral irradiance [W m-2 nm-1] through the fluxes at B, V and I, as physics/starlight."""
    at = 1.0 / np.array([438.0, 545.0, 798.0])
    zero = np.array([6.32e-11, 3.631e-11, 1.126e-11])
    flux = np.log(zero / at**5) - 0.4 * np.log(10.0) * np.array([v + b_v, v, v - v_i])
    blue, red = (flux[0] - flux[1]) / (at[0] - at[1]), (flux[2] - flux[1]) / (at[2] - at[1])
    curve = np.exp(flux[1] + np.where(nm < 545.0, blue, red) * (1.0 / nm - at[1])) / nm**5
    measured = np.select([nm < 500.0, nm < 600.0, nm < 700.0], [1.0630, 1.0332, 1.0164], 1.0705)
    return curve * measured


def test_stars_of_a_tracker_from_400_to_900_nm(gl: moderngl.Context) -> None:
    seen = _electrons(_taken(gl, _example("star_tracker", 512)))
    nm = np.arange(400.0, 900.0, 0.05) + 0.025
    efficiency = _efficiency(nm, CAMERAS / "has2.toml")
    area, time, transmission = np.pi / 4.0 * (0.035 / 2.0) ** 2, 0.2, 0.85
    off = {}
    for number, (x, y, *magnitudes) in STARS.items():
        photons = _star(nm, *magnitudes) * efficiency * nm * 1e-9
        expected = float(np.sum(photons) * 0.05 / (H * C)) * area * time * transmission
        # The aperture is foreshortened.
        expected *= float(np.cos(np.arctan(np.hypot(x - 256, y - 256) * 18e-6 / 0.035)))
        around = seen[y - 8 : y + 9, x - 8 : x + 9]
        # What the sky gives, next to the star.
        sky = 17**2 * np.median(around)
        off[number] = float(around.sum() - sky) / expected - 1.0
    assert abs(off[27435]) < GOAL
    # In each band a star counts as sunlight of its irradiance: 1.3 % too much for Rigel, whose
    # light leans towards the blue end.
    assert 0.005 < off[24436] < 0.02


def _before_the_limb(shape: str) -> Scenario:
    """The star tracker with the polar night's limb 6.5 deg below its boresight."""
    path = EXAMPLES / "star_tracker.toml"
    data = tomllib.loads(path.read_text())
    camera = data["camera"]["tracker"] | {"width_px": 512, "height_px": 512}
    boresight = np.array(camera["boresight"]) / np.linalg.norm(camera["boresight"])
    up = np.array([0.0, 0.0, 1.0]) - boresight[2] * boresight
    down = np.arcsin(6371.0 / 6900.0) + np.radians(6.5)
    towards = np.cos(down) * boresight - np.sin(down) * up / np.linalg.norm(up)
    camera["position_icrf_m"] = (-6.9e6 * towards).tolist()
    data["camera"]["tracker"] = camera
    data["earth"] = {"shape": shape}
    return scenario_from_dict(data, source=path)


def test_a_star_tracker_has_the_limb_behind_its_stars(gl: moderngl.Context) -> None:
    # A star 4 deg above the limb keeps its electrons.
    seen = {shape: _electrons(_taken(gl, _before_the_limb(shape))) for shape in ("wgs84", "none")}
    x, y = STARS[27435][:2]
    around = {name: image[y - 8 : y + 9, x - 8 : x + 9] for name, image in seen.items()}
    light = {name: part.sum() - 17**2 * np.median(part) for name, part in around.items()}
    assert light["wgs84"] == pytest.approx(light["none"], rel=GOAL)
    # The Earth covers the lowest rows and hides their stars.
    assert np.abs(seen["wgs84"][490:] - seen["none"][490:]).max() > 100.0


def test_the_bright_line_beside_the_limb_is_the_airglow_seen_along_its_layers(
    gl: moderngl.Context,
) -> None:
    # A line of sight that grazes the bottom of a layer of 10 km goes 720 km through it: 72 times
    # the zenith's light (van Rhijn 1921), from hydroxyl at 82 km and oxygen at 91 km.
    radiance = {}
    for shape in ("wgs84", "none"):
        scenario = _before_the_limb(shape)
        state = scenario.at(scenario.epoch_tai_ns)
        with Simulator(scenario, gl) as simulator:
            frame = simulator.capture(state, "tracker", {Product.RADIANCE}).radiance
        assert frame is not None
        radiance[shape] = frame.radiance[:, 256].astype(np.float64)
    # Without the stars behind.
    glow = radiance["wgs84"] - radiance["none"]
    placed = state.cameras["tracker"]
    rows = np.arange(512.0 * 20.0) / 20.0 + 0.025
    lines = placed.camera.rays(np.stack([np.full_like(rows, 256.5), rows], axis=-1))
    lines = lines @ placed.R_camera_from_icrf
    lines /= np.linalg.norm(lines, axis=1, keepdims=True)
    # The Earth's axis is ICRF's to 0.15 deg. In the space where the Earth is a sphere, as drawn.
    stretch = np.array([1.0, 1.0, 6378137.0 / 6356752.3])
    eye, ways = placed.position * stretch, lines * stretch
    along = -(ways @ eye) / np.einsum("ki,ki->k", ways, ways)
    height = np.linalg.norm(eye + along[:, None] * ways, axis=1) - 6378137.0
    path = 2.0 * path_in_layers(6378137.0, height, scenario.bands) / GLOW_DEPTH
    wanted = zenith_glow(from_below=False, bands=scenario.bands) * path
    wanted = wanted.reshape(512, 20, 4).mean(axis=1)
    high = height.reshape(512, 20).min(axis=1) > 72e3
    # A pixel is 1.1 km high; a row too high or low by 0.15 km moves the steep rim by 4 %.
    brightest = wanted[high].max(axis=0)
    np.testing.assert_allclose(glow[high], wanted[high], atol=0.08 * brightest.max(), rtol=0.05)
    np.testing.assert_allclose(glow[high].max(axis=0), brightest, rtol=0.03)
    middles = height.reshape(512, 20).mean(axis=1)[high]
    peaks = middles[glow[high].argmax(axis=0)]
    # The row that holds a layer's bottom is half dark; the next one's middle is 1.5 rows higher.
    np.testing.assert_allclose(peaks, glow_bottom(scenario.bands), atol=1.8e3)
    times = brightest / zenith_glow(from_below=False, bands=scenario.bands)
    assert np.all((times > 60.0) & (times < 73.0))
