"""The example's loop over ROS 2's topics, against the same loop with the native client."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from simgl_bridge import BodyPose, Client

from simgl import load_scenario
from tests.bridge.harness import finish, start
from tests.patience import limit

pytest.importorskip("cyclonedds", reason="Cyclone DDS is not installed")
from examples.ros2.steer import GAIN_M_S, START_M, STEPS, VELOCITY_M_S, off_axis

ROOT = Path(__file__).parents[2]
BOX = ROOT / "examples" / "bridge" / "box.toml"


def native_loop() -> list[str]:
    """What the example prints, by a client of simgl/1."""
    lines = []
    running = start(load_scenario(BOX))
    try:
        with Client(running.address, timeout_s=limit(20.0)) as client:
            card = client.welcome.cameras[0]
            position, velocity = np.array(START_M), np.array(VELOCITY_M_S)
            for step in range(STEPS):
                chaser = BodyPose(
                    position_m=position,
                    velocity_m_s=(0.0, 0.0, 0.0),
                    q_icrf_from_body_xyzw=(0.0, 0.0, 0.0, 1.0),
                )
                tai_ns = client.welcome.epoch_tai_ns + step * 1_000_000_000
                image = client.render(tai_ns, card.name, {"chaser": chaser})
                # ROS counts from the centre of the first pixel.
                angle = off_axis(image.dn, card.cx - 0.5, card.focal_length_px)
                lines.append(f"{step} {image.plane_hash()} {angle:+.6f}")
                velocity[0] = GAIN_M_S * angle
                position = position + velocity
    finally:
        finish(running)
    return lines


def test_the_loop_over_topics_is_that_of_the_native_client() -> None:
    domain = str(10 + threading.get_native_id() % 80)
    command = [sys.executable, "-m", "simgl", "ros2", str(BOX), "--domain", domain]
    with subprocess.Popen(
        [*command, "--all-interfaces"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as node:
        try:
            loop = subprocess.run(
                [sys.executable, "-m", "examples.ros2.steer"],
                cwd=ROOT, env=os.environ | {"ROS_DOMAIN_ID": domain}, text=True, check=False,
                capture_output=True, timeout=limit(120.0),
            )  # fmt: skip
        finally:
            node.terminate()
            said, _ = node.communicate(timeout=limit(30.0))
    assert loop.returncode == 0, (loop.stderr, said)
    lines = loop.stdout.splitlines()
    assert lines == native_loop()
    # It steers: every image is another, and the light comes towards the boresight.
    assert len({line.split()[1] for line in lines}) == STEPS
    angles = [abs(float(line.split()[2])) for line in lines]
    assert angles[-1] < 0.5 * angles[0]
