"""``python -m benchmarks.path_tracer --out DIR``: compares both scenes and prints a table.

The tracer's pictures stay in DIR: another run there draws only simgl's.
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from benchmarks.path_tracer import difference_images
from benchmarks.path_tracer.compare import Agreement, Difference, difference
from benchmarks.path_tracer.tracer import (
    NEAR_INFRARED,
    PARTS,
    VISIBLE,
    Traced,
    mitsuba,
    plate_error,
    trace,
)
from benchmarks.record import write_record
from simgl import Capture, Product, Scenario, Simulator
from simgl.bench.peers.lambertian import lambertian_scenario
from simgl.display_colours import WHITE_RADIANCE
from simgl.output import check_writable, write_exr
from simgl.scene.state import SceneState, SunInDirection
from simgl.view.frame_view import Gather

HERE = Path(__file__).parent
# Brightening of the pictures: the second scene has no direct sunlight in view.
GAINS = {"bay": 1.5, "earth": 6.0}
# Paths a pixel: of R, G and B together, and of N. Deep shadows need many.
PATHS = {"bay": (16384, 2048), "earth": (4096, 1024)}
_GATHERS: tuple[Gather, ...] = ("vertex", "pixel")


class WayRecord(msgspec.Struct, frozen=True, kw_only=True):
    """simgl's picture with light of other surfaces worked out in one way.

    visible, near_infrared : of R, G and B together, and of N
    cpu_ms : processor time of a frame; by vertices of one after which the Sun has moved
    """

    gather: str
    visible: Agreement
    near_infrared: Agreement
    cpu_ms: float


class SceneRecord(msgspec.Struct, frozen=True, kw_only=True):
    """One scene.

    samples : paths of the tracer, R, G and B together, and N
    plate_error : of the tracer's Sun on a plate of known radiance
    tracer_cpu_s : processor time of the picture in R, G and B
    time_ratio : of that to a frame by vertices
    """

    name: str
    width: int
    height: int
    samples: list[int]
    plate_error: float
    ways: list[WayRecord]
    tracer_cpu_s: float
    time_ratio: float


class Record(msgspec.Struct, frozen=True, kw_only=True):
    """What ``results.json`` holds."""

    renderer: str
    tracer: str
    scenes: list[SceneRecord]


def main(
    out: Annotated[Path, typer.Option(help="Folder for pictures and results.json.")],
) -> None:
    """Compare simgl with Mitsuba 3 on the scenes of this folder."""
    version = str(mitsuba().__version__)
    check_writable(out)
    console = Console()
    paths = sorted(HERE.glob("*.toml"))
    scenes = [_compared(path, out, console) for path in paths]
    record = Record(
        renderer=scenes[0][1],
        tracer=f"Mitsuba {version}, scalar_rgb",
        scenes=[scene for scene, _ in scenes],
    )
    write_record(out / "results.json", record)
    console.print(_table(record))


def _compared(path: Path, out: Path, console: Console) -> tuple[SceneRecord, str]:
    """One scene by both, and the name of simgl's renderer."""
    samples = PATHS[path.stem]
    scenario = lambertian_scenario(path)
    state = scenario.at(scenario.epoch_tai_ns)
    with Progress(console=console, transient=True) as bar:
        task = bar.add_task(f"{path.stem}: path tracer", total=2 * PARTS)
        visible, infrared = (
            trace(state, state.cameras["cam"], bands, count, out, lambda: bar.advance(task))
            for bands, count in zip((VISIBLE, NEAR_INFRARED), samples, strict=True)
        )
    ways, renderer = [], ""
    for gather in _GATHERS:
        console.print(f"{path.stem}: {gather}")
        exposure, cpu_ms, renderer = _simgl(replace(scenario, gather=gather), state)
        assert exposure.radiance is not None
        ours = exposure.radiance.radiance.astype(np.float64)
        visible_difference = difference(ours[..., list(VISIBLE)], visible.radiance, visible.error)
        in_n = difference(ours[..., 3:], infrared.radiance[..., :1], infrared.error[..., :1])
        _write(out, f"{path.stem}.{gather}", exposure, visible, visible_difference)
        console.print(
            f"  within 10 %: {visible_difference.agreement.within_10_percent:.1%}, {cpu_ms:.0f} ms"
        )
        ways.append(
            WayRecord(
                gather=gather,
                visible=visible_difference.agreement,
                near_infrared=in_n.agreement,
                cpu_ms=cpu_ms,
            )
        )
    origin = next(iter(state.bodies.values())).pose.position
    detector = state.cameras["cam"].camera.detector
    scene = SceneRecord(
        name=path.stem,
        width=detector.width,
        height=detector.height,
        samples=list(samples),
        plate_error=plate_error(state.sun.seen_from(origin)),
        ways=ways,
        tracer_cpu_s=visible.cpu_seconds,
        time_ratio=1e3 * visible.cpu_seconds / ways[0].cpu_ms,
    )
    return scene, renderer


def _simgl(scenario: Scenario, state: SceneState) -> tuple[Capture, float, str]:
    """The picture, the processor time of a frame [ms] and the renderer's name."""
    products = {Product.RADIANCE}
    with Simulator(scenario) as simulator:
        if scenario.gather == "vertex":
            # Programs are linked and patches traced, but nothing of the picture is kept.
            simulator.capture(_sun_moved(state, 1e-3), "cam", products)
        start = time.process_time()
        exposure = simulator.capture(state, "cam", products)
        seconds = time.process_time() - start
    return exposure, 1e3 * seconds, simulator.renderer_name


def _sun_moved(state: SceneState, angle: float) -> SceneState:
    assert isinstance(state.sun, SunInDirection)
    direction = state.sun.direction_icrf + angle * np.array([1.0, 0.0, 0.0])
    return replace(state, sun=replace(state.sun, direction_icrf=direction))


def _write(out: Path, name: str, exposure: Capture, traced: Traced, difference: Difference) -> None:
    assert exposure.radiance is not None
    write_exr(out / f"{name}.simgl.exr", exposure.radiance)
    gain = GAINS.get(name.partition(".")[0], 1.0)
    white = WHITE_RADIANCE / gain
    left = difference_images.shown(
        exposure.radiance.radiance[..., list(VISIBLE)].astype(np.float64), white
    )
    middle = difference_images.shown(traced.radiance, white)
    right = difference_images.signed(difference.relative)
    difference_images.write_png(out / f"{name}.simgl.png", left)
    difference_images.write_png(out / f"{name}.reference.png", middle)
    difference_images.write_png(out / f"{name}.difference.png", right)
    difference_images.write_png(out / f"{name}.png", left, middle, right)


def _table(record: Record) -> Table:
    table = Table(title=f"{record.renderer} against {record.tracer}")
    columns = [
        (f"{scene.name}, {way.gather}", _column(scene, way))
        for scene in record.scenes
        for way in scene.ways
    ]
    for heading in ("", *(name for name, _ in columns)):
        table.add_column(heading)
    for row in zip(*(rows for _, rows in columns), strict=True):
        table.add_row(row[0][0], *(text for _, text in row))
    return table


def _column(scene: SceneRecord, way: WayRecord) -> list[tuple[str, str]]:
    a, n = way.visible, way.near_infrared
    return [
        ("mean radiance", f"{a.mean_ratio:.4f}"),
        ("pixels within 10 %", f"{a.within_10_percent:.1%}"),
        ("  brighter than 1/10 of the mean", f"{a.within_10_percent_bright:.1%}"),
        ("  weighted by radiance", f"{a.within_10_percent_by_light:.1%}"),
        ("median difference", f"{a.median_difference:+.2%}"),
        ("tracer's noise, median, p95", f"{a.noise_median:.1%}, {a.noise_p95:.1%}"),
        ("misalignment", ", ".join(f"{v:+.3f}" for v in a.misalignment_px) + " px"),
        ("N: mean radiance", f"{n.mean_ratio:.4f}"),
        ("N: pixels within 10 %", f"{n.within_10_percent:.1%}"),
        ("N: tracer's noise, median, p95", f"{n.noise_median:.1%}, {n.noise_p95:.1%}"),
        ("plate of known radiance", f"{scene.plate_error:.1e}"),
        ("path tracer, processor", f"{scene.tracer_cpu_s:.1f} s"),
        ("simgl, processor", f"{way.cpu_ms:.0f} ms"),
        ("time ratio", f"{1e3 * scene.tracer_cpu_s / way.cpu_ms:.0f}"),
    ]


if __name__ == "__main__":
    typer.run(main)
