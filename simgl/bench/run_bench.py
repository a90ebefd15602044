"""A set of scenes, start times, tables and other renderers, measured one after another."""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import msgspec
from msgspec.structs import replace

from simgl import __version__
from simgl.bench.child_process import ChildError, empty_caches, seconds_of
from simgl.bench.machine import machine
from simgl.bench.peers.run_peers import time_before_scenes, time_peers
from simgl.bench.results import Results, TableResult
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
) -> Iterator[Results]:
    """Measure a set; yields the results so far after each scene, the complete ones last.

    What fails is named in the results, and the rest goes on.

    frames : timed frames of each scene
    limit_s : of each loop over them [s]
    peers_python : the interpreter that has the other renderers
    """
    results = Results(
        machine=machine(), renderer="", version=__version__, scenes=[], tables=[], failed={}
    )
    before_s = time_before_scenes(peers_python, progress) if chosen.peers else []
    for timed in chosen.scenes:
        begin_stage(progress, f"{timed.scene}, a frame every {timed.step_s:g} s")
        try:
            reply = _timed(timed, frames, limit_s)
        except ChildError as error:
            results.failed[timed.scene] = str(error)
            continue
        results.scenes.extend(reply.results)
        results = replace(results, renderer=reply.renderer)
        yield results
    start_up, not_started = start_times(chosen.starts, progress)
    results.failed.update(not_started)
    if chosen.earth_tables:
        begin_stage(progress, "tables of the Earth")
        try:
            results.tables.extend(_earth_tables())
        except ChildError as error:
            results.failed["tables of the Earth"] = str(error)
    results = replace(results, start_up=start_up)
    yield results
    if chosen.peers:
        peers, absent = time_peers(peers_python, progress, before_s)
        yield replace(results, peers=peers, absent_peers=absent)


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


def _earth_tables() -> list[TableResult]:
    with empty_caches() as environment, tempfile.TemporaryDirectory() as folder:
        reply = Path(folder, "tables.json")
        command = [sys.executable, "-m", "simgl.bench.earth_tables", str(reply)]
        seconds_of(command, _SCENE_LIMIT_S, environment)
        return msgspec.json.decode(reply.read_bytes(), type=list[TableResult])
