"""The benchmark: time of a frame on this machine, end to end and pass by pass.

A frame is everything from an epoch to the DN array on the CPU: poses, view, passes, read-back.
Through the bridge it is the client's round trip to a server process. Frame times are measured
without pass timers; passes are timed in a second run, since on a CPU renderer each timer waits for
its pass.
"""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Sequence
from importlib.metadata import entry_points
from pathlib import Path

import msgspec
import numpy as np
from rich.console import Group
from rich.table import Table

from simgl import __version__, assets
from simgl.errors import ConfigError, did_you_mean
from simgl.gpu.context import temporary_context
from simgl.passes.background.air_tables import ORDERS, AirKind, make_tables
from simgl.passes.background.cloud_map import noise_texture, weather_codes
from simgl.passes.background.earth_maps import ground_textures, make_form_map, make_land_map
from simgl.physics.atmosphere import STANDARD
from simgl.progress import ProgressCallback, begin_stage, silent
from simgl.scenario.loader import load_scenario
from simgl.scenario.scenario import Scenario
from simgl.scene.earth import Clouds, Earth
from simgl.scene.noise_projection import make_chart
from simgl.simulator import Simulator

# Entry points of this group time frames through a link: (scenario file, camera, epochs) -> seconds.
LINKS_GROUP = "simgl.bench_links"
Link = Callable[[Path, str, Sequence[int]], list[float]]

WARM_UP = 5
# Between frames: light and shadow change in each.
STEP_S = 1.0


class FrameTimes(msgspec.Struct, frozen=True, kw_only=True):
    """Percentiles, mean and worst of the frame time [ms].

    Tables that are recomputed now and then show in the mean and the worst, hardly in the median.
    """

    p50: float
    p95: float
    p99: float
    mean: float
    worst: float


class SceneResult(msgspec.Struct, frozen=True, kw_only=True):
    """One scene, in process or through the bridge.

    step_s : from frame to frame in the scene's time [s]
    passes_ms : medians
    """

    name: str
    width: int
    height: int
    triangles: int
    frames: int
    step_s: float
    frame_ms: FrameTimes
    through_bridge: bool
    passes_ms: dict[str, float]


class TableResult(msgspec.Struct, frozen=True, kw_only=True):
    """A look-up table or texture of the Earth: size on the GPU, and time to compute it."""

    name: str
    bytes: int
    seconds: float


class Results(msgspec.Struct, frozen=True, kw_only=True):
    """Content of ``simgl bench --json``; ``tables`` is empty where scenes were chosen."""

    machine: str
    renderer: str
    version: str
    scenes: list[SceneResult]
    tables: list[TableResult]

    def to_json(self) -> bytes:
        """Indented JSON text."""
        return msgspec.json.format(msgspec.json.encode(self), indent=2) + b"\n"


def machine() -> str:
    """Processor, number of cores that this process may use, operating system."""
    name = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        lines = cpuinfo.read_text().splitlines()
        models = [line.partition(":")[2].strip() for line in lines if "model name" in line]
        name = models[0] if models else name
    return f"{name}, {len(os.sched_getaffinity(0))} cores, {platform.system()}"


def _frame_ms(seconds: Sequence[float]) -> FrameTimes:
    ms = np.array(seconds) * 1e3
    p50, p95, p99, worst = np.percentile(ms, [50, 95, 99, 100]).round(3).tolist()
    return FrameTimes(p50=p50, p95=p95, p99=p99, mean=round(float(ms.mean()), 3), worst=worst)


def _epochs(scenario: Scenario, frames: int, step_s: float) -> list[int]:
    return [scenario.epoch_tai_ns + round(i * step_s * 1e9) for i in range(WARM_UP + frames)]


def _frame_times(simulator: Simulator, camera: str, epochs: Sequence[int]) -> list[float]:
    seconds = []
    for epoch in epochs:
        start = time.perf_counter()
        simulator.capture(simulator.scenario.at(epoch), camera)
        seconds.append(time.perf_counter() - start)
    return seconds[WARM_UP:]


def _pass_times(simulator: Simulator, camera: str, epochs: Sequence[int]) -> dict[str, float]:
    simulator.timer.enabled = True
    runs: dict[str, list[float]] = {}
    for epoch in epochs:
        simulator.timer.seconds.clear()
        simulator.capture(simulator.scenario.at(epoch), camera)
        for name, seconds in simulator.timer.seconds.items():
            runs.setdefault(name, []).append(seconds * 1e3)
    simulator.timer.enabled = False
    return {name: round(float(np.median(values)), 3) for name, values in runs.items()}


def scene_files() -> dict[str, Path]:
    """The shipped benchmark scenes by name."""
    return {p.stem: p for p in sorted((assets.data() / "bench").glob("*.toml"))}


def _one_scene(
    path: Path, frames: int, step_s: float, progress: ProgressCallback
) -> tuple[str, list[SceneResult]]:
    """Renderer name, and the results in process and through every link."""
    scenario = load_scenario(path)
    camera = next(iter(scenario.cameras))
    detector = scenario.cameras[camera].detector
    epochs = _epochs(scenario, frames, step_s)

    def result(seconds: Sequence[float], passes: dict[str, float], bridge: bool) -> SceneResult:
        return SceneResult(
            name=path.stem,
            width=detector.width,
            height=detector.height,
            triangles=sum(len(m.mesh.triangles) for m in scenario.models.values()),
            frames=frames,
            step_s=step_s,
            frame_ms=_frame_ms(seconds),
            through_bridge=bridge,
            passes_ms=passes,
        )

    begin_stage(progress, f"{path.stem}: opening OpenGL")
    with Simulator(scenario, progress=progress) as simulator:
        renderer = simulator.renderer_name
        begin_stage(progress, f"{path.stem}: frames in process")
        seconds = _frame_times(simulator, camera, epochs)
        passes = _pass_times(simulator, camera, epochs[: WARM_UP + frames // 3])
    results = [result(seconds, passes, False)]
    for entry in entry_points(group=LINKS_GROUP):
        begin_stage(progress, f"{path.stem}: frames through the {entry.name}")
        link: Link = entry.load()
        results.append(result(link(path, camera, epochs)[WARM_UP:], {}, True))
    return renderer, results


def earth_tables() -> list[TableResult]:
    """Computed without any cache: standard atmosphere, shipped maps, default clouds."""
    earth = Earth(air=STANDARD, clouds=Clouds())
    results: list[TableResult] = []

    def note(name: str, make: Callable[[], int]) -> None:
        start = time.perf_counter()
        size = make()
        seconds = round(time.perf_counter() - start, 2)
        results.append(TableResult(name=name, bytes=size, seconds=seconds))

    with temporary_context() as ctx:
        kind = AirKind(air=STANDARD, radius=earth.equatorial_radius, albedo=earth.mean_albedo)

        def air() -> int:
            return sum(t.nbytes for t in make_tables(ctx, kind, orders=ORDERS).values())

        note("air, all views", air)
        # With their mipmaps, a third of the largest level; the chart also level by level.
        noise, ground = noise_texture(ctx, 0), ground_textures(ctx, earth.maps)
        note("weather", lambda: weather_codes(ctx, Clouds(), noise, ground).nbytes * 4 // 3)
        noise.release()
        for texture in ground:
            texture.release()
        note("noise of clouds and hills", lambda: 2 * sum(c.nbytes for c in make_chart(0)[0]))
        note(
            "maps",
            lambda: (make_land_map(None).nbytes + make_form_map(None, None).nbytes) * 4 // 3,
        )
    return results


def run(
    *,
    scenes: Sequence[str] | None,
    frames: int,
    progress: ProgressCallback = silent,
    step_s: float = STEP_S,
) -> Results:
    """Run the named scenes (all, if None).

    step_s : from frame to frame in the scenes' time [s]
    """
    files = scene_files()
    for name in scenes or ():
        if name not in files:
            problem = f'names no scene: "{name}"; {did_you_mean(name, files)}'
            raise ConfigError("command line", "--scene", problem)
    chosen = scenes or list(files)
    renderer, results = "", []
    for name in chosen:
        renderer, of_scene = _one_scene(files[name], frames, step_s, progress)
        results += of_scene
    if not scenes:
        begin_stage(progress, "tables of the Earth")
    return Results(
        machine=machine(),
        renderer=renderer,
        version=__version__,
        scenes=results,
        tables=[] if scenes else earth_tables(),
    )


def tables(results: Results) -> Group:
    """Frame times, pass times and tables for a terminal."""
    frames = Table(
        title=f"simgl {results.version} on {results.machine}\n{results.renderer}\nframe times in ms"
    )
    frames.add_column("scene", no_wrap=True)
    for column in ("size", "step", "link", "p50", "p95", "worst", "mean", "fps"):
        frames.add_column(column, justify="right", no_wrap=True)
    for scene in results.scenes:
        ms = scene.frame_ms
        frames.add_row(
            scene.name,
            f"{scene.width}x{scene.height}",
            f"{scene.step_s:g} s",
            "yes" if scene.through_bridge else "no",
            *(f"{value:.0f}" for value in (ms.p50, ms.p95, ms.worst, ms.mean)),
            f"{1e3 / ms.mean:.1f}",
        )
    timed = [scene for scene in results.scenes if scene.passes_ms]
    passes = Table(title="passes, median ms")
    passes.add_column("pass")
    for scene in timed:
        passes.add_column(scene.name, justify="right")
    for name in dict.fromkeys(name for scene in timed for name in scene.passes_ms):
        cells = [scene.passes_ms.get(name) for scene in timed]
        passes.add_row(name, *("" if ms is None else f"{ms:.1f}" for ms in cells))
    made = Table(title="tables of the Earth, made once")
    made.add_column("table", no_wrap=True)
    for column in ("MB", "s"):
        made.add_column(column, justify="right")
    for table in results.tables:
        made.add_row(table.name, f"{table.bytes / 1e6:.1f}", f"{table.seconds:.1f}")
    return Group(frames, passes, *([made] if results.tables else []))
