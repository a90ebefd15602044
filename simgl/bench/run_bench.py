"""A set of scenes, start times, tables and other renderers, measured one after another."""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import msgspec

from simgl import __version__
from simgl.bench.child_process import ChildError, seconds_of
from simgl.bench.machine import machine
from simgl.bench.peers.run_peers import time_peers
from simgl.bench.results import Results, SceneResult
from simgl.bench.scene_request import SceneReply, SceneRequest
from simgl.bench.scenes import BenchSet, TimedScene
from simgl.bench.start_up import start_times
from simgl.progress import ProgressCallback, begin_stage, silent

# Of a scene with everything that it makes at its start.
_SCENE_LIMIT_S = 900.0


def run(
    chosen: BenchSet,
    *,
    frames: int,
    limit_s: float,
    peers_python: str = sys.executable,
    progress: ProgressCallback = silent,
) -> Results:
    """Measure a set. What fails is named in the results; the rest goes on.

    frames : timed frames of each scene
    limit_s : of each loop over them [s]
    peers_python : the interpreter that has the other renderers
    """
    renderer = ""
    scenes: list[SceneResult] = []
    failed: dict[str, str] = {}
    for timed in chosen.scenes:
        begin_stage(progress, f"{timed.scene}, a frame every {timed.step_s:g} s")
        try:
            reply = _timed(timed, frames, limit_s)
        except ChildError as error:
            failed[timed.scene] = str(error)
            continue
        renderer = reply.renderer
        scenes += reply.results
    start_up, not_started = start_times(chosen.starts, progress)
    tables = []
    if chosen.earth_tables:
        begin_stage(progress, "tables of the Earth")
        from simgl.bench.earth_tables import earth_tables

        tables = earth_tables()
    peers, absent = time_peers(peers_python, progress) if chosen.peers else ([], {})
    return Results(
        machine=machine(),
        renderer=renderer,
        version=__version__,
        scenes=scenes,
        tables=tables,
        start_up=start_up,
        peers=peers,
        absent_peers=absent,
        failed=failed | not_started,
    )


def _timed(timed: TimedScene, frames: int, limit_s: float) -> SceneReply:
    with tempfile.TemporaryDirectory(prefix="simgl-bench-") as folder:
        reply = Path(folder, "reply.json")
        request = SceneRequest(
            scene=timed.scene,
            step_s=timed.step_s,
            frames=frames,
            limit_s=limit_s,
            linked=timed.linked,
            started=time.monotonic(),
            reply=str(reply),
        )
        command = [sys.executable, "-m", "simgl.bench.scene_process"]
        seconds_of([*command, msgspec.json.encode(request).decode()], _SCENE_LIMIT_S)
        return msgspec.json.decode(reply.read_bytes(), type=SceneReply)
