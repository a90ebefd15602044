"""Calibrations of cameras, read from files of OpenCV, ROS and Kalibr.

These tools count pixel coordinates from the centre of the first pixel, simgl from its corner: half
a pixel is added here, taken off in ``calibration_text``, and nowhere else.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NoReturn

from simgl.camera.lens_schema import MAX_TILT
from simgl.camera.projections import Distortion, DoubleSphere, Fisheye, Projection
from simgl.config.validation import LARGEST, shown
from simgl.config.yaml_files import at_key, read_yaml
from simgl.errors import ConfigError, did_you_mean

# Order of the coefficients in OpenCV, which has the first 4, 5, 8, 12 or 14 of them.
OPENCV = (*("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
           *("s1", "s2", "s3", "s4", "tau_x", "tau_y"))  # fmt: skip
OPENCV_COUNTS = (4, 5, 8, 12, 14)
_FISHEYE = ("k1", "k2", "k3", "k4")
# What OpenCV's samples, ROS and scripts call the entries of a file.
_MATRIX = ("camera_matrix", "Camera_Matrix", "cameraMatrix", "K", "k")
_COEFFICIENTS = (
    *("distortion_coefficients", "Distortion_Coefficients", "distCoeffs", "dist_coeffs"),
    *("dist_coeff", "D", "d"),
)
# Entries besides that begin like coefficients.
_NO_COEFFICIENTS = ("distortion_model",)
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
# The second ones are those of the sensor files of EuRoC, which are Kalibr's otherwise.
_KALIBR_COEFFICIENTS = ("distortion_coeffs", "distortion_coefficients")
_KALIBR_RADTAN = ("radtan", "radial-tangential")


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """Where the pixels of a calibrated camera look.

    focal_length : along the image's rows and columns [px]
    principal_point : column and row, (0.5, 0.5) at the centre of the first pixel [px]
    skew : [px]
    distortion : None for a pinhole
    size : width and height [px]; None where the file does not tell
    binning : pixels of the detector along a row and a column that make one of the image
    """

    focal_length: tuple[float, float]
    principal_point: tuple[float, float]
    skew: float
    distortion: Projection | None
    size: tuple[int, int] | None
    binning: tuple[int, int] = (1, 1)


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

    def count(self, name: str, lowest: int) -> int:
        """A whole number; the lowest where none or a smaller one is given."""
        value = self.number(name, self.table.get(name, "0"))
        if value != int(value) or value < 0.0:
            self.fail(name, f"must be a whole number of pixels, got {value:g}")
        return max(int(value), lowest)

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
        entries.fail(name, f"must be [fx, skew, cx, 0, fy, cy, 0, 0, 1], got {_listed(matrix)}")
    size = None
    if any(name in table for name in (*_WIDTH, *_HEIGHT)):
        names = entries.named(_WIDTH), entries.named(_HEIGHT)
        size = entries.size(names, [entries.number(name, table[name]) for name in names])
    its = Calibration(
        focal_length=_positive(entries, name, fx, fy),
        principal_point=(cx + 0.5, cy + 0.5),
        skew=skew,
        distortion=_opencv_distortion(entries),
        size=size,
    )
    return _read_out(entries, its)


def _read_out(entries: _Entries, its: Calibration) -> Calibration:
    """What a camera of ROS reads out of the pixels that were calibrated: a window, binned.

    As sensor_msgs/CameraInfo says, zeros stand for all pixels and for no binning, and the window
    counts pixels before they are binned.
    """
    across, down = binning = entries.count("binning_x", 1), entries.count("binning_y", 1)
    roi = entries.table.get("roi", {})
    if not isinstance(roi, dict):
        entries.fail("roi", f"must be a table, got {shown(roi)}")
    window = _Entries(entries.where, at_key(entries.key, "roi"), roi)
    left, top = window.count("x_offset", 0), window.count("y_offset", 0)
    width, height = window.count("width", 0), window.count("height", 0)
    size = its.size
    if size is not None:
        right, bottom = left + (width or size[0]), top + (height or size[1])
        if right > size[0] or bottom > size[1]:
            problem = (
                f"ends at {right} x {bottom}, beyond the image of {size[0]} x {size[1]} pixels"
            )
            entries.fail("roi", problem)
    if width and height:
        size = width, height
    if size is not None:
        binned = size[0] // across, size[1] // down
        size = entries.size(("binning_x", "binning_y"), binned)
    (fx, fy), (cx, cy) = its.focal_length, its.principal_point
    return replace(
        its,
        focal_length=(fx / across, fy / down),
        principal_point=((cx - left) / across, (cy - top) / down),
        skew=its.skew / across,
        size=size,
        binning=binning,
    )


def _opencv_distortion(entries: _Entries) -> Projection | None:
    table = entries.table
    fisheye = False
    counts: Sequence[int] = OPENCV_COUNTS
    if "fisheye_model" in table:
        fisheye = entries.number("fisheye_model", table["fisheye_model"]) != 0.0
    if "distortion_model" in table:
        model = entries.text("distortion_model")
        if fisheye and model not in _FISHEYE_NAMES:
            entries.fail("distortion_model", f"contradicts fisheye_model: got {shown(model)}")
        fisheye = model in _FISHEYE_NAMES
        if not fisheye and model not in ("", "none", *_PINHOLE_COUNTS):
            known = did_you_mean(model, [*_PINHOLE_COUNTS, *_FISHEYE_NAMES, "none"])
            entries.fail("distortion_model", f"is not read: {shown(model)}; {known}")
        counts = _PINHOLE_COUNTS.get(model, counts)
    if not any(name in table for name in _COEFFICIENTS):
        _refuse_unread(entries)
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
    tilts = values[-2:] if len(values) == len(OPENCV) else ()
    if not all(abs(tilt) <= MAX_TILT for tilt in tilts):
        entries.fail(name, f"must end with tilts within +-{MAX_TILT:g} rad, got {shown([*tilts])}")
    return _pinhole(dict(zip(OPENCV, values, strict=False)))


def _refuse_unread(entries: _Entries) -> None:
    """A lens without coefficients is one that the file says nothing of, under any name."""
    for name in entries.table:
        if str(name).lower().startswith("dist") and name not in _NO_COEFFICIENTS:
            entries.fail(str(name), f"is not read; {did_you_mean(str(name), _COEFFICIENTS)}")


def _listed(values: Sequence[float]) -> str:
    return f"[{', '.join(f'{value:g}' for value in values)}]"


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
    if special:
        distortion, longer = _spheres(entries, special)
        fx, fy = fx / longer, fy / longer
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


def _spheres(entries: _Entries, special: Sequence[float]) -> tuple[DoubleSphere, float]:
    """The lens of one sphere, by xi, or two, by xi and alpha, and the divisor of its focal lengths.

    One sphere is a double sphere without the second one's offset.
    """
    xi, *alpha = special
    if alpha and not (xi > -1.0 and 0.0 <= alpha[0] <= 1.0):
        problem = f"must hold xi above -1 and alpha in 0..1, got {shown([*special])}"
        entries.fail("intrinsics", problem)
    if not alpha and not xi >= 0.0:
        entries.fail("intrinsics", f"must hold xi of at least 0, got {xi:g}")
    if alpha:
        return DoubleSphere(xi=xi, alpha=alpha[0]), 1.0
    return DoubleSphere(xi=0.0, alpha=xi / (1.0 + xi)), 1.0 + xi


def _kalibr_model(entries: _Entries) -> str:
    return entries.text("distortion_model") if "distortion_model" in entries.table else "none"


def _kalibr_distortion(entries: _Entries) -> Projection | None:
    model = _kalibr_model(entries)
    names = _KALIBR_COEFFICIENTS
    if model == "none":
        given = [name for name in names if entries.table.get(name)]
        if given and any(entries.numbers(given[0])):
            entries.fail(given[0], "requires a distortion_model: radtan or equidistant")
        return None
    if model not in (*_KALIBR_RADTAN, "equidistant"):
        known = did_you_mean(model, [*_KALIBR_RADTAN, "equidistant", "none"])
        entries.fail("distortion_model", f"is not read: {shown(model)}; {known}")
    name = entries.named(names)
    values = entries.numbers(name)
    if len(values) != 4:
        entries.fail(name, f"must hold 4 numbers, got {len(values)}")
    if model == "equidistant":
        return Fisheye(**dict(zip(_FISHEYE, values, strict=True)))
    return _pinhole(dict(zip(OPENCV, values, strict=False)))
