"""A loop over ROS 2's topics without ROS, by Cyclone DDS: python -m examples.ros2.steer

`simgl ros2 examples/bridge/box.toml --all-interfaces` first, in another terminal.
"""

from __future__ import annotations

import os
import time
from typing import Any

import numpy as np

from examples.ros2.steering import fly
from simgl.arrays import Array, Image16
from simgl.ros2.dds_node import DdsNode
from simgl.ros2.ros_messages import tai_ns_from_ros, transform
from simgl.ros2.run_messages import CAMERA_INFO, IMAGE, TF

PATIENCE_S, AGAIN_S = 60.0, 2.0


class Camera:
    """The camera of simgl's node, as another node sees it."""

    def __init__(self, node: DdsNode) -> None:
        self._node = node
        self._images = node.reader("/navcam/image_raw", IMAGE)
        self._cards = node.reader("/navcam/camera_info", CAMERA_INFO)

    def look(self, time_ns: int, position_m: Array) -> tuple[Image16, float, float]:
        """The image of a place, cx and fx [px]; frames are sent again until it comes."""
        tai_ns = tai_ns_from_ros(time_ns)
        frames = {"transforms": [transform(tai_ns, "chaser", position_m, np.eye(3))]}
        end = time.monotonic() + PATIENCE_S
        arrived: dict[int, Any] = {}
        while time.monotonic() < end:
            self._node.publish(("/tf", TF, frames))
            again = time.monotonic() + AGAIN_S
            while time.monotonic() < again:
                for kind, reader in enumerate((self._images, self._cards)):
                    for message in reader.take(N=10):
                        stamp = message.header.stamp
                        if stamp.sec * 1_000_000_000 + stamp.nanosec == time_ns:
                            arrived[kind] = message
                if len(arrived) == 2:
                    image, card = arrived[0], arrived[1]
                    dn = np.frombuffer(bytes(image.data), "<u2")
                    return dn.reshape(image.height, image.width), card.k[2], card.k[0]
                time.sleep(0.002)
        raise SystemExit("no image: is simgl ros2 running in this domain?")


def main() -> None:
    """Fly over topics."""
    node = DdsNode({"/tf": TF}, int(os.environ.get("ROS_DOMAIN_ID", "0")))
    fly(Camera(node).look)
    node.close()


if __name__ == "__main__":
    main()
