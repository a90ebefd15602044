"""Preview of raw DN: black level, white balance, demosaic, colour matrix.

DN -> (DN - pedestal) / span -> white balance -> demosaic -> colour matrix -> linear sRGB
"""

from __future__ import annotations

import numpy as np
import scipy

from simgl.arrays import Array, Array32, Image16, Mask
from simgl.camera.detector import Detector, Mosaic

_COLOURS = "RGB"

# Malvar, He and Cutler, "High-quality linear interpolation for demosaicing of Bayer-patterned color
# images" (2004), in eighths. Green at red and blue pixels:
_GREEN = np.array(
    [
        [0, 0, -1, 0, 0],
        [0, 0, 2, 0, 0],
        [-1, 2, 4, 2, -1],
        [0, 0, 2, 0, 0],
        [0, 0, -1, 0, 0],
    ]
)
# Red or blue at green pixels with that colour in the same row (transposed: in the same column):
_IN_ROW = np.array(
    [
        [0, 0, 0.5, 0, 0],
        [0, -1, 0, -1, 0],
        [-1, 4, 5, 4, -1],
        [0, -1, 0, -1, 0],
        [0, 0, 0.5, 0, 0],
    ]
)
# Red at blue pixels and blue at red ones:
_DIAGONAL = np.array(
    [
        [0, 0, -1.5, 0, 0],
        [0, 2, 0, 2, 0],
        [-1.5, 0, 6, 0, -1.5],
        [0, 2, 0, 2, 0],
        [0, 0, -1.5, 0, 0],
    ]
)


def mosaic_masks(order: str, height: int, width: int) -> dict[str, Mask]:
    """(height, width) mask of the pixels under each colour."""
    y, x = np.indices((height, width))
    index = 2 * (y % 2) + x % 2
    letters = np.array(list(order))[index]
    return {letter: letters == letter for letter in _COLOURS}


def demosaic(raw: Array32, order: str) -> Array32:
    """(height, width, 3) linear R, G, B from one value per pixel.

    raw : (height, width)
    order : colours of 2 x 2 pixels row by row from the top left
    """
    raw = raw.astype(np.float32)

    def filtered(kernel: Array) -> Array32:
        # "mirror" does not repeat the edge pixel, so the colours beyond the edge alternate too.
        return scipy.ndimage.convolve(raw, (kernel / 8.0).astype(np.float32), mode="mirror")

    masks = mosaic_masks(order, *raw.shape)
    green, in_row, in_column, diagonal = map(filtered, (_GREEN, _IN_ROW, _IN_ROW.T, _DIAGONAL))
    rgb = np.repeat(raw[..., None], 3, axis=2)
    rgb[..., 1] = np.where(masks["G"], raw, green)
    for channel, colour, opposite in ((0, "R", "B"), (2, "B", "R")):
        measured = masks[colour]
        row_has_colour = masks["G"] & measured.any(axis=1, keepdims=True)
        at_green = np.where(row_has_colour, in_row, in_column)
        interpolated = np.where(masks[opposite], diagonal, at_green)
        rgb[..., channel] = np.where(measured, raw, interpolated)
    return rgb


def colour_matrix(mosaic: Mosaic, white: Array) -> Array:
    """(3, 3) matrix to linear sRGB from white-balanced R, G, B of the pixels.

    white : (4,) photons per band of a white surface

    Filters overlap, and the detector is also sensitive in N. The matrix is exact for surfaces with
    equal reflectance in N and R.
    """
    responses = np.array([mosaic.red, mosaic.green, mosaic.blue]) * white
    balanced = responses / responses.sum(axis=1, keepdims=True)
    of_bands = balanced[:, :3].copy()
    of_bands[:, 0] += balanced[:, 3]
    return np.linalg.inv(of_bands)


def white_balance(mosaic: Mosaic, white: Array) -> Array:
    """(3,) gains of R, G, B pixels that make a white surface neutral; that of green is 1.

    white : (4,) photons per band of a white surface
    """
    responses = np.array([mosaic.red, mosaic.green, mosaic.blue]) @ white
    return responses[1] / responses


def develop(dn: Image16, detector: Detector, white: Array, gain: float = 1.0) -> Array32:
    """(height, width, 3) linear sRGB, 0 at the pedestal and 1 at full scale.

    dn : (height, width)
    white : (4,) photons per band of a surface that is displayed white
    gain : factor of the brightness
    """
    linear = _linear(dn, detector, gain)
    mosaic = detector.mosaic
    if mosaic is None:
        return np.repeat(linear[..., None], 3, axis=2)
    gains = white_balance(mosaic, white)
    for letter, mask in mosaic_masks(mosaic.order, *dn.shape).items():
        linear[mask] *= np.float32(gains[_COLOURS.index(letter)])
    # Saturated pixels have lost their colour: without this limit they would turn magenta.
    linear = np.minimum(linear, np.float32(gains.min() * gain))
    rgb = demosaic(linear, mosaic.order)
    return rgb @ colour_matrix(mosaic, white).T.astype(np.float32)


def develop_squares(dn: Image16, detector: Detector, white: Array, step: int) -> Array32:
    """As ``develop`` of a colour detector, from single squares of 2 x 2 filters.

    step : pixels from one square to the next, at least 2

    returns : (height // step, width // step, 3), at least one row and column
    """
    mosaic = detector.mosaic
    assert mosaic is not None
    # Whole squares that begin on the pattern.
    rows, columns = (np.arange(0, max(n - n % step, 1), step) // 2 * 2 for n in dn.shape)
    gains = white_balance(mosaic, white)
    rgb = np.zeros((len(rows), len(columns), 3), dtype=np.float32)
    for place, letter in enumerate(mosaic.order):
        colour = _COLOURS.index(letter)
        square = dn[place // 2 :, place % 2 :][np.ix_(rows, columns)]
        linear = _linear(square, detector, 1.0) * np.float32(gains[colour])
        rgb[..., colour] += np.minimum(linear, np.float32(gains.min())) / mosaic.order.count(letter)
    return rgb @ colour_matrix(mosaic, white).T.astype(np.float32)


def _linear(dn: Image16, detector: Detector, gain: float) -> Array32:
    span = (detector.largest_dn - detector.pedestal) / gain
    return ((dn - np.float32(detector.pedestal)) / np.float32(span)).astype(np.float32)
