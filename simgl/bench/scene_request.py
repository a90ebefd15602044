"""What the benchmark asks of the process of a scene, and what it answers."""

from __future__ import annotations

import msgspec

from simgl.bench.results import SceneResult


class SceneRequest(msgspec.Struct, frozen=True, kw_only=True):
    """What to time.

    limit_s : of each loop [s]
    started : ``time.monotonic`` when this process was started, the same clock in all processes
    reply : file for the ``SceneReply``
    """

    scene: str
    step_s: float
    frames: int
    limit_s: float
    linked: bool
    started: float
    reply: str


class SceneReply(msgspec.Struct, frozen=True, kw_only=True):
    """Renderer name, and the results in process and through every link."""

    renderer: str
    results: list[SceneResult]
