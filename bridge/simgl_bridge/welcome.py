"""The server's description of itself to a client."""

from __future__ import annotations

from simgl import __version__
from simgl_bridge.message_parts import ServerStatus
from simgl_bridge.messages import Welcome
from simgl_bridge.renderer_messages import ServedScene
from simgl_bridge.validate_request import UNITS


def welcome(
    scene: ServedScene,
    *,
    id: int | None,
    boot: str,
    window: int,
    scenarios: tuple[str, ...],
    status: ServerStatus,
) -> Welcome:
    """The reply to Hello (no id) and to Configure."""
    return Welcome(
        id=id,
        server=__version__,
        boot=boot,
        renderer=scene.renderer,
        scenario=scene.name,
        scene_hash=scene.scene_hash,
        epoch_tai_ns=scene.epoch_tai_ns,
        time_scale="TAI ns since 1970-01-01T00:00:00 TAI",
        frame="GCRF",
        seed=scene.seed,
        window=window,
        products=tuple(UNITS),
        cameras=tuple(scene.cameras.values()),
        bodies={name: tuple(j.name for j in m.joints) for name, m in scene.models.items()},
        scenarios=scenarios,
        lamps=scene.lamps,
        status=status,
        compressions=scene.compressions,
    )
