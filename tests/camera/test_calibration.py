"""Calibration files: those that OpenCV, ROS and Kalibr write, and what simgl writes for them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from simgl.camera.calibration import read_calibration
from simgl.camera.calibration_text import FORMATS, calibration_of, calibration_text
from simgl.camera.camera import Camera
from simgl.camera.camera_schema import CameraSettingsTable
from simgl.camera.presets import read_camera
from simgl.camera.projections import Distortion, DoubleSphere, Fisheye, Projection
from simgl.config.validation import convert
from simgl.errors import AssetError, ConfigError, SimglError
from tests.camera.test_projections import BROWN, FISHEYE, PRISM, RATIONAL, TILTED, lens_camera

# As OpenCV's sample program calibration.cpp writes it.
OPENCV = """\
%YAML:1.0
---
calibration_time: "Mon 23 Nov 2026 08:12:40 UTC"
nframes: 27
image_width: 640
image_height: 480
board_width: 9
square_size: 2.5000000372529030e-02
# flags: +fix_aspect_ratio +zero_tangent_dist
flags: 6
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.3591573396163199e+02, 0., 3.4228315473308373e+02, 0.,
       5.3491573396163199e+02, 2.3557082909788173e+02, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -2.6637260909660682e-01, -3.8588898922304653e-02,
       1.7831947042852964e-03, -2.8122100441115472e-04,
       2.3839153080878486e-01 ]
avg_reprojection_error: 3.9259109564815858e-01
"""
# As Kalibr writes it for a stereo camera, with numbers that PyYAML writes.
KALIBR = """\
cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
  distortion_model: radtan
  intrinsics: [458.654, 457.296, 367.215, 248.375]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [0.9999, 0.0, 0.0, -0.11]
  - [0.0, 0.9999, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [0]
  camera_model: ds
  distortion_coeffs: []
  distortion_model: none
  intrinsics: [-0.17, 0.59, 157.3, 157.2, 255.1, 256.9]
  resolution: [512, 512]
  rostopic: /cam1/image_raw
"""
# As camera_calibration of ROS writes it.
ROS = """\
image_width: 640
image_height: 480
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [438.783367, 0.000000, 305.593336, 0.000000, 437.302876, 243.738352, 0.000000, 0.0, 1.0]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.361976, 0.110510, 0.001014, 0.000505, 0.000000]
rectification_matrix:
  rows: 3
  cols: 3
  data: [0.999978, 0.002789, -0.006046, -0.002816, 0.999986, -0.004401, 0.006034, 0.004, 1.0]
projection_matrix:
  rows: 3
  cols: 4
  data: [393.653800, 0.000000, 322.797939, 0.0, 0.0, 393.6538, 241.090902, 0.0, 0.0, 0.0, 1.0, 0.0]
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "calibration.yaml"
    path.write_text(text)
    return path


def test_a_file_of_opencv_is_read(tmp_path: Path) -> None:
    """OpenCV counts from the centre of the first pixel, simgl from its corner."""
    its = read_calibration(written(tmp_path, OPENCV))
    assert its.focal_length == (535.91573396163199, 534.91573396163199)
    assert its.principal_point == (342.78315473308373, 236.07082909788173)
    assert (its.skew, its.size) == (0.0, (640, 480))
    assert its.distortion == Distortion(
        k1=-2.6637260909660682e-01, k2=-3.8588898922304653e-02,
        p1=1.7831947042852964e-03, p2=-2.8122100441115472e-04, k3=2.3839153080878486e-01,
    )  # fmt: skip


def test_a_file_of_ros_is_read(tmp_path: Path) -> None:
    its = read_calibration(written(tmp_path, ROS))
    assert its.focal_length == (438.783367, 437.302876)
    assert its.principal_point == (306.093336, 244.238352)
    assert its.distortion == Distortion(k1=-0.361976, k2=0.110510, p1=0.001014, p2=0.000505)
    fisheye = ROS.replace("plumb_bob", "equidistant").replace(", 0.000000]\nrect", "]\nrect")
    its = read_calibration(written(tmp_path, fisheye))
    assert its.distortion == Fisheye(k1=-0.361976, k2=0.110510, k3=0.001014, k4=0.000505)


def test_a_message_of_ros_is_read(tmp_path: Path) -> None:
    """As ``ros2 topic echo --once camera_info`` prints it."""
    text = (
        "height: 480\nwidth: 640\ndistortion_model: rational_polynomial\n"
        "d:\n- 0.1\n- -0.02\n- 0.001\n- 0.0\n- 0.0\n- 0.3\n- 0.0\n- 1e-05\n"
        "k:\n- 500.0\n- 0.0\n- 319.5\n- 0.0\n- 500.0\n- 239.5\n- 0.0\n- 0.0\n- 1.0\n"
    )
    its = read_calibration(written(tmp_path, text))
    assert its.principal_point == (320.0, 240.0)
    assert its.distortion == Distortion(k1=0.1, k2=-0.02, p1=0.001, k4=0.3, k6=1e-05)


def camera_info(binning: tuple[int, int], roi: tuple[int, int, int, int]) -> str:
    """A message of ROS; roi: left, top, width and height."""
    left, top, width, height = roi
    return (
        "height: 480\nwidth: 640\ndistortion_model: plumb_bob\nd: [0.1, 0.0, 0.0, 0.0, 0.0]\n"
        "k: [500.0, 3.0, 319.5, 0.0, 510.0, 239.5, 0.0, 0.0, 1.0]\n"
        f"binning_x: {binning[0]}\nbinning_y: {binning[1]}\nroi:\n  x_offset: {left}\n"
        f"  y_offset: {top}\n  height: {height}\n  width: {width}\n  do_rectify: false\n"
    )


@pytest.mark.parametrize("binning", [(0, 0), (1, 1), (2, 2), (4, 2)])
@pytest.mark.parametrize("roi", [(0, 0, 0, 0), (100, 52, 320, 200)])
def test_a_window_and_binned_pixels_of_ros_see_what_those_of_the_detector_see(
    binning: tuple[int, int], roi: tuple[int, int, int, int], tmp_path: Path
) -> None:
    """The place of a point on the detector, less the window's corner, over the binning."""
    written(tmp_path, camera_info((1, 1), (0, 0, 0, 0)))
    whole = placed(tmp_path, calibration="calibration.yaml", pixel_pitch_um=5.0)
    written(tmp_path, camera_info(binning, roi))
    across, down = (max(one, 1) for one in binning)
    pitch = 5.0 * across
    seen = placed(tmp_path, calibration="calibration.yaml", pixel_pitch_um=pitch)
    left, top, width, height = roi if roi[2] else (0, 0, 640, 480)
    assert (seen.detector.width, seen.detector.height) == (width // across, height // down)
    rays = np.random.default_rng(7).uniform(-0.4, 0.4, (100, 3))
    rays[:, 2] += 1.0
    expected = (whole.project(rays) - (left, top)) / (across, down)
    np.testing.assert_allclose(seen.project(rays), expected, atol=1e-9)
    # The lens stays as long.
    assert seen.lens.focal_length == pytest.approx(whole.lens.focal_length, rel=1e-12)


def test_binned_pixels_need_a_pitch_of_their_own(tmp_path: Path) -> None:
    written(tmp_path, camera_info((2, 2), (0, 0, 0, 0)))
    with pytest.raises(ConfigError, match=r"pixel_pitch_um is missing; calibration is of pixels b"):
        placed(tmp_path, calibration="calibration.yaml")


@pytest.mark.parametrize("name", ["dist_coeff", "dist_coeffs", "distCoeffs", "D"])
def test_coefficients_are_read_under_the_names_that_scripts_give_them(
    name: str, tmp_path: Path
) -> None:
    text = (
        f"camera_matrix: [[500, 0, 320], [0, 500, 240], [0, 0, 1]]\n{name}: [[0.1, 0.2, 0, 0, 0]]\n"
    )
    assert read_calibration(written(tmp_path, text)).distortion == Distortion(k1=0.1, k2=0.2)


def test_a_file_of_kalibr_is_read(tmp_path: Path) -> None:
    path = written(tmp_path, KALIBR)
    its = read_calibration(path, "cam0")
    assert its.focal_length == (458.654, 457.296)
    assert its.principal_point == (367.715, 248.875)
    assert its.distortion == Distortion(
        k1=-0.28340811, k2=0.07395907, p1=0.00019359, p2=1.76187114e-05
    )
    assert read_calibration(path, "cam1").distortion == DoubleSphere(xi=-0.17, alpha=0.59)
    with pytest.raises(ConfigError, match=r"holds cam0, cam1; calibration = \{ file, camera \}"):
        read_calibration(path)
    with pytest.raises(ConfigError, match='has no camera "cam2"; did you mean "cam'):
        read_calibration(path, "cam2")


def test_one_sphere_of_kalibr_is_a_double_sphere_without_the_second(tmp_path: Path) -> None:
    """Mei's model by its own formula: x / (z + xi |ray|)."""
    text = (
        "cam0:\n  camera_model: omni\n  distortion_model: none\n  distortion_coeffs: []\n"
        "  intrinsics: [1.2, 700.0, 710.0, 320.0, 240.0]\n  resolution: [640, 480]\n"
    )
    its = read_calibration(written(tmp_path, text))
    rays = np.random.default_rng(8).normal(size=(100, 3))
    rays = rays[rays[:, 2] > 0.0]
    expected = rays[:, :2] / (rays[:, 2:] + 1.2 * np.linalg.norm(rays, axis=1, keepdims=True))
    assert its.distortion is not None
    found = its.distortion.projected(rays) * its.focal_length
    np.testing.assert_allclose(found, expected * (700.0, 710.0), rtol=1e-12)


LENSES: dict[str, tuple[Projection | None, set[str]]] = {
    "none": (None, {"opencv", "ros", "kalibr"}),
    "brown": (Distortion(**BROWN), {"opencv", "ros"}),
    "radtan": (Distortion(k1=-0.2, p2=1e-5), {"opencv", "ros", "kalibr"}),
    "rational": (Distortion(**BROWN, **RATIONAL), {"opencv", "ros"}),
    "tilted": (Distortion(**BROWN, **RATIONAL, **PRISM, **TILTED), {"opencv"}),
    "fisheye": (Fisheye(**FISHEYE), {"opencv", "ros", "kalibr"}),
    "double sphere": (DoubleSphere(xi=-0.27, alpha=0.57), {"kalibr"}),
}


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("name", LENSES)
def test_what_is_written_is_read_again(name: str, form: str, tmp_path: Path) -> None:
    lens, forms = LENSES[name]
    cam = lens_camera(lens)
    if form not in forms:
        with pytest.raises(ConfigError, match="cannot hold"):
            calibration_text(cam, form)
        return
    its = read_calibration(written(tmp_path, calibration_text(cam, form)))
    # Half a pixel taken off and added: the last digit.
    np.testing.assert_allclose(its.principal_point, cam.principal_point, rtol=1e-15)
    given = calibration_of(cam)
    assert (its.focal_length, its.size) == (given.focal_length, (640, 480))
    assert its.distortion == lens


@pytest.mark.parametrize("name", [name for name, (_, forms) in LENSES.items() if "opencv" in forms])
def test_opencv_reads_what_is_written_for_it(name: str, tmp_path: Path) -> None:
    cv2 = pytest.importorskip("cv2")
    cam = lens_camera(LENSES[name][0])
    path = written(tmp_path, calibration_text(cam, "opencv"))
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    matrix, values = (
        storage.getNode(key).mat() for key in ("camera_matrix", "distortion_coefficients")
    )
    rays = np.random.default_rng(9).uniform(-0.4, 0.4, (200, 3))
    rays[:, 2] += 1.0
    zero = np.zeros(3)
    if storage.getNode("fisheye_model").real():
        expected, _ = cv2.fisheye.projectPoints(rays[:, None], zero, zero, matrix, values)
    else:
        expected, _ = cv2.projectPoints(rays, zero, zero, matrix, values)
    expected = expected.reshape(-1, 2)
    np.testing.assert_allclose(cam.project(rays) - 0.5, expected, atol=1e-9)
    # And what OpenCV itself writes is read.
    storage = cv2.FileStorage(str(tmp_path / "own.yml"), cv2.FILE_STORAGE_WRITE)
    storage.write("camera_matrix", matrix)
    storage.write("distortion_coefficients", values)
    storage.write("fisheye_model", int(name == "fisheye"))
    storage.release()
    its = read_calibration(tmp_path / "own.yml")
    assert (its.distortion, its.size) == (LENSES[name][0], None)


def placed(folder: Path, **keys: Any) -> Camera:
    """The camera of a table beside a file ``calibration.yaml``."""
    table = convert({"preset": "ideal", **keys}, CameraSettingsTable, "[camera.nav]")
    return read_camera("[camera.nav]", "nav", table, 5772.0, folder)


def test_a_camera_has_what_its_calibration_says(tmp_path: Path) -> None:
    written(tmp_path, KALIBR)
    cam = placed(tmp_path, calibration={"file": "calibration.yaml", "camera": "cam0"})
    assert (cam.detector.width, cam.detector.height) == (752, 480)
    k = cam.intrinsics
    np.testing.assert_allclose(
        k, np.array([[458.654, 0, 367.715], [0, 457.296, 248.875], [0, 0, 1]]), rtol=1e-12
    )
    # OpenCV's formula at one point: x = 0.3, y = -0.2.
    radial = 1.0 - 0.28340811 * 0.13 + 0.07395907 * 0.13**2
    p1, p2 = 0.00019359, 1.76187114e-05
    x = 0.3 * radial + 2 * p1 * -0.06 + p2 * (0.13 + 2 * 0.09)
    y = -0.2 * radial + p1 * (0.13 + 2 * 0.04) + 2 * p2 * -0.06
    expected = [458.654 * x + 367.715, 457.296 * y + 248.875]
    np.testing.assert_allclose(cam.project(np.array([0.6, -0.4, 2.0])), expected, atol=1e-9)


def test_the_keys_of_a_camera_say_the_same(tmp_path: Path) -> None:
    written(tmp_path, OPENCV.replace("0., 3.4228315473308373e+02", "1.5, 3.4228315473308373e+02"))
    from_file = placed(tmp_path, calibration="calibration.yaml")
    by_hand = placed(
        tmp_path,
        width_px=640,
        height_px=480,
        focal_length_px=[5.3591573396163199e02, 5.3491573396163199e02],
        principal_point_px=[3.4228315473308373e02 + 0.5, 2.3557082909788173e02 + 0.5],
        skew_px=1.5,
        optics={
            "distortion": {
                "k1": -2.6637260909660682e-01, "k2": -3.8588898922304653e-02,
                "p1": 1.7831947042852964e-03, "p2": -2.8122100441115472e-04,
                "k3": 2.3839153080878486e-01,
            }
        },
    )  # fmt: skip
    assert from_file == by_hand
    assert by_hand.intrinsics[0, 1] == pytest.approx(1.5)


def test_keys_that_a_calibration_has_are_refused_beside_it(tmp_path: Path) -> None:
    written(tmp_path, OPENCV)
    for keys in (
        {"focal_length_mm": 8.0},
        {"focal_length_px": 500.0},
        {"principal_point_px": [1.0, 2.0]},
        {"skew_px": 0.0},
        {"optics": {"distortion": {"k1": 0.1}}},
    ):
        with pytest.raises(ConfigError, match="contradicts calibration, which has it"):
            placed(tmp_path, calibration="calibration.yaml", **keys)
    with pytest.raises(
        ConfigError, match="width_px must be 640 as in calibration, or left out, got"
    ):
        placed(tmp_path, calibration="calibration.yaml", width_px=1280)
    assert placed(tmp_path, calibration="calibration.yaml", width_px=640).detector.height == 480


DAMAGES: list[tuple[str, str, str, str]] = [
    (OPENCV, "camera_matrix:", "matrix:", ": holds no calibration; camera_matrix (OpenCV, "),
    (
        OPENCV,
        "5.3591573396163199e+02",
        "-5.3",
        ": camera_matrix must hold positive focal lengths, got -5.3",
    ),
    (
        OPENCV,
        "5.3591573396163199e+02",
        ".Nan",
        ': camera_matrix.data must hold finite numbers, got ".Nan"',
    ),
    (
        OPENCV,
        "5.3591573396163199e+02",
        "1e400",
        ': camera_matrix.data must hold finite numbers, got "1e400"',
    ),
    (
        OPENCV,
        "5.3591573396163199e+02",
        "[1, 2]",
        ': camera_matrix.data must hold finite numbers, got ["1", "2"]',
    ),
    (OPENCV, "0., 0., 1. ]", "0., 0. ]", ": camera_matrix must hold 9 numbers, got 8"),
    (OPENCV, "0., 0., 1. ]", "0., 1., 1. ]", ": camera_matrix must be [fx, skew, cx, 0, fy, cy, 0"),
    (
        OPENCV,
        ",\n       2.3839153080878486e-01",
        ", 1, 2",
        ": distortion_coefficients must hold 4 or 5 or 8 or 12 or 14 numbers",
    ),
    (
        OPENCV,
        "image_width: 640",
        "image_width: 640.5",
        ": image_width must be a whole number of pixels, got 640.5",
    ),
    (
        OPENCV,
        "image_width: 640",
        "image_width: [640]",
        ': image_width must hold finite numbers, got ["640"]',
    ),
    (OPENCV, "image_width: 640", "", ": image_width is missing"),
    (OPENCV, "flags: 6", "flags: 6\nflags: 7", ': is not valid YAML: holds "flags" twice'),
    (OPENCV, "flags: 6", "flags: [6", ": is not valid YAML: "),
    (OPENCV, "flags: 6", f"flags: {'[' * 40}{']' * 40}", ": is nested too deeply"),
    (OPENCV, "flags: 6", f"flags: {'[' * 4000}", ": is nested too deeply"),
    (
        OPENCV,
        "flags: 6",
        "flags: &a [*a]",
        ": is not valid YAML: found unconstructable recursive node",
    ),
    (OPENCV, "flags: 6", f"flags: {'6' * (1 << 19)}", ": is too long, "),
    (
        OPENCV,
        "0., 0., 1. ]",
        "0., 0., 2. ]",
        ": camera_matrix must be [fx, skew, cx, 0, fy, cy, "
        "0, 0, 1], got [535.916, 0, 342.283, 0, 534.916, 235.571, 0, 0, 2]",
    ),
    (
        OPENCV,
        "distortion_coefficients:",
        "distortion_parameters:",
        ': distortion_parameters is not read; did you mean "distortion_coefficients"? (allowed: ',
    ),
    (
        OPENCV,
        "flags: 6",
        "roi: {x_offset: 600, width: 100, height: 480}",
        ": roi ends at 700 x 480, beyond the image of 640 x 480 pixels",
    ),
    (OPENCV, "flags: 6", "binning_x: 0.5", ": binning_x must be a whole number of pixels, got 0.5"),
    (OPENCV, "flags: 6", "binning_x: 1000", ": binning_x must be a whole number of pixels, got 0"),
    (OPENCV, "flags: 6", "roi: 5", ': roi must be a table, got "5"'),
    (
        OPENCV,
        "flags: 6",
        "fisheye_model: 1\ndistortion_model: plumb_bob",
        ": distortion_model contradicts fisheye_model",
    ),
    (ROS, "plumb_bob", "plump_bob", ': distortion_model is not read: "plump_bob"; did'),
    (
        ROS,
        "plumb_bob",
        "rational_polynomial",
        ": distortion_coefficients must hold 8 or 12 or 14 numbers, got 5",
    ),
    (
        ROS,
        "plumb_bob",
        "equidistant",
        ": distortion_coefficients must hold 4 numbers of a fisheye lens, got 5",
    ),
    (
        KALIBR,
        "camera_model: pinhole",
        "camera_model: eucm",
        ': cam0.camera_model is not read: "eucm"; allowed: ds, ',
    ),
    (
        KALIBR,
        "distortion_model: radtan",
        "distortion_model: fov",
        ': cam0.distortion_model is not read: "fov"; allowed: equi',
    ),
    (
        KALIBR,
        "camera_model: pinhole",
        "camera_model: omni",
        ": cam0.intrinsics must hold xi, fu, fv, pu, pv, got",
    ),
    (
        KALIBR,
        "resolution: [752, 480]",
        "resolution: [752]",
        ": cam0.resolution must hold width and height, got 1 numbers",
    ),
    (
        KALIBR,
        "resolution: [752, 480]",
        "resolution: 752",
        ': cam0.resolution must be a list of numbers, got "752"',
    ),
    (KALIBR, "248.375]", "248.375", ": is not valid YAML: "),
    (
        KALIBR,
        "  distortion_model: radtan\n",
        "",
        ": cam0.distortion_coeffs requires a distortion_model: radtan or equidistant",
    ),
    (
        KALIBR.replace("[458", "[-1.0, 458")
        .replace("radtan", "none")
        .replace("[-0.28", "[0, 0] # "),
        "camera_model: pinhole",
        "camera_model: omni",
        ": cam0.intrinsics must hold xi of at least 0, got -1",
    ),
]


FORMATTED: dict[str, tuple[str, str]] = {
    "byte order mark": (OPENCV, "\ufeff" + OPENCV),
    "comments first": (OPENCV, "\n  # of the left camera\n" + OPENCV),
    "lines of Windows": (OPENCV, OPENCV.replace("\n", "\r\n")),
    "tabs": (OPENCV, OPENCV.replace("[ 5.", "[\t5.").replace("0., 3.", "0.,\t 3.")),
    "as JSON": (ROS, str(yaml.safe_load(ROS)).replace("'", '"')),
    "next document": (ROS, ROS + "---\n"),
    "sensor file of EuRoC": (
        KALIBR.partition("cam1:")[0],
        """\
# General sensor definitions.
sensor_type: camera
T_BS: {cols: 4, rows: 4, data: [1.0, 0.0, 0.0, 0.0]}
resolution: [752, 480]
camera_model: pinhole
intrinsics: [458.654, 457.296, 367.215, 248.375] #fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
""",
    ),
}


@pytest.mark.parametrize("name", FORMATTED)
def test_a_file_says_the_same_in_other_forms(name: str, tmp_path: Path) -> None:
    plain, other = FORMATTED[name]
    expected = read_calibration(written(tmp_path, plain))
    (tmp_path / "calibration.yaml").write_bytes(other.encode())
    assert read_calibration(tmp_path / "calibration.yaml") == expected


@pytest.mark.parametrize(("text", "old", "new", "message"), DAMAGES)
def test_a_damaged_file_is_refused_in_one_line(
    text: str, old: str, new: str, message: str, tmp_path: Path
) -> None:
    assert text.count(old) >= 1
    path = written(tmp_path, text.replace(old, new, 1))
    with pytest.raises(SimglError) as caught:
        read_calibration(path, "cam0" if "cam0" in text else None)
    found = str(caught.value)
    assert found.startswith(f"{path}{message}")
    assert "\n" not in found
    assert len(found) < 600


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"focal_length_px": 0.0}, "focal_length_px must hold positive focal lengths, got 0 and 0"),
        ({"focal_length_px": [500.0, -500.0]}, "focal_length_px must hold positive focal lengths"),
        (
            {"focal_length_px": [1.0, 5.0]},
            "focal_length_px must hold focal lengths within a factor",
        ),
        ({"focal_length_px": 500.0, "focal_length_mm": 8.0}, "focal_length_px contradicts focal_"),
        ({"skew_px": 4000.0}, "skew_px must lie within +-1 of the focal length, got 1.53"),
        ({"principal_point_px": [9000.0, 1.0]}, "principal_point_px must hold a principal point"),
        ({"principal_point_px": [90.0]}, "principal_point_px must be a list of length 2"),
        (
            {"optics": {"distortion": {"model": "fisheye", "p1": 0.1}}},
            'optics.distortion.p1 requires model = "pinhole", got',
        ),
        (
            {"optics": {"distortion": {"model": "double_sphere", "xi": 0.1}}},
            "optics.distortion.alpha is missing; model",
        ),
        (
            {"optics": {"distortion": {"xi": 0.1}}},
            'optics.distortion.xi requires model = "double_sphere", got',
        ),
        ({"optics": {"distortion": {"model": "brown"}}}, "optics.distortion.model must be one of "),
    ],
)
def test_impossible_keys_are_refused(keys: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as caught:
        placed(tmp_path, **keys)
    assert str(caught.value).startswith(f"[camera.nav]: {message}")


def test_a_file_that_cannot_be_read_is_named_with_its_camera(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match=r"^\[camera\.nav\]: calibration: .*none\.yaml: cannot be"):
        placed(tmp_path, calibration="none.yaml")


def test_a_preset_may_have_a_lens_that_a_calibration_replaces(tmp_path: Path) -> None:
    written(tmp_path, OPENCV)
    cam = placed(tmp_path, calibration="calibration.yaml", optics={"veiling_glare": 0.01})
    assert cam.lens.veiling_glare == 0.01
    assert isinstance(cam.lens.distortion, Distortion)
