"""Frame times as a client of the bridge sees them; ``simgl bench`` finds this by entry point."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from simgl.motion.trajectory import poses
from simgl.scenario.loader import load_scenario
from simgl_bridge.body_pose import BodyPose
from simgl_bridge.client import Client
from simgl_bridge.launched_server import launched_server


def frame_times(scenario_path: Path, camera: str, epochs: Sequence[int]) -> list[float]:
    """Seconds of each round trip: poses sent, the image rendered, its DN received.

    The server runs in a process of its own, as in a closed loop.
    """
    scenario = load_scenario(scenario_path)
    seconds = []
    with launched_server(scenario_path) as (_, address), Client(address, timeout_s=60.0) as client:
        for tai_ns in epochs:
            start = time.perf_counter()
            sent = poses(scenario.motions, tai_ns)
            bodies = {name: BodyPose.from_pose(pose) for name, pose in sent.items()}
            client.render(tai_ns, camera, bodies)
            seconds.append(time.perf_counter() - start)
    return seconds
