"""Calibrations of cameras: read from files of OpenCV, ROS and Kalibr, and written as these.

These tools count pixel coordinates from the centre of the first pixel, simgl from its corner: half
a pixel is added or taken off here, and nowhere else.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from simgl.camera.camera import Camera
from simgl.camera.lens_schema import MAX_TILT
from simgl.camera.projections import Distortion, DoubleSphere, Fisheye, Projection
from simgl.config.validation import LARGEST, shown
from simgl.config.yaml_files import at_key, read_yaml
from simgl.errors import ConfigError, did_you_mean

# Order of the coefficients in OpenCV, which has the first 4, 5, 8, 12 or 14 of them.
_OPENCV = (*("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
           *("s1", "s2", "s3", "s4", "tau_x", "tau_y"))  # fmt: skip
_OPENCV_COUNTS = (4, 5, 8, 12, 14)
_FISHEYE = ("k1", "k2", "k3", "k4")
# What OpenCV's samples, ROS and scripts call the entries of a file.
_MATRIX = ("camera_matrix", "Camera_Matrix", "cameraMatrix", "K", "k")
_COEFFICIENTS = ("distortion_coefficients", "Distortion_Coefficients", "distCoeffs", "D", "d")
_WIDTH = ("image_width", "image_Width", "imageWidth", "width")
_HEIGHT = ("image_height", "image_Height", "imageHeight", "height")
# Numbers of coefficients by ROS's model; those of OpenCV's fisheye have several names there.
_PINHOLE_COUNTS = {"plumb_bob": (4, 5), "rational_polynomial": (8, 12, 14)}
_FISHEYE_NAMES = ("equidistant", "fisheye", "kannala_brandt")
_KALIBR_MODELS = {
    "pinhole": ("fu", "fv", "pu", "pv"),
    "omni": ("xi", "fu", "fv", "pu", "pv"),
    "ds": ("xi", "alpha", "fu", "fv", "pu", "pv"),
}


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """Where the pixels of a calibrated camera look.

    focal_length : along the image's rows and columns [px]
    principal_point : column and row, (0.5, 0.5) at the centre of the first pixel [px]
    skew : [px]
    distortion : None for a pinhole
    size : width and height [px]; None where the file does not tell
    """

    focal_length: tuple[float, float]
    principal_point: tuple[float, float]
    skew: float
    distortion: Projection | None
    size: tuple[int, int] | None


def read_calibration(path: Path, camera: str | None = None) -> Calibration:
    """The calibration of one camera in a file of OpenCV, ROS or Kalibr.

    camera : of a Kalibr file with several, such as ``cam1``

    Raises AssetError if the file cannot be read; ConfigError, which names file, key and value, for
    what is missing or impossible in it.
    """
    document, where = read_yaml(path), str(path)
    chain = {name: one for name, one in document.items() if _of_kalibr(one)}
    if _of_kalibr(document):
        chain = {"": document}
    if chain:
        return _from_kalibr(where, chain, camera)
    if camera is not None:
        problem = f"holds one camera, not several of Kalibr; leave out camera = {shown(camera)}"
        raise ConfigError(where, "", problem)
    return _from_opencv(_Entries(where, "", document))


def _of_kalibr(value: object) -> bool:
    return isinstance(value, dict) and "camera_model" in value


@dataclass(frozen=True)
class _Entries:
    """A table of a file: ``key`` is its place, for errors."""

    where: str
    key: str
    table: Mapping[str, Any]

    def fail(self, name: str, problem: str) -> NoReturn:
        raise ConfigError(self.where, at_key(self.key, name), problem)

    def named(self, names: Sequence[str]) -> str:
        """Which of some names the table has; ConfigError for none and for several."""
        given = [name for name in names if name in self.table]
        if not given:
            self.fail(names[0], "is missing")
        if len(given) > 1:
            self.fail(given[1], f"contradicts {given[0]}; give one of them")
        return given[0]

    def text(self, name: str) -> str:
        value = self.table.get(name)
        if value is None:
            self.fail(name, "is missing")
        if not isinstance(value, str):
            self.fail(name, f"must be a text, got {shown(value)}")
        return value

    def number(self, name: str, value: object) -> float:
        try:
            number = float(value) if isinstance(value, str) else math.nan
        except ValueError:
            number = math.nan
        if not abs(number) <= LARGEST:
            self.fail(name, f"must hold finite numbers, got {shown(value)}")
        return number

    def numbers(self, name: str) -> tuple[float, ...]:
        """The numbers of a list, or of a matrix with its ``data``."""
        value = self.table.get(name)
        if isinstance(value, dict):
            return _Entries(self.where, at_key(self.key, name), value).numbers("data")
        if value is None:
            self.fail(name, "is missing")
        if not isinstance(value, list):
            self.fail(name, f"must be a list of numbers, got {shown(value)}")
        if value and all(isinstance(row, list) for row in value):
            value = [one for row in value for one in row]
        return tuple(self.number(name, one) for one in value)

    def size(self, names: tuple[str, str], values: Sequence[float]) -> tuple[int, int]:
        for name, value in zip(names, values, strict=True):
            if value != int(value) or value < 1:
                self.fail(name, f"must be a whole number of pixels, got {value:g}")
        return int(values[0]), int(values[1])


def _from_opencv(entries: _Entries) -> Calibration:
    table = entries.table
    if not any(name in table for name in _MATRIX):
        problem = (
            "holds no calibration; camera_matrix (OpenCV, ROS), or cam0 with camera_model "
            "(Kalibr) is needed"
        )
        raise ConfigError(entries.where, entries.key, problem)
    name = entries.named(_MATRIX)
    matrix = entries.numbers(name)
    if len(matrix) != 9:
        entries.fail(name, f"must hold 9 numbers, got {len(matrix)}")
    fx, skew, cx, zero, fy, cy, *last = matrix
    if zero != 0.0 or last != [0.0, 0.0, 1.0]:
        entries.fail(name, f"must be [fx, skew, cx, 0, fy, cy, 0, 0, 1], got {shown([*matrix])}")
    size = None
    if any(name in table for name in (*_WIDTH, *_HEIGHT)):
        names = entries.named(_WIDTH), entries.named(_HEIGHT)
        size = entries.size(names, [entries.number(name, table[name]) for name in names])
    return Calibration(
        focal_length=_positive(entries, name, fx, fy),
        principal_point=(cx + 0.5, cy + 0.5),
        skew=skew,
        distortion=_opencv_distortion(entries),
        size=size,
    )


def _opencv_distortion(entries: _Entries) -> Projection | None:
    table = entries.table
    fisheye = False
    counts: Sequence[int] = _OPENCV_COUNTS
    if "fisheye_model" in table:
        fisheye = entries.number("fisheye_model", table["fisheye_model"]) != 0.0
    if "distortion_model" in table:
        model = entries.text("distortion_model")
        fisheye = model in _FISHEYE_NAMES
        if not fisheye and model not in ("", "none", *_PINHOLE_COUNTS):
            known = did_you_mean(model, [*_PINHOLE_COUNTS, *_FISHEYE_NAMES, "none"])
            entries.fail("distortion_model", f"is not read: {shown(model)}; {known}")
        counts = _PINHOLE_COUNTS.get(model, counts)
    if not any(name in table for name in _COEFFICIENTS):
        if fisheye:
            entries.fail(_COEFFICIENTS[0], "is missing")
        return None
    name = entries.named(_COEFFICIENTS)
    values = entries.numbers(name)
    if fisheye:
        if len(values) != len(_FISHEYE):
            entries.fail(name, f"must hold 4 numbers of a fisheye lens, got {len(values)}")
        return Fisheye(**dict(zip(_FISHEYE, values, strict=True)))
    if values and len(values) not in counts:
        allowed = " or ".join(map(str, counts))
        entries.fail(name, f"must hold {allowed} numbers, got {len(values)}")
    tilts = values[-2:] if len(values) == len(_OPENCV) else ()
    if not all(abs(tilt) <= MAX_TILT for tilt in tilts):
        entries.fail(name, f"must end with tilts within +-{MAX_TILT:g} rad, got {shown([*tilts])}")
    return _pinhole(dict(zip(_OPENCV, values, strict=False)))


def _pinhole(values: Mapping[str, float]) -> Distortion | None:
    distortion = Distortion(**values)
    return None if distortion == Distortion() else distortion


def _positive(entries: _Entries, name: str, fx: float, fy: float) -> tuple[float, float]:
    if not (fx > 0.0 and fy > 0.0):
        entries.fail(name, f"must hold positive focal lengths, got {fx:g} and {fy:g}")
    return fx, fy


def _from_kalibr(where: str, chain: Mapping[str, Any], camera: str | None) -> Calibration:
    if camera is None:
        if len(chain) > 1:
            problem = (
                f"holds {', '.join(chain)}; calibration = {{ file, camera }} names one of them"
            )
            raise ConfigError(where, "", problem)
        camera = next(iter(chain))
    if camera not in chain:
        raise ConfigError(
            where, "", f"has no camera {shown(camera)}; {did_you_mean(camera, chain)}"
        )
    entries = _Entries(where, camera, chain[camera])
    model = entries.text("camera_model")
    if model not in _KALIBR_MODELS:
        known = did_you_mean(model, _KALIBR_MODELS)
        entries.fail("camera_model", f"is not read: {shown(model)}; {known}")
    names = _KALIBR_MODELS[model]
    values = entries.numbers("intrinsics")
    if len(values) != len(names):
        entries.fail("intrinsics", f"must hold {', '.join(names)}, got {len(values)} numbers")
    *special, fx, fy, cx, cy = values
    distortion = _kalibr_distortion(entries)
    if model != "pinhole" and distortion is not None:
        problem = f'must be "none" with camera_model: {model}, got {shown(_kalibr_model(entries))}'
        entries.fail("distortion_model", problem)
    if model == "ds":
        distortion = DoubleSphere(xi=special[0], alpha=special[1])
    elif model == "omni":
        # One sphere is a double sphere without the second one's offset.
        distortion = DoubleSphere(xi=0.0, alpha=special[0] / (1.0 + special[0]))
        fx, fy = fx / (1.0 + special[0]), fy / (1.0 + special[0])
    if isinstance(distortion, DoubleSphere) and not (
        distortion.xi > -1.0 and 0.0 <= distortion.alpha <= 1.0
    ):
        problem = f"must hold xi above -1 and alpha in 0..1, got {shown([*special])}"
        entries.fail("intrinsics", problem)
    resolution = entries.numbers("resolution")
    if len(resolution) != 2:
        entries.fail("resolution", f"must hold width and height, got {len(resolution)} numbers")
    return Calibration(
        focal_length=_positive(entries, "intrinsics", fx, fy),
        principal_point=(cx + 0.5, cy + 0.5),
        skew=0.0,
        distortion=distortion,
        size=entries.size(("resolution", "resolution"), resolution),
    )


def _kalibr_model(entries: _Entries) -> str:
    return entries.text("distortion_model") if "distortion_model" in entries.table else "none"


def _kalibr_distortion(entries: _Entries) -> Projection | None:
    model = _kalibr_model(entries)
    if model == "none":
        return None
    if model not in ("radtan", "equidistant"):
        known = did_you_mean(model, ["radtan", "equidistant", "none"])
        entries.fail("distortion_model", f"is not read: {shown(model)}; {known}")
    values = entries.numbers("distortion_coeffs")
    if len(values) != 4:
        entries.fail("distortion_coeffs", f"must hold 4 numbers, got {len(values)}")
    if model == "equidistant":
        return Fisheye(**dict(zip(_FISHEYE, values, strict=True)))
    return _pinhole(dict(zip(_OPENCV, values, strict=False)))


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
    fisheye, values = _opencv_values(name, its, "OpenCV", _OPENCV_COUNTS)
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
    counts = _OPENCV_COUNTS[1 if its.distortion is None else 2 :]
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
    values = [its_values[key] for key in _OPENCV]
    used = max((i + 1 for i, value in enumerate(values) if value != 0.0), default=0)
    if used > max(counts):
        _cannot(name, tool, _OPENCV[used - 1])
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
