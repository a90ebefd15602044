"""Scenes in bands of their own: electrons against integrals over wavelength done here."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import OpenEXR
import pytest

from simgl.output import write_capture
from simgl.scenario.loader import scenario_from_dict
from simgl.simulator import Capture
from tests.scenes import SUN, Table, capture

H, C, K = 6.62607015e-34, 299792458.0, 1.380649e-23
PAINT = ([300.0, 800.0, 900.0, 1700.0], [0.1, 0.3, 0.7, 0.5])
FILTER = ([838.0, 842.0, 858.0, 862.0], [0.0, 0.9, 0.9, 0.0])
EFFICIENCY = 0.4
TIME, PITCH, F_NUMBER = 1e-3, 5e-6, 4.0


def _csv(path: Path, curve: tuple[list[float], list[float]]) -> str:
    path.write_text("".join(f"{nm},{value}\n" for nm, value in zip(*curve, strict=True)))
    return str(path)


def _scene(material: Table | str, bands: Table, **tables: Any) -> Table:
    """A plate across the boresight, the Sun behind the camera."""
    plate = {"plate": {"width_m": 9.0, "height_m": 9.0, "material": material}}
    return {
        "epoch": {"utc": "2026-03-20T12:00:00"},
        "bands": bands,
        "sun": {**SUN, "direction_icrf": [0.0, 0.0, 1.0]},
        "earth": {"shape": "none"},
        "spacecraft": {"plate": {"model": plate, "position_icrf_m": [0, 0, 0]}},
        "camera": {
            "cam": {
                "position_icrf_m": [0, 0, 50.0],
                "look_at": "plate",
                "width_px": 33,
                "height_px": 33,
                "pixel_pitch_um": 1e6 * PITCH,
                "f_number": F_NUMBER,
                "exposure_time_s": TIME,
                "quantum_efficiency": EFFICIENCY,
            }
        },
        **tables,
    }


def _taken(gl: moderngl.Context, tables: Table) -> Capture:
    return capture(gl, scenario_from_dict(tables))


def _electrons(power: Any, nm: Any) -> float:
    """Of a pixel, for spectral radiance [W m-2 sr-1 nm-1] at equal steps of wavelength [nm]."""
    photons = np.sum(power * nm * 1e-9) * (nm[1] - nm[0]) / (H * C)
    return float(photons * np.pi / (4.0 * F_NUMBER**2) * PITCH**2 * TIME * EFFICIENCY)


def _sunlight(nm: Any) -> Any:
    """Of the study's Sun [W m-2 nm-1]."""
    m = nm * 1e-9
    planck = 2.0 * H * C**2 / m**5 / np.expm1(H * C / (m * K * 5777.0))
    return 1367.0 * planck * 1e-9 * np.pi / (5.670374419e-8 * 5777.0**4)


def _in_two_bands(folder: Path) -> Table:
    """A measured paint in two bands."""
    paint = _csv(folder / "paint.csv", PAINT)
    edges = [[840.0, 860.0], [1000.0, 1700.0]]
    return _scene({"reflectance": paint}, {"edges_nm": edges, "names": ["led", "swir"]})


def test_a_measured_paint_gives_the_electrons_of_its_spectrum(
    gl: moderngl.Context, tmp_path: Path
) -> None:
    two_bands = _taken(gl, _in_two_bands(tmp_path))
    assert two_bands.electrons is not None
    expected = 0.0
    for low, high in ((840.0, 860.0), (1000.0, 1700.0)):
        nm = np.arange(low, high, 0.01) + 0.005
        power = _sunlight(nm) * np.interp(nm, *PAINT) / np.pi
        expected += _electrons(power, nm)
    # Steps of 1 nm; by watts the paint's mean would be 1.2 % more.
    assert float(two_bands.electrons.electrons[16, 16]) == pytest.approx(expected, rel=1e-4)
    radiance = two_bands.radiance
    assert radiance is not None
    # Channels without a band are zero, and in no file.
    assert radiance.radiance[16, 16, :2].min() > 0.0
    assert not radiance.radiance[..., 2:].any()
    write_capture(two_bands, tmp_path, "cam")
    with OpenEXR.File(str(tmp_path / "cam.radiance.exr"), separate_channels=True) as file:
        header, channels = file.header(), file.channels()
        assert set(channels) == {"led", "swir", "Z", "partId"}
        np.testing.assert_array_equal(channels["led"].pixels, radiance.radiance[..., 0])
        assert header["bandsNm"] == "led 840-860, swir 1000-1700"
        assert len(header["sunIrradianceBandsWM2"].split()) == 2


def test_a_lamp_through_a_filter_gives_the_electrons_of_its_line(
    gl: moderngl.Context, tmp_path: Path
) -> None:
    bands = {"filter": _csv(tmp_path / "filter.csv", FILTER)}
    lamp = {
        "on": "carrier",
        "position_body_m": [0, 0, -0.1],
        "boresight": [0, 0, -1],
        "half_angle_deg": 30.0,
        "power_w": 50.0,
    }
    tables = _scene({"reflectance": 0.5}, bands, sun={**SUN, "direction_icrf": [0.0, 0.0, -1.0]})
    carrier = {"box": {"size_m": [0.2, 0.2, 0.2], "material": {"reflectance": 0.5}}}
    tables["spacecraft"]["carrier"] = {"model": carrier, "position_icrf_m": [0.9, 0, 10.1]}
    line, many = (
        _taken(gl, {**tables, "lamp": {"led": {**lamp, "wavelength_nm": nm}}})
        for nm in (841.0, [841.0, 950.0])
    )
    assert line.electrons is not None
    assert line.radiance is not None
    assert many.electrons is not None
    # 0.675 of 841 nm passes; each watt that is left makes photons of 841 nm.
    radiance = float(line.radiance.radiance[16, 16, 0])
    per_radiance = np.pi / (4.0 * F_NUMBER**2) * PITCH**2 * TIME * EFFICIENCY * 841e-9 / (H * C)
    # float32 through some ten products.
    electrons = float(line.electrons.electrons[16, 16])
    assert electrons == pytest.approx(radiance * per_radiance, rel=1e-5)
    solid_angle = 2.0 * np.pi * (1.0 - np.cos(np.radians(30.0)))
    # The lamp stands 0.9 m aside of the pixel; the edge of 2 deg adds 7 % to its solid angle.
    cosine = 10.0 / np.hypot(10.0, 0.9)
    bound = 0.675 * 50.0 / solid_angle * cosine**4 / 100.0 * 0.5 / np.pi
    assert 0.9 * bound < radiance < bound
    # Half the power is where the filter lets nothing through.
    assert float(many.electrons.electrons[16, 16]) == pytest.approx(0.5 * electrons, rel=1e-5)
