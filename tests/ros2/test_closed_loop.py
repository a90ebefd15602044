"""The example's loop over ROS 2's topics, against the same loop with the native client.

Nodes by Cyclone DDS without ROS, and by rclpy of ROS 2 Kilted with Fast DDS, on this machine's
loopback.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from simgl_bridge import BodyPose, Client

from examples.ros2.steering import GAIN_M_S, START_M, STEPS, VELOCITY_M_S, off_axis
from simgl import load_scenario
from tests.bridge.harness import finish, start
from tests.patience import limit

pytest.importorskip("cyclonedds", reason="Cyclone DDS is not installed")

ROOT = Path(__file__).parents[2]
BOX = ROOT / "examples" / "bridge" / "box.toml"
ROS_PYTHON = ROOT / ".venv" / "ros" / "bin" / "python"
# Fast DDS on loopback only, as Cyclone is.
LOOPBACK = """\
<?xml version="1.0" encoding="UTF-8"?>
<profiles xmlns="http://www.eprosima.com">
<transport_descriptors><transport_descriptor>
<transport_id>loopback</transport_id><type>UDPv4</type>
<interfaceWhiteList><address>127.0.0.1</address></interfaceWhiteList>
</transport_descriptor></transport_descriptors>
<participant profile_name="loopback" is_default_profile="true"><rtps>
<userTransports><transport_id>loopback</transport_id></userTransports>
<useBuiltinTransports>false</useBuiltinTransports>
</rtps></participant>
</profiles>
"""
needs_ros = pytest.mark.skipif(
    not ROS_PYTHON.exists(), reason="needs ROS 2: python -m tools.ros_environment .venv/ros"
)


@pytest.fixture(scope="module")
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


@pytest.mark.parametrize(
    ("node_python", "program_python", "program"),
    [
        pytest.param(sys.executable, sys.executable, "steer", id="without-ros"),
        pytest.param(ROS_PYTHON, ROS_PYTHON, "steer_with_rclpy", id="ros", marks=needs_ros),
        pytest.param(
            sys.executable, ROS_PYTHON, "steer_with_rclpy", id="node-without-ros", marks=needs_ros
        ),
    ],
)
def test_the_loop_over_topics_is_that_of_the_native_client(
    node_python: str | Path,
    program_python: str | Path,
    program: str,
    native_loop: list[str],
    tmp_path: Path,
) -> None:
    domain = str(10 + threading.get_native_id() % 80)
    profile = tmp_path / "loopback.xml"
    profile.write_text(LOOPBACK)
    environment = os.environ | {
        # ROS's Python finds simgl and what it needs here.
        "PYTHONPATH": os.pathsep.join(path for path in sys.path if path),
        "ROS_DOMAIN_ID": domain,
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "FASTDDS_DEFAULT_PROFILES_FILE": str(profile),
        "ROS_LOG_DIR": str(tmp_path),
    }
    command = [str(node_python), "-m", "simgl", "ros2", str(BOX), "--domain", domain]
    with subprocess.Popen(
        [*command, "--all-interfaces"],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ) as node:
        try:
            loop = subprocess.run(
                [str(program_python), "-m", f"examples.ros2.{program}"],
                cwd=ROOT, env=environment, text=True, check=False,
                capture_output=True, timeout=limit(120.0),
            )  # fmt: skip
        finally:
            node.terminate()
            said, _ = node.communicate(timeout=limit(30.0))
    assert loop.returncode == 0, (loop.stderr, said)
    by_rclpy = node_python == ROS_PYTHON
    assert ("rclpy, rmw_fastrtps_cpp" if by_rclpy else "Cyclone DDS, without ROS") in said
    lines = loop.stdout.splitlines()
    assert lines == native_loop
    # It steers: every image is another, and the light comes towards the boresight.
    assert len({line.split()[1] for line in lines}) == STEPS
    angles = [abs(float(line.split()[2])) for line in lines]
    assert angles[-1] < 0.5 * angles[0]
