"""The table of goals: what a frame may take, in times of the machine's own speed.

Machines differ by more than two, so a goal holds times f: what pyrender takes here for a plain
frame (8 bits, no shadows) of the target of source_600, over 0.06 s, its time on the machine of the
README's table.
"""

from __future__ import annotations

from collections.abc import Callable

import msgspec

from simgl.bench.results import PeerResult, Results, SceneResult
from simgl.gpu.context import is_software_name

# pyrender's frame of 53,532 triangles at 600 x 600 on the machine of the README's table [s].
PYRENDER_S = 0.06
LOOP_STEP_S = 0.1
# A steady frame: p99 over p50 at 10 Hz.
STEADY = 1.3
REPORTED_SIZE = 600


class Goal(msgspec.Struct, frozen=True, kw_only=True):
    """A line of the table.

    unit : of value and goal; "s" and "ms" scale with f, "" and "times" do not
    value : measured here; None where this run did not measure it
    goal : on the README's machine
    allowed : the goal here; None without f
    ratio : of the value to what is allowed, 1 or less where the goal is met; for "times", where
        more is better, the other way round
    """

    name: str
    unit: str
    value: float | None
    goal: float
    allowed: float | None
    ratio: float | None

    @property
    def met(self) -> bool | None:
        """None where it is not known."""
        return None if self.ratio is None else self.ratio <= 1.0


def machine_factor(results: Results) -> float | None:
    """f, how many times slower than the README's machine this one is; None without pyrender."""
    frame = _peer(results, "pyrender")
    return None if frame is None else frame.seconds / PYRENDER_S


def factor_spread(results: Results) -> tuple[float, float] | None:
    """f by the fastest and by the slowest process of pyrender; None without several."""
    frame = _peer(results, "pyrender")
    if frame is None or len(frame.process_seconds) < 2:
        return None
    return min(frame.process_seconds) / PYRENDER_S, max(frame.process_seconds) / PYRENDER_S


def _peer(results: Results, name: str) -> PeerResult | None:
    sizes = (p for p in results.peers if p.name == name and p.width == REPORTED_SIZE)
    return next(sizes, None)


def all_goals(results: Results) -> list[Goal]:
    """Those of the CPU renderer, or those of a GPU, where that drew."""
    on_gpu = results.renderer and not is_software_name(results.renderer)
    return gpu_goals(results) if on_gpu else cpu_goals(results)


def cpu_goals(results: Results) -> list[Goal]:
    """The table, each line with what was measured."""
    f = machine_factor(results)

    def line(name: str, unit: str, value: float | None, goal: float) -> Goal:
        scale = f if unit in ("s", "ms") else 1.0
        allowed = None if scale is None else goal * scale
        ratio = None
        if value is not None and allowed is not None:
            ratio = allowed / value if unit == "times" else value / allowed
        return Goal(name=name, unit=unit, value=value, goal=goal, allowed=allowed, ratio=ratio)

    def p50(name: str, step_s: float = LOOP_STEP_S, *, bridge: bool = False) -> float | None:
        return _of(results.scene(name, step_s, bridge=bridge), lambda s: s.frame_ms.p50)

    def worst(name: str) -> float | None:
        return _of(results.scene(name, LOOP_STEP_S), lambda s: s.frame_ms.worst)

    docking = ("docking_20m", "docking_3m")
    start = results.start_up
    steady = [
        line(f"{scene.name}, p99 / p50", "", scene.frame_ms.steadiness, STEADY)
        for scene in results.scenes
        # Frames of different cameras in turn are not one loop.
        if scene.step_s == LOOP_STEP_S and not scene.through_bridge and scene.name != "one_of_four"
    ]
    return [
        line("start to first DN, warm caches", "s", start.warm, 3.0),
        line("start to first DN, cold caches", "s", start.cold, 20.0),
        line("simgl --help", "s", start.help, 0.3),
        line("source_600, 10 Hz, through the bridge", "ms", p50("source_600", bridge=True), 50.0),
        line("source_600, 1 s apart", "ms", p50("source_600", 1.0), 60.0),
        line("earth_1280", "ms", p50("earth_1280"), 45.0),
        line("camera_1280", "ms", p50("camera_1280"), 40.0),
        line("colour_1280", "ms", p50("colour_1280"), 40.0),
        line("bay_1280", "ms", p50("bay_1280"), 250.0),
        line("bay_1280, second goal", "ms", p50("bay_1280"), 125.0),
        line("docking_20m and _3m, larger median", "ms", _max([p50(n) for n in docking]), 100.0),
        line("docking_20m and _3m, worst frame", "ms", _max([worst(n) for n in docking]), 250.0),
        line("arm_800, 1 deg/s", "ms", p50("arm_800"), 200.0),
        line(
            "four_cameras over one_of_four",
            "",
            _ratio(p50("four_cameras"), p50("one_of_four")),
            3.0,
        ),
        *steady,
        line("Cycles over source_600", "times", times_slower(results, "cycles"), 500.0),
    ]


def results_document(results: Results) -> bytes:
    """Content of ``simgl bench --json``: the results, f with its spread, and the goals, as indented
    JSON."""
    document = {
        **msgspec.to_builtins(results),
        "f": machine_factor(results),
        "f_spread": factor_spread(results),
        "goals": msgspec.to_builtins(all_goals(results)),
    }
    return msgspec.json.format(msgspec.json.encode(document), indent=2) + b"\n"


def gpu_goals(results: Results) -> list[Goal]:
    """Goals on a data-centre GPU; no factor, a GPU is what they are for."""

    def line(name: str, scene: str, hertz: float) -> Goal:
        value = _of(results.scene(scene, LOOP_STEP_S), lambda s: s.frame_ms.p50)
        goal = 1e3 / hertz
        ratio = None if value is None else value / goal
        return Goal(name=name, unit="ms", value=value, goal=goal, allowed=goal, ratio=ratio)

    return [
        line("everything at 1280 x 960 (reference_1280), 200 Hz", "reference_1280", 200.0),
        line("2048 x 2048 (square_2048), 60 Hz", "square_2048", 60.0),
        line("cargo bay (bay_1280), 100 Hz", "bay_1280", 100.0),
    ]


def times_slower(results: Results, peer: str) -> float | None:
    """A peer's frame at 600 x 600 over the frame of source_600 in a loop, both in process."""
    result = _peer(results, peer)
    frame_ms = _of(results.scene("source_600", LOOP_STEP_S), lambda s: s.frame_ms.p50)
    return _ratio(None if result is None else 1e3 * result.seconds, frame_ms)


def _of(scene: SceneResult | None, value: Callable[[SceneResult], float]) -> float | None:
    return None if scene is None else value(scene)


def _max(values: list[float | None]) -> float | None:
    """None unless all are known."""
    known = [value for value in values if value is not None]
    return max(known) if len(known) == len(values) else None


def _ratio(value: float | None, other: float | None) -> float | None:
    return None if value is None or other is None else value / other
