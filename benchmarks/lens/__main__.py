"""``python -m benchmarks.lens --out DIR``: one scene through each fault of a lens and through all
of them, as a sheet; the time of the spread at 1280 x 960; its distance from the reference."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
import typer
from PIL import Image

from benchmarks.record import write_record
from simgl.arrays import Array32, Image8
from simgl.camera.camera import Camera, Detector, Lens
from simgl.camera.lens import Blur, PointSpread
from simgl.camera.point_spread import Spread
from simgl.config.validation import read_toml
from simgl.display_images import contact_sheet, display_from_linear
from simgl.output import check_writable, complete_file
from simgl.scenario.loader import scenario_from_dict
from simgl.simulator import Product, Simulator
from tests.reference.optics import convolved, point_spread

HERE = Path(__file__).parent

BARREL = {"k1": -0.35, "k2": 0.1, "p1": 0.002}
EFFECTS: dict[str, dict[str, Any]] = {
    "pinhole": {"vignetting": "none"},
    "cos^4": {},
    "distortion": {"distortion": BARREL},
    "diffraction": {"diffraction": True},
    "aberration 15 um": {"aberration_um": 15.0},
    "defocus 400 um": {"diffraction": True, "defocus_um": 400.0},
    "blur growing outwards": {"field_zones": [{"at": 1.0, "aberration_um": 40.0}]},
    "veiling glare 1 %": {"veiling_glare": 0.01},
    "ghosts of a triplet": {"surfaces": "triplet", "coating_reflectance": 0.01},
    "all": {
        "distortion": BARREL,
        "diffraction": True,
        "aberration_um": 5.0,
        "field_zones": [{"at": 1.0, "aberration_um": 15.0}],
        "veiling_glare": 0.0005,
        "surfaces": "triplet",
        "coating_reflectance": 0.01,
    },
}
# The faint half of each picture is brightened by so much.
FAINT = 30.0
_WIDTH, _HEIGHT = 1280, 960


class Record(msgspec.Struct, frozen=True, kw_only=True):
    """What the last run found.

    spread_cpu_ms : medians of the CPU time, all cores together, of the spread of a frame of
        1280 x 960 at f/4 with a glint in it
    veil_error : of the light in the dark, by its distance from a sunlit panel [pixels]
    """

    spread_cpu_ms: dict[str, float]
    veil_error: dict[str, float]


def sheet() -> Image8:
    """Each effect, and below it the same with its faint parts brightened."""
    panels: dict[str, Image8] = {}
    data = read_toml(HERE / "scene.toml")
    for name, optics in EFFECTS.items():
        scenario = scenario_from_dict(
            {**data, "camera": {"nav": {**data["camera"]["nav"], "optics": optics}}}
        )
        with Simulator(scenario) as simulator:
            state = scenario.at(scenario.epoch_tai_ns)
            frame = simulator.capture(state, "nav", {Product.ELECTRONS}).electrons
        assert frame is not None
        share = frame.electrons / np.float32(frame.info.camera.detector.full_well)
        panels[name] = display_from_linear(share)
        panels[f"{name} x {FAINT:g}"] = display_from_linear(share * np.float32(FAINT))
    return contact_sheet(panels, columns=4)


def _camera() -> Camera:
    detector = Detector(
        width=_WIDTH,
        height=_HEIGHT,
        pixel_pitch=3.75e-6,
        quantum_efficiency=(0.7, 0.77, 0.65, 0.3),
        full_well=24500.0,
        read_noise=4.0,
        bits=12,
        pedestal=64.0,
        gain_dn_per_e=0.16,
    )
    lens = Lens(focal_length=8e-3, f_number=4.0, spread=PointSpread())
    return Camera(name="nav", lens=lens, detector=detector, exposure_time=5e-4)


def _panel() -> Array32:
    """A sunlit panel and a glint, irradiance of four bands [W m-2]."""
    planes = np.zeros((4, _HEIGHT, _WIDTH), dtype=np.float32)
    planes[:, 250:700, 200:500] = np.array([1.9, 2.1, 2.1, 3.8], dtype=np.float32)[:, None, None]
    planes[:, 300, 900] = 900.0
    return planes


def spread_times() -> dict[str, float]:
    """Medians of ten [ms]. CPU time, since machines are shared."""
    planes = _panel()
    filters = np.array([[1.0, 0.1, 0.1, 0.5], [0.1, 0.9, 0.1, 0.5], [0.1, 0.1, 0.8, 0.5]])
    times = {}
    for name, spread in (
        ("four bands", Spread(_camera())),
        ("three colours", Spread(_camera(), filters)),
        ("monochrome", Spread(_camera(), filters[:1])),
    ):
        mixed = list(np.einsum("pb,bhw->phw", spread.mixture, planes).astype(np.float32))
        spans = []
        for _ in range(12):
            start = time.process_time()
            spread.apply(mixed)
            spans.append(1e3 * (time.process_time() - start))
        times[name] = round(float(np.median(spans[2:])), 1)
    return times


def veil_errors() -> dict[str, float]:
    """Fast against the reference, on a grid in which nothing comes back, in the green band."""
    planes = _panel()
    image = Spread(_camera()).apply(list(planes))[1]
    kernel = point_spread(_camera(), Blur(), 1, 1, 4096)
    wanted = convolved(planes[1].astype(np.float64), kernel)
    errors = image / wanted - 1.0
    return {
        str(d): round(float(errors[400:550, 499 + d].mean()), 4) for d in (2, 10, 50, 100, 200, 400)
    }


def main(
    out: Annotated[Path, typer.Option(help="Folder for sheet and record.")],
) -> None:
    """Draw the sheet, time the spread, compare it with the reference."""
    check_writable(out)
    with complete_file(out / "effects.png") as temporary:
        Image.fromarray(sheet()).save(temporary)
    record = Record(
        spread_cpu_ms=spread_times(),
        veil_error=veil_errors(),
    )
    write_record(out / "record.json", record)
    print((out / "record.json").read_text())


if __name__ == "__main__":
    typer.run(main)
