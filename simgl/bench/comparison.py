"""Results compared with those of an earlier run, scene by scene and pass by pass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from simgl.bench.results import Results, SceneResult

# A run whose rounds agree by chance still differs so much from the next one.
MIN_NOISE = 0.05
# Of results that have no rounds.
UNKNOWN_NOISE = 0.10
# Shorter passes are not compared: a clock's and a lock's share in them is too large [ms].
SHORTEST_PASS_MS = 0.5


@dataclass(frozen=True, kw_only=True)
class Change:
    """A scene's frame, or one of its passes, in both runs.

    of_pass : None for the frame
    noise : largest relative change that the spread of the rounds of both runs explains
    """

    scene: SceneResult
    of_pass: str | None
    before_ms: float
    now_ms: float
    noise: float

    @property
    def ratio(self) -> float:
        """Of the time now to the time before."""
        return self.now_ms / self.before_ms

    @property
    def slower(self) -> bool:
        """Beyond the noise."""
        return self.ratio > 1.0 + self.noise

    @property
    def faster(self) -> bool:
        """Beyond the noise."""
        return self.ratio < 1.0 / (1.0 + self.noise)


def compare(now: Results, before: Results) -> list[Change]:
    """Changes of every scene that both runs have at the same step and size, frames then passes."""
    changes = []
    for scene in now.scenes:
        old = before.scene(scene.name, scene.step_s, bridge=scene.through_bridge)
        if old is None or (old.width, old.height) != (scene.width, scene.height):
            continue
        changes.append(
            Change(
                scene=scene,
                of_pass=None,
                before_ms=old.frame_ms.p50,
                now_ms=scene.frame_ms.p50,
                noise=_noise(old.round_p50_ms, scene.round_p50_ms),
            )
        )
        changes += [
            Change(
                scene=scene,
                of_pass=name,
                before_ms=old.passes_ms[name],
                now_ms=ms,
                noise=_noise(
                    old.round_passes_ms.get(name, []), scene.round_passes_ms.get(name, [])
                ),
            )
            for name, ms in scene.passes_ms.items()
            if min(old.passes_ms.get(name, 0.0), ms) >= SHORTEST_PASS_MS
        ]
    return changes


def slower_than(changes: Sequence[Change], percent: float) -> list[Change]:
    """Scenes whose frame is slower by more than that, and beyond the noise."""
    return [c for c in changes if c.of_pass is None and c.slower and c.ratio > 1 + percent / 100]


def different_machine(now: Results, before: Results) -> str:
    """What makes times hard to compare; empty where machine and renderer are the same."""
    pairs = ((before.machine, now.machine), (before.renderer, now.renderer))
    return "; ".join(f"{old} before, {new} now" for old, new in pairs if old != new)


def _noise(before: Sequence[float], now: Sequence[float]) -> float:
    """Both spreads together, of the largest median of a round to the smallest."""
    spreads = [max(medians) / min(medians) for medians in (before, now) if _spread_known(medians)]
    if len(spreads) < 2:
        return UNKNOWN_NOISE
    return max(spreads[0] * spreads[1] - 1.0, MIN_NOISE)


def _spread_known(medians: Sequence[float]) -> bool:
    return len(medians) > 1 and min(medians) > 0.0
