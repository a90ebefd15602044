"""ROS 2's message types for Cyclone DDS, which is what ROS 2 speaks on the network.

As design.ros2.org/articles/topic_and_service_names.html has it: topic ``rt/NAME``, type
``PACKAGE::msg::dds_::TYPE_``, plain CDR. Annotations are evaluated by Cyclone, so this module has
no postponed ones.
"""

import struct
from dataclasses import dataclass, fields
from typing import Any

from cyclonedds.idl import Endianness, IdlStruct
from cyclonedds.idl.types import array, float64, int32, sequence, uint8, uint32


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    """builtin_interfaces/Time."""

    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    """std_msgs/Header."""

    stamp: Time
    frame_id: str


@dataclass
class Clock(IdlStruct, typename="rosgraph_msgs::msg::dds_::Clock_"):
    """rosgraph_msgs/Clock."""

    clock: Time


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    """geometry_msgs/Vector3."""

    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    """geometry_msgs/Quaternion."""

    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    """geometry_msgs/Transform."""

    translation: Vector3
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    """geometry_msgs/TransformStamped."""

    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    """tf2_msgs/TFMessage."""

    transforms: sequence[TransformStamped]


@dataclass
class RegionOfInterest(IdlStruct, typename="sensor_msgs::msg::dds_::RegionOfInterest_"):
    """sensor_msgs/RegionOfInterest."""

    x_offset: uint32
    y_offset: uint32
    height: uint32
    width: uint32
    do_rectify: bool


@dataclass
class CameraInfo(IdlStruct, typename="sensor_msgs::msg::dds_::CameraInfo_"):
    """sensor_msgs/CameraInfo."""

    header: Header
    height: uint32
    width: uint32
    distortion_model: str
    d: sequence[float64]
    k: array[float64, 9]
    r: array[float64, 9]
    p: array[float64, 12]
    binning_x: uint32
    binning_y: uint32
    roi: RegionOfInterest


@dataclass
class Image(IdlStruct, typename="sensor_msgs::msg::dds_::Image_"):
    """sensor_msgs/Image."""

    header: Header
    height: uint32
    width: uint32
    encoding: str
    is_bigendian: uint8
    step: uint32
    data: sequence[uint8]

    def serialize(
        self, buffer: Any = None, endianness: Any = None, use_version_2: Any = None
    ) -> bytes:
        """The message with its pixels appended as they are.

        Cyclone would pack them one by one: 0.2 s for 1280 x 960.
        """
        del buffer, endianness
        pixels, self.data = self.data, []
        try:
            # Ends with the number of pixels.
            head = super().serialize(endianness=Endianness.Little, use_version_2=use_version_2)
        finally:
            self.data = pixels
        return head[:-4] + struct.pack("<I", len(pixels)) + bytes(pixels)


TYPES: dict[str, type[IdlStruct]] = {
    "rosgraph_msgs/msg/Clock": Clock,
    "tf2_msgs/msg/TFMessage": TFMessage,
    "sensor_msgs/msg/Image": Image,
    "sensor_msgs/msg/CameraInfo": CameraInfo,
}


def sample_of(kind: Any, message: Any) -> Any:
    """An object of a type of this module from a message as a dictionary."""
    if isinstance(message, dict):
        return kind(**{f.name: sample_of(f.type, message[f.name]) for f in fields(kind)})
    if isinstance(message, list) and any(isinstance(each, dict) for each in message):
        # A sequence of messages is annotated with their type.
        return [sample_of(kind.__metadata__[0].subtype, each) for each in message]
    return message
