"""``simgl ros2`` as a node of an installed ROS 2, by its Python client ``rclpy``.

Middleware, network and discovery are those of ROS's environment variables.
"""

from __future__ import annotations

import array
import os
import time
from collections import deque
from importlib import import_module
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions

from simgl.errors import ConfigError
from simgl.ros2.run_messages import TF, TopicMessage

# States, or images, that wait at a reader.
_QUEUE = 100
# Which machines are told of the node: since ROS 2 Iron, and before.
_RANGE, _RANGE_BEFORE = "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_LOCALHOST_ONLY"


class RclpyNode:
    """A node of ROS 2 that writes topics and reads ``/tf``.

    topics : topic to type of what will be published
    domain : ROS_DOMAIN_ID

    Raises ConfigError where ROS 2 cannot start.
    """

    def __init__(self, topics: dict[str, str], domain: int) -> None:
        if not {_RANGE, _RANGE_BEFORE} & os.environ.keys():
            # This machine only, as long as nobody asks for more.
            before = os.environ.get("ROS_DISTRO") == "humble"
            os.environ |= {_RANGE_BEFORE: "1"} if before else {_RANGE: "LOCALHOST"}
        qos = QoSProfile(
            history=HistoryPolicy.KEEP_LAST,
            depth=_QUEUE,
            reliability=ReliabilityPolicy.RELIABLE,
            durability=DurabilityPolicy.VOLATILE,
        )
        self._context = Context()
        try:
            # Signals are the command line's.
            rclpy.init(
                context=self._context,
                domain_id=domain,
                signal_handler_options=SignalHandlerOptions.NO,
            )
            self._node = Node(
                "simgl", context=self._context, enable_rosout=False, start_parameter_services=False
            )
        except RuntimeError as error:
            raise ConfigError("simgl ros2", "--domain", f"cannot be joined: {error}") from None
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._kinds = {kind: _message_class(kind) for kind in {*topics.values(), TF}}
        self._writers = {
            topic: self._node.create_publisher(self._kinds[kind], topic, qos)
            for topic, kind in topics.items()
        }
        self._frames: deque[Any] = deque()
        self._node.create_subscription(self._kinds[TF], "/tf", self._keep, qos)

    def _keep(self, frames: Any) -> None:
        self._frames.append(frames)

    @property
    def middleware(self) -> str:
        """What carries the messages."""
        return f"rclpy, {rclpy.get_rmw_implementation_identifier()}"

    def is_heard(self, topic: str) -> bool:
        """Whether anybody listens to a topic that is published here."""
        return bool(self._writers[topic].get_subscription_count())

    def publish(self, message: TopicMessage) -> None:
        """Write a message where somebody listens."""
        topic, kind, fields = message
        if self.is_heard(topic):
            self._writers[topic].publish(_filled(self._kinds[kind](), fields))

    def next_frames(self, timeout_s: float) -> Any:
        """The next message on ``/tf`` in the order of arrival; None where none comes in time."""
        end = time.monotonic() + timeout_s
        while not self._frames and (left_s := end - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left_s)
        return self._frames.popleft() if self._frames else None

    def close(self) -> None:
        """Leave the domain."""
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)


def _message_class(kind: str) -> Any:
    """The class of a type, such as sensor_msgs/msg/Image."""
    package, _, name = kind.partition("/msg/")
    return getattr(import_module(f"{package}.msg"), name)


def _filled(message: Any, fields: dict[str, Any]) -> Any:
    """A message of a class of ROS with the fields of a dictionary."""
    slots = message.get_fields_and_field_types()
    for name, value in fields.items():
        if isinstance(value, dict):
            _filled(getattr(message, name), value)
        elif isinstance(value, bytes):
            # An array is taken as it is; of other sequences each element is checked.
            setattr(message, name, array.array("B", value))
        elif isinstance(value, list) and any(isinstance(each, dict) for each in value):
            element = _message_class(_full_name(slots[name]))
            setattr(message, name, [_filled(element(), each) for each in value])
        else:
            setattr(message, name, value)
    return message


def _full_name(sequence: str) -> str:
    """``package/msg/Name`` of ``sequence<package/Name>``."""
    package, _, name = sequence.removeprefix("sequence<").removesuffix(">").partition("/")
    return f"{package}/msg/{name}"
