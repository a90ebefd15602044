"""Calibrations of cameras, written as files of OpenCV, ROS and Kalibr."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import NoReturn

from simgl.camera.calibration import OPENCV, OPENCV_COUNTS, Calibration
from simgl.camera.camera import Camera
from simgl.camera.projections import Distortion, DoubleSphere, Fisheye
from simgl.config.validation import shown
from simgl.errors import ConfigError


def calibration_of(camera: Camera) -> Calibration:
    """The calibration that a camera has."""
    k, d = camera.intrinsics.tolist(), camera.detector
    return Calibration(
        focal_length=(k[0][0], k[1][1]),
        principal_point=(k[0][2], k[1][2]),
        skew=k[0][1],
        distortion=camera.lens.distortion,
        size=(d.width, d.height),
    )


def calibration_text(camera: Camera, form: str) -> str:
    """A camera's calibration as a file, which ``read_calibration`` reads again.

    form : a key of ``FORMATS``

    Raises ConfigError for a lens that the format cannot hold.
    """
    return FORMATS[form](camera.name, calibration_of(camera))


def _opencv_text(name: str, its: Calibration) -> str:
    fisheye, values = _opencv_values(name, its, "OpenCV", OPENCV_COUNTS)
    width, height = _size(its)
    lines = [
        "%YAML:1.0",
        "---",
        f"image_width: {width}",
        f"image_height: {height}",
        *_opencv_matrix("camera_matrix", 3, 3, _matrix(its)),
        f"fisheye_model: {int(fisheye)}",
        *_opencv_matrix("distortion_coefficients", len(values), 1, values),
    ]
    return _lines(lines)


def _opencv_matrix(name: str, rows: int, columns: int, values: Sequence[float]) -> list[str]:
    return [
        f"{name}: !!opencv-matrix",
        f"   rows: {rows}",
        f"   cols: {columns}",
        "   dt: d",
        f"   data: {_list(values)}",
    ]


def _ros_text(name: str, its: Calibration) -> str:
    fisheye, values = _opencv_values(name, its, "ROS", (5, 8))
    model = "equidistant" if fisheye else "plumb_bob" if len(values) == 5 else "rational_polynomial"
    width, height = _size(its)
    (fx, fy), (cx, cy) = its.focal_length, its.principal_point
    matrices = {
        "camera_matrix": (3, 3, _matrix(its)),
        "distortion_coefficients": (1, len(values), values),
        "rectification_matrix": (3, 3, (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)),
        "projection_matrix": (
            *(3, 4),
            (fx, its.skew, cx - 0.5, 0.0, 0.0, fy, cy - 0.5, 0.0, 0.0, 0.0, 1.0, 0.0),
        ),
    }
    lines = [f"image_width: {width}", f"image_height: {height}", f"camera_name: {_quoted(name)}"]
    for key, (rows, columns, data) in matrices.items():
        if key == "distortion_coefficients":
            lines.append(f"distortion_model: {model}")
        lines += [f"{key}:", f"  rows: {rows}", f"  cols: {columns}", f"  data: {_list(data)}"]
    return _lines(lines)


def _kalibr_text(name: str, its: Calibration) -> str:
    (fx, fy), (cx, cy), distortion = its.focal_length, its.principal_point, its.distortion
    if its.skew != 0.0:
        _cannot(name, "Kalibr", "skew")
    intrinsics, camera_model, model = [fx, fy, cx - 0.5, cy - 0.5], "pinhole", "radtan"
    values = [0.0] * 4
    if isinstance(distortion, DoubleSphere):
        intrinsics, camera_model = [distortion.xi, distortion.alpha, *intrinsics], "ds"
        model, values = "none", []
    elif distortion is not None:
        fisheye, coefficients = _opencv_values(name, its, "Kalibr", (4,))
        model, values = ("equidistant" if fisheye else "radtan"), list(coefficients)
    width, height = _size(its)
    lines = [
        "cam0:",
        "  cam_overlaps: []",
        f"  camera_model: {camera_model}",
        f"  distortion_coeffs: {_list(values)}",
        f"  distortion_model: {model}",
        f"  intrinsics: {_list(intrinsics)}",
        f"  resolution: [{width}, {height}]",
        f"  rostopic: {_quoted(f'/{name}/image_raw')}",
    ]
    return _lines(lines)


# Texts of a calibration by the tool that reads them.
FORMATS: dict[str, Callable[[str, Calibration], str]] = {
    "opencv": _opencv_text,
    "kalibr": _kalibr_text,
    "ros": _ros_text,
}


def opencv_coefficients(name: str, its: Calibration, tool: str) -> tuple[float, ...]:
    """A pinhole's 5 coefficients in OpenCV's order if they are 0, else 8, 12 or 14.

    Raises ConfigError, which names the camera and the tool, for another lens.
    """
    if isinstance(its.distortion, Fisheye):
        _cannot(name, tool, "fisheye")
    counts = OPENCV_COUNTS[1 if its.distortion is None else 2 :]
    return _opencv_values(name, its, tool, counts)[1]


def _opencv_values(
    name: str, its: Calibration, tool: str, counts: Sequence[int]
) -> tuple[bool, tuple[float, ...]]:
    """Whether a lens is a fisheye, and the fewest coefficients that hold it in OpenCV's order."""
    distortion = its.distortion
    if isinstance(distortion, DoubleSphere):
        _cannot(name, tool, "double_sphere")
    if isinstance(distortion, Fisheye):
        return True, dataclasses.astuple(distortion)
    pinhole = Distortion() if distortion is None else distortion
    assert isinstance(pinhole, Distortion)
    its_values = dataclasses.asdict(pinhole)
    values = [its_values[key] for key in OPENCV]
    used = max((i + 1 for i, value in enumerate(values) if value != 0.0), default=0)
    if used > max(counts):
        _cannot(name, tool, OPENCV[used - 1])
    return False, tuple(values[: min(count for count in counts if count >= used)])


def _cannot(name: str, tool: str, what: str) -> NoReturn:
    raise ConfigError(f"[camera.{name}]", "", f"has {what}, which files of {tool} cannot hold")


def _size(its: Calibration) -> tuple[int, int]:
    assert its.size is not None
    return its.size


def _matrix(its: Calibration) -> tuple[float, ...]:
    (fx, fy), (cx, cy) = its.focal_length, its.principal_point
    return fx, its.skew, cx - 0.5, 0.0, fy, cy - 0.5, 0.0, 0.0, 1.0


def _list(values: Sequence[float]) -> str:
    """Numbers in the fewest digits that read back to the same float64, with the point of YAML."""
    return f"[{', '.join(_number(value) for value in values)}]"


def _number(value: float) -> str:
    text = repr(float(value))
    mantissa, e, exponent = text.partition("e")
    return f"{mantissa}{'' if '.' in mantissa else '.0'}{e}{exponent}"


def _quoted(text: str) -> str:
    return shown(text)


def _lines(lines: Sequence[str]) -> str:
    return "\n".join([*lines, ""])
