"""Electrons of lamps with spectra of their own, against integration by hand over wavelength."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.physics.spectrum import planck_radiance
from simgl.scenario.loader import scenario_from_dict
from simgl.scene.lamps import beam_solid_angle
from simgl.simulator import Product, Simulator
from tests.scenes import lambert

Table = dict[str, Any]
Array = np.ndarray[Any, np.dtype[np.float64]]

H, C, K = 6.62607015e-34, 299792458.0, 1.380649e-23
NM = np.arange(400.0, 1000.0, 0.01) + 0.005

CURVES: dict[str, tuple[list[float], list[float]]] = {
    "qe": ([400, 550, 700, 1000], [0.45, 0.77, 0.55, 0.05]),
    "window": ([839.9, 840, 860, 860.1], [0.0, 0.9, 0.9, 0.0]),
    "red": ([400, 580, 620, 1000], [0.02, 0.03, 0.9, 0.6]),
    "green": ([400, 480, 530, 600, 1000], [0.03, 0.1, 0.85, 0.05, 0.5]),
    "blue": ([400, 450, 520, 1000], [0.7, 0.8, 0.05, 0.4]),
}


def _preset(folder: Path, *, window: bool, colour: bool) -> str:
    """A camera's file; the curve of a lamp next to it."""

    def table(name: str) -> str:
        nm, value = CURVES[name]
        return f"wavelength_nm = {nm}\nvalue = {value}\n"

    text = (
        'source = "a test"\nwidth_px = 32\nheight_px = 32\npixel_pitch_um = 5.0\n'
        "full_well_e = 1e9\nread_noise_e = 0.0\nbits = 12\npedestal_dn = 0\ngain_e_per_dn = 1e3\n"
    )
    text += 'mosaic = "RGGB"\n' if colour else ""
    text += "[qe]\n" + table("qe")
    text += "[window]\n" + table("window") if window else ""
    if colour:
        text += "".join(f"[filters.{c}]\n" + table(c) for c in ("red", "green", "blue"))
    (folder / "mine.toml").write_text(text)
    return str(folder / "mine.toml")


def _scene(preset: str, lamp: Table, **camera: Any) -> Table:
    """A white plate under a lamp 10 m above it, before a camera 30 m above."""
    white = {"plate": {"width_m": 12.0, "height_m": 12.0, "material": lambert(0.5)}}
    carrier = {"box": {"size_m": [0.2, 0.2, 0.2], "material": lambert(0.5)}}
    return {
        "epoch": {"utc": "2026-03-20T12:00:00"},
        "sun": {"irradiance_w_m2": 0.0, "direction_icrf": [0.0, 0.6, 0.8]},
        "earth": {"shape": "none"},
        "spacecraft": {
            "plate": {"model": white, "position_icrf_m": [0, 0, 0]},
            "carrier": {"model": carrier, "position_icrf_m": [0, 0, 10.1]},
        },
        "camera": {
            "cam": {
                "position_icrf_m": [2.0, 0, 30.0],
                "boresight": [0, 0, -1],
                "up": [0, 1, 0],
                "focal_length_mm": 5.0,
                "preset": preset,
                **camera,
            }
        },
        "lamp": {
            "spot": {
                "on": "carrier",
                "position_body_m": [0, 0, -0.1],
                "boresight": [0, 0, -1],
                "half_angle_deg": 30.0,
                **lamp,
            }
        },
    }


def _captured(gl: moderngl.Context, table: Table, *products: Product) -> Any:
    scenario = scenario_from_dict(table)
    with Simulator(scenario, gl) as simulator:
        return simulator.capture(scenario.at(scenario.epoch_tai_ns), "cam", products)


def _response(*names: str) -> Array:
    """Product of curves at NM."""
    return np.prod([np.interp(NM, *CURVES[n], left=0.0, right=0.0) for n in names], axis=0)


def _electrons(watts_per_sr: Array, response: Array) -> float:
    """Of a pixel in the middle, 2 m beside the lamp; watts_per_sr in bins of NM."""
    radiance = 0.5 / np.pi * watts_per_sr * 10.0 / 104.0**1.5
    photons = radiance * NM * 1e-9 / (H * C)
    return float(np.pi / (4.0 * 16.0) * (5e-6) ** 2 * 5e-4 * np.sum(photons * response))


BEAM = beam_solid_angle(*np.radians([30.0, 2.0]))


def _line(nm: float) -> Array:
    spectrum: Array = np.zeros(len(NM))
    spectrum[np.argmin(np.abs(NM - nm))] = 1.0
    return spectrum


def _spectra(folder: Path) -> dict[str, tuple[Table, Array]]:
    """Tables of lamps, and the power of each in bins of NM over its full power."""
    gauss = np.exp(-0.5 * ((NM - 850.0) / 17.0) ** 2)
    nm = np.arange(780.0, 921.0, 5.0)
    rows = "\n".join(f"{n},{np.exp(-0.5 * ((n - 850.0) / 17.0) ** 2)}" for n in nm)
    (folder / "led.csv").write_text("nm,power\n" + rows)
    planck = planck_radiance(NM * 1e-9, 3000.0) * 1e-11 * np.pi / (5.670374419e-8 * 3000.0**4)
    return {
        "line": ({"wavelength_nm": 850.0}, _line(850.0)),
        "lines": (
            {"wavelength_nm": [850.0, 525.0, 620.0], "line_weights": [1, 2, 1]},
            0.25 * _line(850.0) + 0.5 * _line(525.0) + 0.25 * _line(620.0),
        ),
        "curve": ({"wavelength_nm": str(folder / "led.csv")}, gauss / gauss.sum()),
        "black body": ({"temperature_k": 3000.0}, planck),
    }


@pytest.mark.parametrize("blurred", [False, True])
@pytest.mark.parametrize("window", [False, True])
@pytest.mark.parametrize("name", ["line", "lines", "curve", "black body"])
def test_electrons_of_a_lamp_are_those_of_its_spectrum(
    gl: moderngl.Context, tmp_path: Path, name: str, window: bool, blurred: bool
) -> None:
    lamp, power = _spectra(tmp_path)[name]
    optics = {"optics": {"aberration_um": 5.0, "vignetting": "none"}}
    camera = optics if blurred else {"optics": {"vignetting": "none"}}
    table = _scene(
        _preset(tmp_path, window=window, colour=False), {"power_w": 20.0, **lamp}, **camera
    )
    image = _captured(gl, table, Product.ELECTRONS).electrons.electrons
    response = _response("qe", "window") if window else _response("qe")
    expected = _electrons(20.0 / BEAM * power, response)
    # A spectrum's bins of 0.1 nm are 0.5 % of the window. A pixel is 3 cm of 10 m.
    np.testing.assert_allclose(image[15:17, 15:17].mean(), expected, rtol=0.007)


@pytest.mark.parametrize("name", ["line", "lines", "black body"])
def test_each_colour_has_the_electrons_of_its_own_filter(
    gl: moderngl.Context, tmp_path: Path, name: str
) -> None:
    lamp, power = _spectra(tmp_path)[name]
    preset = _preset(tmp_path, window=False, colour=True)
    table = _scene(preset, {"power_w": 20.0, **lamp}, optics={"vignetting": "none"})
    image = _captured(gl, table, Product.ELECTRONS).electrons.electrons
    for colour, rows, columns in (("red", 0, 0), ("green", 0, 1), ("green", 1, 0), ("blue", 1, 1)):
        expected = _electrons(20.0 / BEAM * power, _response("qe", colour))
        got = image[14:18, 14:18][rows::2, columns::2].mean()
        np.testing.assert_allclose(got, expected, rtol=0.007)


def test_radiance_is_physical_whatever_the_camera_counts(
    gl: moderngl.Context, tmp_path: Path
) -> None:
    preset = _preset(tmp_path, window=True, colour=False)
    line = _scene(preset, {"power_w": 20.0, "wavelength_nm": 850.0})
    bands = _scene(preset, {"power_w": [0.0, 0.0, 0.0, 20.0]})
    products = Product.RADIANCE, Product.ELECTRONS, Product.IRRADIANCE
    own, sunlike = (_captured(gl, table, *products) for table in (line, bands))
    np.testing.assert_array_equal(own.radiance.radiance, sunlike.radiance.radiance)
    np.testing.assert_array_equal(own.irradiance.irradiance, sunlike.irradiance.irradiance)
    ratio = own.electrons.electrons[16, 16] / sunlike.electrons.electrons[16, 16]
    assert 12.0 < ratio < 18.0


def test_sunlight_and_lamps_are_each_counted_with_their_own_spectrum(
    gl: moderngl.Context, tmp_path: Path
) -> None:
    preset = _preset(tmp_path, window=True, colour=False)
    table = _scene(preset, {"power_w": 20.0, "wavelength_nm": 850.0})
    sunny = {**table["sun"], "irradiance_w_m2": 1367.0}

    def electrons(lamp: Table, sun: Table) -> Array:
        spot = {**table["lamp"]["spot"], **lamp}
        if "power_w" in lamp:
            del spot["wavelength_nm"]
        one = {**table, "lamp": {"spot": spot}, "sun": sun}
        return np.asarray(_captured(gl, one, Product.ELECTRONS).electrons.electrons, np.float64)

    both, sunlight = electrons({}, sunny), electrons({"power_w": [0.0] * 4}, sunny)
    alone = electrons({}, table["sun"])
    np.testing.assert_allclose(both, sunlight + alone, rtol=1e-5)
