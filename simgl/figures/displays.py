"""What a camera's image can be shown as: 8-bit images with a scale, from its arrays."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image

from simgl.arrays import AnyArray, Array32, Image8, Image16
from simgl.camera.camera import Camera
from simgl.camera.demosaic import develop_squares
from simgl.display_images import (
    WHITE_PHOTONS,
    display_from_dn,
    display_from_linear,
    srgb_from_linear,
)
from simgl.figures.style import LIGHT_MAP, VALUE_MAP
from simgl.images import Capture, saturated
from simgl.physics.spectrum import BANDS

# Decades of radiance that the false colours span, down from the brightest.
_DECADES = 4
# Brighter pixels than this share lie beyond the scale, such as the Sun's disc [%].
_BEYOND = 0.1
# Colours of a scale that the page draws beside the image.
_SCALE_STEPS = 9
_JPEG_QUALITY = 88
# Of linear light, to which thumbnails of colour detectors are rounded.
_STEPS_OF_LIGHT = 4095
# The colour of what has no value, such as depth where no spacecraft is.
_NOTHING = np.array([24, 24, 28], dtype=np.uint8)


@dataclass(frozen=True, kw_only=True)
class Scale:
    """The values that colours stand for.

    low, high : at the ends of the bar, in ``unit``
    logarithmic : or linear
    colours : "#rrggbb" at equal steps from low to high
    """

    quantity: str
    unit: str
    low: float
    high: float
    logarithmic: bool
    colours: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        """For the page."""
        return {
            "quantity": self.quantity,
            "unit": self.unit,
            "low": self.low,
            "high": self.high,
            "logarithmic": self.logarithmic,
            "colours": list(self.colours),
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class CameraImages:
    """The newest arrays of one camera.

    camera : with the settings of this image
    planes : "dn" (height, width) uint16; "electrons" (height, width) float32 mean [e-]; "radiance"
        (height, width, 4) float32, bands R, G, B, N [W m-2 sr-1]; "depth" (height, width) float32
        [m], 0 for none; and each light layer by its name, as radiance. As many as there are
    saturated_share : of the pixels, 0..1; None without DN
    seconds : that rendering took
    """

    camera: Camera
    planes: Mapping[str, AnyArray]
    saturated_share: float | None
    seconds: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Display:
    """An image to look at: (height, width, 3) sRGB; the scale is None for plain images."""

    pixels: Image8
    scale: Scale | None = None

    def jpeg(self) -> bytes:
        """Encoded, without chroma subsampling: false colours would bleed."""
        buffer = io.BytesIO()
        Image.fromarray(self.pixels).save(
            buffer, format="JPEG", quality=_JPEG_QUALITY, subsampling=0
        )
        return buffer.getvalue()


def display(images: CameraImages, shown: str, widest: int) -> Display | None:
    """One plane of a camera to look at; None where the images lack it.

    shown : "dn", "electrons", "radiance", "depth" or the name of a layer
    widest : images with more columns are subsampled
    """
    plane = images.planes.get(shown)
    if plane is None:
        return None
    step = -(-plane.shape[1] // widest)
    if shown == "dn":
        # Subsampled afterwards: a colour filter's pattern needs all pixels.
        return Display(pixels=display_from_dn(plane, images.camera)[::step, ::step])
    plane = plane[::step, ::step]
    if shown == "electrons":
        share = (plane / images.camera.detector.full_well).astype(np.float32)
        scale = Scale(
            quantity="mean signal",
            unit="e-",
            low=0.0,
            high=images.camera.detector.full_well,
            logarithmic=False,
            colours=tuple(_code(c) for c in display_from_linear(_steps())[0]),
        )
        return Display(pixels=display_from_linear(share), scale=scale)
    if shown == "depth":
        return _depth(plane)
    return radiance_display(plane)


def thumbnail_from_dn(dn: Image16, camera: Camera, widest: int) -> Image8:
    """As ``display_from_dn``, with as few pixels as ``widest`` needs, each a pixel of the image.

    Of a colour detector each is a square of 2 x 2 filters, so that nothing is interpolated.

    widest : columns at most
    """
    detector = camera.detector
    step = -(-dn.shape[1] // widest)
    if detector.mosaic is None or detector.bands != BANDS:
        return display_from_dn(dn[::step, ::step], camera)
    linear = develop_squares(dn, detector, WHITE_PHOTONS, max(step, 2))
    # A quarter of the time of the curve itself; a step is less than a code.
    codes = srgb_from_linear(np.linspace(0.0, 1.0, _STEPS_OF_LIGHT + 1, dtype=np.float32))
    steps = np.clip(linear, 0.0, 1.0) * np.float32(_STEPS_OF_LIGHT) + np.float32(0.5)
    return codes.take(steps.astype(np.uint16))


def radiance_display(radiance: Array32) -> Display:
    """Radiance summed over the bands in false colours, four decades up to the brightest.

    The scale ends at a power of ten, so that it stays the same while a scene changes a little.

    radiance : (height, width, 4) [W m-2 sr-1]
    """
    total = radiance.sum(axis=-1, dtype=np.float32)
    lit = total[total > 0.0]
    brightest = float(np.percentile(lit, 100.0 - _BEYOND)) if lit.size else 1.0
    decade = math.ceil(math.log10(brightest) - 1e-6)
    high = 10.0**decade
    low = high / 10.0**_DECADES
    with np.errstate(divide="ignore"):
        share = 1.0 + (np.log10(total) - decade) / _DECADES
    scale = Scale(
        quantity="radiance, all bands",
        unit="W m-2 sr-1",
        low=low,
        high=high,
        logarithmic=True,
        colours=_scale_colours(LIGHT_MAP),
    )
    return Display(pixels=_coloured(share, LIGHT_MAP), scale=scale)


def _depth(depth: Array32) -> Display:
    seen = depth > 0.0
    if not np.any(seen):
        return Display(pixels=np.broadcast_to(_NOTHING, (*depth.shape, 3)).copy())
    low, high = float(depth[seen].min()), float(depth[seen].max())
    # A plate across the boresight has one depth.
    high = high if high > low else low + 1e-3 * abs(low)
    pixels = _coloured((depth - low) / (high - low), VALUE_MAP)
    pixels[~seen] = _NOTHING
    scale = Scale(
        quantity="depth along the boresight",
        unit="m",
        low=low,
        high=high,
        logarithmic=False,
        colours=_scale_colours(VALUE_MAP),
    )
    return Display(pixels=pixels, scale=scale)


def _table(name: str) -> Image8:
    """(256, 3) sRGB of a perceptually even colour map."""
    from matplotlib import colormaps

    return np.round(255.0 * colormaps[name](np.arange(256))[:, :3]).astype(np.uint8)


def _coloured(share: AnyArray, name: str) -> Image8:
    """sRGB of values 0..1; beyond these the ends."""
    index = np.clip(np.nan_to_num(share, neginf=0.0, posinf=1.0), 0.0, 1.0) * 255.0
    return _table(name)[np.round(index).astype(np.uint8)]


def _scale_colours(name: str) -> tuple[str, ...]:
    return tuple(_code(colour) for colour in _coloured(_steps()[0], name))


def _steps() -> Array32:
    return np.linspace(0.0, 1.0, _SCALE_STEPS, dtype=np.float32)[None]


def _code(colour: Image8) -> str:
    return "#" + "".join(f"{int(value):02x}" for value in colour)


def pixel_values(images: CameraImages, column: int, row: int) -> dict[str, Any] | None:
    """What the images hold at a pixel, in their units; None outside the image.

    Each of "radiance_w_m2_sr" (bands R, G, B, N), "electrons", "dn" and "depth_m" is None where
    the images lack it.
    """
    detector = images.camera.detector
    if not (0 <= column < detector.width and 0 <= row < detector.height):
        return None

    def at(plane: str) -> Any:
        array = images.planes.get(plane)
        return None if array is None else array[row, column].tolist()

    return {
        "column": column,
        "row": row,
        "radiance_w_m2_sr": at("radiance"),
        "electrons": at("electrons"),
        "dn": at("dn"),
        "depth_m": at("depth"),
    }


def images_of(capture: Capture, seconds: float) -> CameraImages:
    """The arrays of a capture by their names, as far as there are any.

    seconds : that rendering took
    """
    camera = capture.info.camera
    planes: dict[str, AnyArray] = {}
    share = None
    if capture.digital is not None:
        planes["dn"] = capture.digital.dn
        share = float(np.mean(saturated(capture.digital.dn, camera.detector)))
    if capture.electrons is not None:
        planes["electrons"] = capture.electrons.electrons
    if capture.radiance is not None:
        planes["radiance"] = capture.radiance.radiance
    if capture.truth is not None:
        planes["depth"] = capture.truth.depth
    if capture.layers is not None:
        planes |= {f"light: {name}": layer for name, layer in capture.layers.layers.items()}
    return CameraImages(camera=camera, planes=planes, saturated_share=share, seconds=seconds)
