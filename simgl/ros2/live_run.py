"""Images of a scenario on ROS 2's topics while it plays, or of the frames that others publish."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from threading import Event
from typing import Any, Protocol

import numpy as np

from simgl.errors import SimglError
from simgl.images import Capture
from simgl.physics.frames import Pose, matrix_from_quaternion
from simgl.ros2.ros_messages import WORLD, tai_ns_from_ros
from simgl.ros2.run_messages import (
    CLOCK,
    TF,
    TopicMessage,
    camera_messages,
    camera_topics,
    check_names,
    clock_message,
    frame_message,
)
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.simulator import Product, Simulator

_LOG = logging.getLogger(__name__)
# Between two looks at a request to stop [s].
_PAUSE_S = 0.2


class RosNode(Protocol):
    """What writes topics of ROS 2 and reads ``/tf``."""

    @property
    def middleware(self) -> str:
        """What carries the messages."""

    def is_heard(self, topic: str) -> bool:
        """Whether anybody listens to a topic that is published here."""

    def publish(self, message: TopicMessage) -> None:
        """Write a message where somebody listens."""

    def next_frames(self, timeout_s: float) -> Any:
        """The next message on ``/tf`` in the order of arrival; None where none comes in time."""

    def close(self) -> None:
        """Leave the domain."""


@dataclass(kw_only=True)
class LiveRun:
    """A node with its simulator.

    cameras : whose images are published
    depth : also depth images
    """

    scenario: Scenario
    simulator: Simulator
    node: RosNode
    cameras: tuple[str, ...]
    depth: bool = False

    def play(self, epochs: Sequence[int], stop: Event) -> int:
        """Publish the scenario's epochs [TAI ns] at the pace of the clock on the wall.

        returns : how many were published later than their time
        """
        start, late = time.monotonic(), 0
        for tai_ns in epochs:
            due = start + 1e-9 * (tai_ns - epochs[0])
            if stop.wait(max(0.0, due - time.monotonic())):
                break
            captures = [
                self.simulator.capture_at(tai_ns, camera, self._products)
                for camera in self._heard()
            ]
            self.node.publish(clock_message(tai_ns))
            self.node.publish(frame_message(tai_ns, self.scenario.poses(tai_ns), captures))
            self._publish(captures)
            late += time.monotonic() > due + self._step_s(epochs)
        return late

    @staticmethod
    def _step_s(epochs: Sequence[int]) -> float:
        return 1e-9 * (epochs[1] - epochs[0]) if len(epochs) > 1 else math.inf

    def follow(self, stop: Event) -> int:
        """Publish the images of every message on ``/tf`` that places a spacecraft.

        A spacecraft that a message leaves out follows the scenario. A message that cannot be
        rendered is logged, and has no image.

        returns : how many messages had images
        """
        count = 0
        while not stop.is_set():
            message = self.node.next_frames(_PAUSE_S)
            if message is None:
                continue
            try:
                if (state := self._state(message)) is None:
                    continue
                captures = [
                    self.simulator.capture(state, camera, self._products)
                    for camera in self._heard()
                ]
            except (SimglError, ValueError) as error:
                _LOG.warning("/tf: %s", error)
                continue
            self.node.publish(frame_message(state.tai_ns, {}, captures))
            self._publish(captures)
            count += 1
        return count

    def _state(self, message: Any) -> SceneState | None:
        """The scene of a message; None where it places no spacecraft of the scenario.

        Raises ValueError for stamps that differ, or numbers that are no pose.
        """
        sent = [
            one
            for one in message.transforms
            if one.header.frame_id == WORLD and one.child_frame_id in self.scenario.models
        ]
        if not sent:
            return None
        stamps = {(one.header.stamp.sec, one.header.stamp.nanosec) for one in sent}
        if len(stamps) > 1:
            raise ValueError("spacecraft of one message have different stamps")
        ((seconds, nanoseconds),) = stamps
        tai_ns = tai_ns_from_ros(seconds * 1_000_000_000 + nanoseconds)
        # /tf has no velocities. Light's aberration and LVLH axes take those of the scenario.
        poses = self.scenario.poses(tai_ns)
        placed = {
            one.child_frame_id: _pose(one.transform, poses[one.child_frame_id]) for one in sent
        }
        return self.scenario.with_poses(tai_ns, placed)

    @property
    def _products(self) -> set[Product]:
        return {Product.DN, Product.TRUTH} if self.depth else {Product.DN}

    def _heard(self) -> Iterator[str]:
        """The cameras that somebody listens to."""
        for camera in self.cameras:
            if any(map(self.node.is_heard, camera_topics(camera, depth=self.depth))):
                yield camera

    def _publish(self, captures: Sequence[Capture]) -> None:
        for capture in captures:
            for message in camera_messages(capture):
                self.node.publish(message)


def open_node(scenario: Scenario, cameras: tuple[str, ...], domain: int, *, depth: bool) -> RosNode:
    """The node of a run: of an installed ROS 2, else of DDS alone.

    Raises ConfigError for names, lenses and domains that cannot be.
    """
    check_names(scenario, cameras, scenario.epoch_tai_ns)
    topics = {"/clock": CLOCK, "/tf": TF}
    for camera in cameras:
        topics |= camera_topics(camera, depth=depth)
    if find_spec("rclpy") and find_spec("tf2_msgs"):
        from simgl.ros2.rclpy_node import RclpyNode

        return RclpyNode(topics, domain)
    from simgl.ros2.dds_node import DdsNode

    return DdsNode(topics, domain)


def _pose(transform: Any, known: Pose) -> Pose:
    translation, rotation = transform.translation, transform.rotation
    position = np.array([translation.x, translation.y, translation.z])
    q = np.array([rotation.x, rotation.y, rotation.z, rotation.w])
    length = float(np.linalg.norm(q))
    if not (np.isfinite(position).all() and abs(length - 1.0) < 1e-3):
        raise ValueError(f"position {position.tolist()} or quaternion {q.tolist()} is not a pose")
    return Pose(
        position=position,
        velocity=known.velocity,
        R_icrf_from_body=matrix_from_quaternion(q / length),
    )
