"""The messages of one epoch of a run: topic, type and fields."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from simgl.images import Capture
from simgl.physics.frames import Pose
from simgl.ros2 import ros_messages
from simgl.ros2.ros_messages import Message, ros_name
from simgl.scenario.scenario import Scenario

CLOCK = "rosgraph_msgs/msg/Clock"
TF = "tf2_msgs/msg/TFMessage"
IMAGE = "sensor_msgs/msg/Image"
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"

# Topic, type, message.
TopicMessage = tuple[str, str, Message]


def check_names(scenario: Scenario, cameras: Sequence[str], tai_ns: int) -> None:
    """Raise ConfigError for a name or a lens that ROS 2 cannot hold."""
    for name in scenario.models:
        ros_name("spacecraft", name)
    for name in cameras:
        ros_name("camera", name)
        ros_messages.camera_info(scenario.cameras[name], tai_ns)


def camera_topics(camera: str, *, depth: bool) -> dict[str, str]:
    """Topic to type of what a camera publishes."""
    topics = {f"/{camera}/camera_info": CAMERA_INFO, f"/{camera}/image_raw": IMAGE}
    return topics | ({f"/{camera}/depth/image_raw": IMAGE} if depth else {})


def clock_message(tai_ns: int) -> TopicMessage:
    """The time of an epoch."""
    return "/clock", CLOCK, ros_messages.clock(tai_ns)


def frame_message(
    tai_ns: int, poses: Mapping[str, Pose], captures: Sequence[Capture]
) -> TopicMessage:
    """Where spacecraft and cameras are."""
    infos = [capture.info for capture in captures]
    return "/tf", TF, ros_messages.transforms(tai_ns, poses.items(), infos)


def camera_messages(capture: Capture) -> Iterator[TopicMessage]:
    """Calibration, image, and depth where it was drawn; all of mid-exposure."""
    camera, tai_ns = capture.info.camera, capture.info.epoch_tai_ns
    info = ros_messages.camera_info(camera, tai_ns)
    yield f"/{camera.name}/camera_info", CAMERA_INFO, info
    assert capture.digital is not None
    yield f"/{camera.name}/image_raw", IMAGE, ros_messages.image(capture.digital)
    if capture.truth is not None:
        depth = ros_messages.depth_image(capture.truth)
        yield f"/{camera.name}/depth/image_raw", IMAGE, depth
