"""What ROS's own formulas make of the messages is what simgl draws."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from simgl.camera.camera import Camera
from simgl.camera.detector import ORDERS, Mosaic
from simgl.camera.lens import Lens
from simgl.camera.projections import Distortion, DoubleSphere, Fisheye, Projection
from simgl.errors import ConfigError
from simgl.images import DigitalFrame, FrameInfo
from simgl.physics.ephemeris import tai_ns_from_utc
from simgl.ros2.ros_messages import camera_info, image, ros_name, ros_time_ns
from simgl.scenario.loader import scenario_from_dict

CAMERA = scenario_from_dict(
    {
        "epoch": {"utc": "2026-03-20T12:00:00"},
        "camera": {
            "nav": {
                "position_icrf_m": [7.0e6, 0.0, 0.0],
                "boresight": [1.0, 0.0, 0.0],
                "width_px": 640,
                "height_px": 480,
                "focal_length_mm": 4.0,
            }
        },
    }
).cameras["nav"]
RAYS = np.array([[0.0, 0.0, 1.0], [0.3, -0.2, 1.0], [-0.4, 0.3, 1.0], [0.1, 0.4, 1.0]])


def with_lens(distortion: Projection | None) -> Camera:
    lens: Lens = replace(CAMERA.lens, distortion=distortion, principal_offset=(1e-4, -2e-4))
    return replace(CAMERA, lens=lens)


@pytest.mark.parametrize(
    ("distortion", "model", "count"),
    [
        (None, "plumb_bob", 5),
        (Distortion(k1=-0.2, k2=0.05, p1=0.001, p2=-0.002, k3=0.01), "plumb_bob", 5),
        (Distortion(k1=-0.2, k4=0.1, k6=0.02), "rational_polynomial", 8),
        (Fisheye(k1=-0.02, k2=0.003), "equidistant", 4),
    ],
)
def test_points_fall_where_opencv_puts_them(
    distortion: Projection | None, model: str, count: int
) -> None:
    """OpenCV counts from the centre of the first pixel: half a pixel less on either axis."""
    camera = with_lens(distortion)
    info = camera_info(camera, 0)
    assert (info["distortion_model"], len(info["d"])) == (model, count)
    assert (info["width"], info["height"]) == (640, 480)
    K, d, zero = np.array(info["k"]).reshape(3, 3), np.array(info["d"]), np.zeros(3)
    project = cv2.fisheye.projectPoints if model == "equidistant" else cv2.projectPoints
    arguments = (zero, zero, K, d)
    points = project(RAYS.reshape(-1, 1, 3), *arguments)[0].reshape(-1, 2)
    np.testing.assert_allclose(points, camera.project(RAYS) - 0.5, atol=1e-9)


@pytest.mark.parametrize(
    ("distortion", "complaint"),
    [
        (Distortion(s1=0.01), "has a thin prism or a tilted detector, which ROS's CameraInfo can"),
        (DoubleSphere(xi=0.1, alpha=0.5), "has double_sphere, which files of ROS cannot hold"),
    ],
)
def test_other_lenses_are_refused_by_name(distortion: Projection, complaint: str) -> None:
    with pytest.raises(ConfigError, match=rf"\[camera.nav\]: {complaint}"):
        camera_info(with_lens(distortion), 0)


@pytest.mark.parametrize("order", [None, *ORDERS])
def test_images_hold_the_dn_as_they_are(order: str | None) -> None:
    """Little-endian, row by row; the mosaic by its first two rows."""
    band = (0.5, 0.5, 0.5, 0.5)
    mosaic = Mosaic(order=order, red=band, green=band, blue=band) if order else None
    camera = replace(CAMERA, detector=replace(CAMERA.detector, mosaic=mosaic))
    info = FrameInfo(
        scenario="test",
        camera=camera,
        epoch_tai_ns=tai_ns_from_utc("2026-03-20T12:00:00"),
        position=np.zeros(3),
        R_camera_from_icrf=np.eye(3),
        sun_direction_icrf=np.array([0.0, 0.0, 1.0]),
        sun_irradiance=np.ones(4),
        seed=0,
        renderer="none",
    )
    dn = np.array([[0, 1, 258], [4095, 3, 4]], dtype=np.uint16)
    message = image(DigitalFrame(info=info, dn=dn))
    assert message["encoding"] == (f"bayer_{order.lower()}16" if order else "mono16")
    assert (message["height"], message["width"], message["step"]) == (2, 3, 6)
    assert message["data"] == bytes([0, 0, 1, 0, 2, 1, 255, 15, 3, 0, 4, 0])
    assert message["header"]["frame_id"] == "nav_optical_frame"


@pytest.mark.parametrize(
    ("utc", "seconds"),
    [
        ("1972-01-01T00:00:00", 63_072_000),
        ("2026-03-20T12:00:00.25", 1_774_008_000.25),
        ("2016-12-31T23:59:59", 1_483_228_799),
        ("2016-12-31T23:59:60", 1_483_228_800),
        ("2017-01-01T00:00:00", 1_483_228_800),
        ("2038-01-19T03:14:07", 2**31 - 1),
    ],
)
def test_times_are_those_of_the_posix_clock(utc: str, seconds: float) -> None:
    """POSIX counts 86,400 s a day from 1970 on, and the leap second twice."""
    assert ros_time_ns(tai_ns_from_utc(utc)) == int(seconds * 4) * 250_000_000


def test_the_end_of_ros_time_is_one_line() -> None:
    with pytest.raises(ConfigError, match="ends on 2038-01-19T03:14:07 UTC, got 2038-01-1"):
        ros_time_ns(tai_ns_from_utc("2038-01-19T03:14:08"))


@pytest.mark.parametrize("name", ["nav-cam", "2nd", "a b", ""])
def test_names_that_ros_does_not_have_are_refused(name: str) -> None:
    with pytest.raises(ConfigError, match="is not a name in ROS: letters, digits and _ are allow"):
        ros_name("camera", name)
