"""One scene, timed in a process of its own: ``python -m simgl.bench.scene_process REQUEST``.

A process for each scene: memory and the time to the first DN are the scene's, and whatever ends the
process ends no other measurement.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from importlib.metadata import entry_points
from pathlib import Path

import msgspec
import numpy as np

from simgl.bench.frame_times import (
    WARM_UP,
    FrameLoop,
    epochs_of,
    frame_statistics,
    round_medians_ms,
)
from simgl.bench.machine import resident_mb
from simgl.bench.results import Memory, SceneResult
from simgl.bench.scene_request import SceneReply, SceneRequest
from simgl.bench.scenes import BenchScene, bench_scenes
from simgl.errors import SimglError
from simgl.scenario.loader import load_scenario
from simgl.simulator import Simulator

# Entry points of this group time frames through a link: (scenario file, camera, epochs) -> seconds.
LINKS_GROUP = "simgl.bench_links"
Link = Callable[[Path, str, Sequence[int]], list[float]]


def time_scene(request: SceneRequest) -> SceneReply:
    """Frames, passes and memory in this process, then frames through links."""
    scene = bench_scenes()[request.scene]
    scenario = load_scenario(scene.path)
    camera = next(iter(scenario.cameras))
    detector = scenario.cameras[camera].detector
    timed_passes = max(request.frames // 3, 1)
    epochs = epochs_of(scenario, request.frames + timed_passes, request.step_s)

    def result(seconds: Sequence[float], *, bridge: bool) -> SceneResult:
        return SceneResult(
            name=scene.name,
            width=detector.width,
            height=detector.height,
            triangles=sum(len(m.mesh.triangles) for m in scenario.models.values()),
            frames=len(seconds),
            step_s=request.step_s,
            frame_ms=frame_statistics(seconds),
            through_bridge=bridge,
            passes_ms={},
            round_p50_ms=round_medians_ms(seconds),
        )

    with Simulator(scenario) as simulator:
        renderer = simulator.renderer_name
        loop = FrameLoop(simulator, scene.cameras, epochs, request.limit_s)
        captures = loop.capture_next()
        first_frame_s = time.monotonic() - request.started
        loop.warm_up()
        seconds = loop.frame_seconds(request.frames)
        memory = resident_mb()
        passes = loop.pass_seconds(timed_passes)
    in_process = msgspec.structs.replace(
        result(seconds, bridge=False),
        captures=captures,
        passes_ms={name: round(float(np.median(s)) * 1e3, 3) for name, s in passes.items()},
        round_passes_ms={name: round_medians_ms(s) for name, s in passes.items()},
        first_frame_s=round(first_frame_s, 3),
        memory_mb=Memory(peak=round(memory["VmHWM"]), steady=round(memory["VmRSS"])),
    )
    linked = _link_seconds(scene, camera, epochs[: WARM_UP + len(seconds)], request.linked)
    return SceneReply(
        renderer=renderer,
        results=[in_process, *(result(seconds, bridge=True) for seconds in linked)],
    )


def _link_seconds(
    scene: BenchScene, camera: str, epochs: Sequence[int], linked: bool
) -> list[list[float]]:
    """Round trips after the warm-up [s] through every link."""
    if not (linked and scene.linked):
        return []
    links: list[Link] = [entry.load() for entry in entry_points(group=LINKS_GROUP)]
    return [link(scene.path, camera, epochs)[WARM_UP:] for link in links]


def main() -> None:
    """Time the scene of the request and write the reply."""
    request = msgspec.json.decode(sys.argv[1], type=SceneRequest)
    try:
        reply = time_scene(request)
    except SimglError as error:
        sys.exit(f"{error}")
    Path(request.reply).write_bytes(msgspec.json.encode(reply))


if __name__ == "__main__":
    main()
