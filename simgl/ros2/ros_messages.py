"""ROS 2 messages as dictionaries, and the definitions of their types (ROS 2 Humble and later).

Camera axes are those of REP 103's optical frames: x right, y down, z along the boresight. Pixel
coordinates count from the centre of the first pixel in ROS, from its corner in simgl.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import astuple
from datetime import UTC, datetime
from typing import Any

import numpy as np

from simgl.arrays import Array, Array32
from simgl.camera.calibration_text import calibration_of, opencv_coefficients
from simgl.camera.camera import Camera
from simgl.camera.projections import Fisheye
from simgl.errors import ConfigError
from simgl.images import DigitalFrame, FrameInfo, TruthFrame
from simgl.physics.ephemeris import tai_ns_from_utc, utc_from_tai_ns
from simgl.physics.frames import Pose, quaternion_from_matrix

Message = dict[str, Any]
WORLD = "gcrf"
# ROS's seconds are 32 bits with a sign.
_LAST_SECOND = 2**31 - 1

_TIME = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec")
_HEADER = ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id")
_VECTOR = ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z")
_QUATERNION = ("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w")
_TRANSFORM = (
    "geometry_msgs/Transform",
    "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation",
)
_STAMPED = (
    "geometry_msgs/TransformStamped",
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform",
)
_REGION = (
    "sensor_msgs/RegionOfInterest",
    "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify",
)
# Type to its fields and the types that they have.
_TYPES = {
    "rosgraph_msgs/msg/Clock": ("builtin_interfaces/Time clock", (_TIME,)),
    "tf2_msgs/msg/TFMessage": (
        "geometry_msgs/TransformStamped[] transforms",
        (_STAMPED, _HEADER, _TIME, _TRANSFORM, _VECTOR, _QUATERNION),
    ),
    "sensor_msgs/msg/Image": (
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\n"
        "uint8 is_bigendian\nuint32 step\nuint8[] data",
        (_HEADER, _TIME),
    ),
    "sensor_msgs/msg/CameraInfo": (
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\n"
        "float64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\n"
        "uint32 binning_y\nsensor_msgs/RegionOfInterest roi",
        (_HEADER, _TIME, _REGION),
    ),
}


def definitions() -> dict[str, str]:
    """Type to its definition with all types inside, as a recording holds it."""
    rule = "=" * 80
    return {
        name: "\n".join([fields, *(f"{rule}\nMSG: {inner}\n{text}" for inner, text in parts), ""])
        for name, (fields, parts) in _TYPES.items()
    }


def ros_name(kind: str, name: str) -> str:
    """A camera's or spacecraft's name; ConfigError where it is none in ROS."""
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
        problem = "is not a name in ROS: letters, digits and _ are allowed, a letter first"
        raise ConfigError(f"[{kind}.{name}]", "", problem)
    return name


def optical_frame(camera: str) -> str:
    """The name of a camera's axes."""
    return f"{camera}_optical_frame"


def ros_time_ns(tai_ns: int) -> int:
    """Nanoseconds of the POSIX clock, which ROS's times are: UTC without its leap seconds.

    Raises ConfigError after 19 January 2038, when ROS's seconds overflow.
    """
    utc = utc_from_tai_ns(tai_ns)
    to_second, _, fraction = utc.partition(".")
    # A leap second has the time of the second after it, as on POSIX clocks.
    is_leap = to_second.endswith(":60")
    start = datetime.fromisoformat(to_second.replace(":60", ":59")).replace(tzinfo=UTC)
    seconds = int(start.timestamp()) + is_leap
    if seconds > _LAST_SECOND:
        raise ConfigError("ROS 2", "time", f"ends on 2038-01-19T03:14:07 UTC, got {utc}")
    return seconds * 1_000_000_000 + int(fraction.ljust(9, "0") if fraction else 0)


def tai_ns_from_ros(nanoseconds: int) -> int:
    """TAI of nanoseconds of the POSIX clock; raises ValueError before 1972."""
    seconds, fraction = divmod(nanoseconds, 1_000_000_000)
    utc = datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%dT%H:%M:%S")
    return tai_ns_from_utc(utc) + fraction


def time_message(tai_ns: int) -> Message:
    """builtin_interfaces/Time."""
    seconds, nanoseconds = divmod(ros_time_ns(tai_ns), 1_000_000_000)
    return {"sec": seconds, "nanosec": nanoseconds}


def _header(tai_ns: int, frame: str) -> Message:
    return {"stamp": time_message(tai_ns), "frame_id": frame}


def clock(tai_ns: int) -> Message:
    """rosgraph_msgs/Clock."""
    return {"clock": time_message(tai_ns)}


def image(digital: DigitalFrame) -> Message:
    """sensor_msgs/Image of the DN as they are: mono16, or bayer_rggb16 and so on."""
    mosaic = digital.info.camera.detector.mosaic
    encoding = "mono16" if mosaic is None else f"bayer_{mosaic.order.lower()}16"
    return _image(digital.info, encoding, digital.dn.astype("<u2"))


def depth_image(truth: TruthFrame) -> Message:
    """sensor_msgs/Image 32FC1: along the boresight [m], NaN where there is no spacecraft."""
    depth: Array32 = np.where(truth.depth == 0.0, np.float32(np.nan), truth.depth)
    return _image(truth.info, "32FC1", depth.astype("<f4"))


def _image(info: FrameInfo, encoding: str, pixels: np.ndarray[Any, np.dtype[Any]]) -> Message:
    height, width = pixels.shape
    return {
        "header": _header(info.epoch_tai_ns, optical_frame(info.camera.name)),
        "height": height,
        "width": width,
        "encoding": encoding,
        "is_bigendian": 0,
        "step": width * pixels.itemsize,
        "data": pixels.tobytes(),
    }


def camera_info(camera: Camera, tai_ns: int) -> Message:
    """sensor_msgs/CameraInfo: plumb_bob, rational_polynomial or equidistant.

    Raises ConfigError, which names the camera, for a lens that these do not hold.
    """
    model, coefficients = _lens(camera)
    (fx, skew, cx), (_, fy, cy), _ = camera.intrinsics.tolist()
    return {
        "header": _header(tai_ns, optical_frame(camera.name)),
        "height": camera.detector.height,
        "width": camera.detector.width,
        "distortion_model": model,
        "d": list(coefficients),
        "k": [fx, skew, cx - 0.5, 0.0, fy, cy - 0.5, 0.0, 0.0, 1.0],
        "r": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "p": [fx, skew, cx - 0.5, 0.0, 0.0, fy, cy - 0.5, 0.0, 0.0, 0.0, 1.0, 0.0],
        "binning_x": 0,
        "binning_y": 0,
        # All zero means the full image.
        "roi": {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False},
    }


def _lens(camera: Camera) -> tuple[str, tuple[float, ...]]:
    distortion = camera.lens.distortion
    if isinstance(distortion, Fisheye):
        return "equidistant", astuple(distortion)
    values = opencv_coefficients(camera.name, calibration_of(camera), "ROS")
    if any(values[8:]):
        problem = "has a thin prism or a tilted detector, which ROS's CameraInfo cannot hold"
        raise ConfigError(f"[camera.{camera.name}]", "", problem)
    if any(values[5:]):
        return "rational_polynomial", values[:8]
    return "plumb_bob", values[:5]


def transform(tai_ns: int, child: str, position: Array, R_gcrf_from_child: Array) -> Message:
    """geometry_msgs/TransformStamped from GCRF to a frame at a position (3,) [m]."""
    x, y, z = position.tolist()
    qx, qy, qz, qw = quaternion_from_matrix(R_gcrf_from_child).tolist()
    return {
        "header": _header(tai_ns, WORLD),
        "child_frame_id": child,
        "transform": {
            "translation": {"x": x, "y": y, "z": z},
            "rotation": {"x": qx, "y": qy, "z": qz, "w": qw},
        },
    }


def transforms(
    tai_ns: int, spacecraft: Iterable[tuple[str, Pose]], cameras: Iterable[FrameInfo]
) -> Message:
    """tf2_msgs/TFMessage: GCRF to the bodies of spacecraft and to the axes of cameras."""
    bodies = [transform(tai_ns, n, p.position, p.R_icrf_from_body) for n, p in spacecraft]
    eyes = [
        transform(tai_ns, optical_frame(i.camera.name), i.position, i.R_camera_from_icrf.T)
        for i in cameras
    ]
    return {"transforms": bodies + eyes}
