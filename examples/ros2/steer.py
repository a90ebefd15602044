"""A loop over ROS 2's topics that steers by brightness: python -m examples.ros2.steer

`simgl ros2 examples/bridge/box.toml --all-interfaces` first, in another terminal. A node of ROS 2
does the same with rclpy: it publishes /tf, and subscribes to /navcam/image_raw and camera_info.
"""

from __future__ import annotations

import hashlib
import os
import time
from typing import Any

import numpy as np

from simgl.arrays import Image16
from simgl.physics.ephemeris import tai_ns_from_utc
from simgl.ros2.dds_node import RosNode
from simgl.ros2.ros_messages import transform
from simgl.ros2.run_messages import CAMERA_INFO, IMAGE, TF

STEPS = 8
START_M, VELOCITY_M_S = (1.0, 0.0, 60.0), (0.0, 0.0, -0.5)
# Of the speed to the side over the direction; it halves the distance in 4 s at 60 m.
GAIN_M_S = 10.0


def off_axis(dn: Image16, cx_px: float, focal_length_px: float) -> float:
    """Direction of the light's centre, right of the boresight [rad]; columns count from 0."""
    light = np.where(dn > 0.25 * dn.max(), dn, 0).sum(axis=0, dtype=np.float64)
    return float((light @ np.arange(dn.shape[1]) / light.sum() - cx_px) / focal_length_px)


class Camera:
    """The camera of simgl's node, as another node sees it."""

    def __init__(self, node: RosNode) -> None:
        self._node = node
        self._images = node.reader("/navcam/image_raw", IMAGE)
        self._cards = node.reader("/navcam/camera_info", CAMERA_INFO)

    def look(self, frames: dict[str, Any], patience_s: float = 60.0) -> tuple[Any, Any]:
        """The image of the frames, and its calibration; frames are sent again until they come."""
        stamp = frames["transforms"][0]["header"]["stamp"]
        wanted = (stamp["sec"], stamp["nanosec"])
        end = time.monotonic() + patience_s
        arrived: dict[int, Any] = {}
        while time.monotonic() < end:
            self._node.publish(("/tf", TF, frames))
            again = time.monotonic() + 2.0
            while time.monotonic() < again:
                for kind, reader in enumerate((self._images, self._cards)):
                    for message in reader.take(N=10):
                        its = message.header.stamp
                        if (its.sec, its.nanosec) == wanted:
                            arrived[kind] = message
                if len(arrived) == 2:
                    return arrived[0], arrived[1]
                time.sleep(0.002)
        raise SystemExit("no image: is simgl ros2 running in this domain?")


def main() -> None:
    """Fly some steps of a second; print hash and direction of each image."""
    camera = Camera(node := RosNode({"/tf": TF}, int(os.environ.get("ROS_DOMAIN_ID", "0"))))
    epoch_tai_ns = tai_ns_from_utc("2026-03-20T12:00:00")
    position, velocity = np.array(START_M), np.array(VELOCITY_M_S)
    for step in range(STEPS):
        tai_ns = epoch_tai_ns + step * 1_000_000_000
        frames = {"transforms": [transform(tai_ns, "chaser", position, np.eye(3))]}
        image, card = camera.look(frames)
        dn = np.frombuffer(bytes(image.data), "<u2").reshape(image.height, image.width)
        angle = off_axis(dn, card.k[2], card.k[0])
        print(step, hashlib.blake2b(dn.tobytes(), digest_size=16).hexdigest(), f"{angle:+.6f}")
        velocity[0] = GAIN_M_S * angle
        position = position + velocity
    node.close()


if __name__ == "__main__":
    main()
