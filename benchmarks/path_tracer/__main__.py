"""``python -m benchmarks.path_tracer --out DIR``: compares both scenes and prints a table."""

from __future__ import annotations

import time
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from benchmarks.path_tracer import pictures
from benchmarks.path_tracer.compare import Agreement, Difference, difference
from benchmarks.path_tracer.lambertian import lambertian_scenario
from benchmarks.path_tracer.tracer import BANDS, PARTS, Traced, mitsuba, plate_error, trace
from simgl import Exposure, Product, Scenario, Simulator
from simgl.bench import machine
from simgl.output import check_writable, write_exr
from simgl.scene.state import SceneState, SunInDirection

HERE = Path(__file__).parent
# Brightening of the pictures: the second scene has no direct sunlight in view.
GAINS = {"bay": 1.5, "earth": 6.0}
_FRAMES = 10


class SceneRecord(msgspec.Struct, frozen=True, kw_only=True):
    """One scene.

    plate_error : of the tracer's Sun on a plate of known radiance
    simgl_ms : median of frames in which the Sun has moved, so that nothing is kept
    """

    name: str
    width: int
    height: int
    samples: int
    plate_error: float
    agreement: Agreement
    tracer_s: float
    simgl_ms: float
    time_ratio: float


class Record(msgspec.Struct, frozen=True, kw_only=True):
    """What ``results.json`` holds."""

    date: str
    machine: str
    renderer: str
    tracer: str
    scenes: list[SceneRecord]


def main(
    out: Annotated[Path, typer.Option(help="Folder for pictures and results.json.")],
    samples: Annotated[int, typer.Option(min=PARTS, help="Paths a pixel of the tracer.")] = 1024,
) -> None:
    """Compare simgl with Mitsuba 3 on the scenes of this folder."""
    mitsuba()
    check_writable(out)
    console = Console()
    found = [_compared(path, samples, out, console) for path in sorted(HERE.glob("*.toml"))]
    record = Record(
        date=datetime.now(UTC).date().isoformat(),
        machine=machine(),
        renderer=found[0][1],
        tracer=found[0][2],
        scenes=[scene for scene, _, _ in found],
    )
    text = msgspec.json.format(msgspec.json.encode(record), indent=2) + b"\n"
    (out / "results.json").write_bytes(text)
    console.print(_table(record))


def _compared(
    path: Path, samples: int, out: Path, console: Console
) -> tuple[SceneRecord, str, str]:
    """One scene by both, and the names of the renderers."""
    scenario = lambertian_scenario(path)
    state = scenario.at(scenario.epoch_tai_ns)
    exposure, frame_ms, renderer = _simgl(scenario, state)
    with Progress(console=console, transient=True) as bar:
        task = bar.add_task(f"{path.stem}: path tracer", total=PARTS)
        traced = trace(state, state.cameras["cam"], samples, lambda: bar.advance(task))
    assert exposure.radiance is not None
    ours = exposure.radiance.radiance[..., list(BANDS)].astype(np.float64)
    found = difference(ours, traced.radiance, traced.error)
    _write(out, path.stem, exposure, ours, traced, found)
    origin = next(iter(state.bodies.values())).pose.position
    scene = SceneRecord(
        name=path.stem,
        width=ours.shape[1],
        height=ours.shape[0],
        samples=samples // PARTS * PARTS,
        plate_error=plate_error(state.sun.seen_from(origin)),
        agreement=found.agreement,
        tracer_s=traced.seconds,
        simgl_ms=frame_ms,
        time_ratio=1e3 * traced.seconds / frame_ms,
    )
    return scene, renderer, f"Mitsuba {traced.version}, scalar_rgb"


def _simgl(scenario: Scenario, state: SceneState) -> tuple[Exposure, float, str]:
    """The picture, the time of a frame [ms] and the renderer's name."""
    products = {Product.RADIANCE}
    with Simulator(scenario) as simulator:
        exposure = simulator.capture(state, "cam", products)
        seconds = []
        for step in range(_FRAMES):
            moved = _sun_moved(state, 1e-4 * (step + 1))
            start = time.perf_counter()
            simulator.capture(moved, "cam", products)
            seconds.append(time.perf_counter() - start)
    return exposure, 1e3 * float(np.median(seconds)), simulator.renderer_name


def _sun_moved(state: SceneState, angle: float) -> SceneState:
    assert isinstance(state.sun, SunInDirection)
    direction = state.sun.direction_icrf + angle * np.array([1.0, 0.0, 0.0])
    return replace(state, sun=replace(state.sun, direction_icrf=direction))


def _write(
    out: Path, name: str, exposure: Exposure, ours: np.ndarray, traced: Traced, found: Difference
) -> None:
    assert exposure.radiance is not None
    write_exr(out / f"{name}.simgl.exr", exposure.radiance)
    gain = GAINS.get(name, 1.0)
    left, middle = pictures.shown(ours, gain), pictures.shown(traced.radiance, gain)
    right = pictures.signed(found.relative)
    pictures.write_png(out / f"{name}.simgl.png", left)
    pictures.write_png(out / f"{name}.reference.png", middle)
    pictures.write_png(out / f"{name}.difference.png", right)
    pictures.write_png(out / f"{name}.png", left, middle, right)


def _table(record: Record) -> Table:
    table = Table(title=f"{record.renderer} against {record.tracer}")
    for heading in ("", *(scene.name for scene in record.scenes)):
        table.add_column(heading)
    for row in zip(*map(_column, record.scenes), strict=True):
        table.add_row(row[0][0], *(text for _, text in row))
    return table


def _column(scene: SceneRecord) -> list[tuple[str, str]]:
    a = scene.agreement
    return [
        ("mean radiance", f"{a.mean_ratio:.4f}"),
        ("pixels within 10 %", f"{a.within_10_percent:.1%}"),
        ("  brighter than 1/10 of the mean", f"{a.within_10_percent_bright:.1%}"),
        ("  weighted by radiance", f"{a.within_10_percent_by_light:.1%}"),
        ("median difference", f"{a.median_difference:+.2%}"),
        ("tracer's noise, median, p95", f"{a.noise_median:.1%}, {a.noise_p95:.1%}"),
        ("misalignment", ", ".join(f"{v:+.3f}" for v in a.misalignment_px) + " px"),
        ("plate of known radiance", f"{scene.plate_error:.1e}"),
        ("path tracer", f"{scene.tracer_s:.1f} s"),
        ("simgl", f"{scene.simgl_ms:.0f} ms"),
        ("time ratio", f"{scene.time_ratio:.0f}"),
    ]


if __name__ == "__main__":
    typer.run(main)
