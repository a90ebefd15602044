"""A loop over ROS 2's topics as a node of ROS 2: python -m examples.ros2.steer_with_rclpy

`simgl ros2 examples/bridge/box.toml --all-interfaces` first, in another terminal.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import rclpy
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo, Image
from tf2_msgs.msg import TFMessage

from examples.ros2.steering import fly
from simgl.arrays import Array, Image16

PATIENCE_S, AGAIN_S = 60.0, 2.0


class Steering(Node):
    """Publishes where the chaser is, and waits for the image of just that."""

    def __init__(self) -> None:
        super().__init__("steering")
        self._arrived: dict[str, dict[int, Any]] = {"image_raw": {}, "camera_info": {}}
        for topic, kind in (("image_raw", Image), ("camera_info", CameraInfo)):
            self.create_subscription(
                kind, f"/navcam/{topic}", lambda m, topic=topic: self._keep(topic, m), 10
            )
        self._frames = self.create_publisher(TFMessage, "/tf", 10)

    def _keep(self, topic: str, message: Any) -> None:
        stamp = message.header.stamp
        self._arrived[topic][stamp.sec * 1_000_000_000 + stamp.nanosec] = message

    def look(self, time_ns: int, position_m: Array) -> tuple[Image16, float, float]:
        """The image of a place, cx and fx [px]; the frame is sent again until it comes."""
        frame = TransformStamped(child_frame_id="chaser")
        frame.header.frame_id = "gcrf"
        frame.header.stamp.sec, frame.header.stamp.nanosec = divmod(time_ns, 1_000_000_000)
        where = frame.transform.translation
        where.x, where.y, where.z = map(float, position_m)
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            self._frames.publish(TFMessage(transforms=[frame]))
            again = time.monotonic() + AGAIN_S
            while time.monotonic() < again:
                rclpy.spin_once(self, timeout_sec=0.1)
                if all(time_ns in messages for messages in self._arrived.values()):
                    image, card = (messages[time_ns] for messages in self._arrived.values())
                    dn = np.frombuffer(image.data, "<u2").reshape(image.height, image.width)
                    return dn, card.k[2], card.k[0]
        raise SystemExit("no image: is simgl ros2 running in this domain?")


def main() -> None:
    """Fly over topics."""
    rclpy.init()
    node = Steering()
    fly(node.look)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
