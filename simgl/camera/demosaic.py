"""From raw DN to a picture for people: black level, white balance, demosaic, colour matrix.

    DN -> (DN - pedestal) / span -> white balance -> demosaic -> colour matrix -> linear sRGB

The raw DN are the product; this is a view of them.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import convolve

from simgl.arrays import Array, Array32, Image16, Mask
from simgl.camera.detector import Detector, Mosaic

# The colours of the square by pixel, for each order: row 0 left, right, row 1 left, right.
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
# Red or blue at green pixels that have it beside them in the row (transposed: in the column):
_BESIDE = np.array(
    [
        [0, 0, 0.5, 0, 0],
        [0, -1, 0, -1, 0],
        [-1, 4, 5, 4, -1],
        [0, -1, 0, -1, 0],
        [0, 0, 0.5, 0, 0],
    ]
)
# Red at blue pixels and blue at red ones:
_ACROSS = np.array(
    [
        [0, 0, -1.5, 0, 0],
        [0, 2, 0, 2, 0],
        [-1.5, 0, 6, 0, -1.5],
        [0, 2, 0, 2, 0],
        [0, 0, -1.5, 0, 0],
    ]
)


def mosaic_masks(order: str, height: int, width: int) -> dict[str, Mask]:
    """(height, width) pixels under each colour."""
    y, x = np.indices((height, width))
    index = 2 * (y % 2) + x % 2
    letters = np.array(list(order))[index]
    return {letter: letters == letter for letter in _COLOURS}


def demosaic(raw: Array32, order: str) -> Array32:
    """(height, width, 3) linear red, green and blue from one value a pixel.

    order : colours of 2 x 2 pixels row by row from the top left
    """
    raw = raw.astype(np.float32)

    def filtered(kernel: Array) -> Array32:
        # "mirror" repeats no edge pixel: neighbours beyond the edge keep their colours.
        return convolve(raw, (kernel / 8.0).astype(np.float32), mode="mirror")

    masks = mosaic_masks(order, *raw.shape)
    at_green, row, column, across = map(filtered, (_GREEN, _BESIDE, _BESIDE.T, _ACROSS))
    rgb = np.repeat(raw[..., None], 3, axis=2)
    rgb[..., 1] = np.where(masks["G"], raw, at_green)
    for channel, own, other in ((0, "R", "B"), (2, "B", "R")):
        has = masks[own]
        beside = masks["G"] & has.any(axis=1, keepdims=True)
        value = np.where(beside, row, column)
        rgb[..., channel] = np.where(has, raw, np.where(masks[other], across, value))
    return rgb


def colour_matrix(mosaic: Mosaic, white: Array) -> Array:
    """(3, 3) linear sRGB from white-balanced red, green and blue of the pixels.

    white : (4,) photons per band of a white surface

    A picture shows the bands R, G and B; the detector sees N too, and each colour leaks into its
    neighbours. The matrix is exact for surfaces that reflect as much in N as in R.
    """
    responses = np.array([mosaic.red, mosaic.green, mosaic.blue]) * white
    balanced = responses / responses.sum(axis=1, keepdims=True)
    of_bands = balanced[:, :3].copy()
    of_bands[:, 0] += balanced[:, 3]
    return np.linalg.inv(of_bands)


def white_balance(mosaic: Mosaic, white: Array) -> Array:
    """(3,) gains of red, green and blue pixels that make a white surface neutral, green's being 1.

    white : (4,) photons per band of a white surface
    """
    responses = np.array([mosaic.red, mosaic.green, mosaic.blue]) @ white
    return responses[1] / responses


def develop(dn: Image16, detector: Detector, white: Array, gain: float = 1.0) -> Array32:
    """(height, width, 3) linear sRGB, 0 at the pedestal and 1 at full scale.

    white : (4,) photons per band of a surface that shall look white
    gain : brightens the picture
    """
    span = (detector.largest_dn - detector.pedestal) / gain
    linear = ((dn - np.float32(detector.pedestal)) / np.float32(span)).astype(np.float32)
    mosaic = detector.mosaic
    if mosaic is None:
        return np.repeat(linear[..., None], 3, axis=2)
    gains = white_balance(mosaic, white)
    for letter, mask in mosaic_masks(mosaic.order, *dn.shape).items():
        linear[mask] *= np.float32(gains[_COLOURS.index(letter)])
    # A saturated pixel has lost its colour: without this cut, balanced highlights turn magenta.
    linear = np.minimum(linear, np.float32(gains.min() * gain))
    rgb = demosaic(linear, mosaic.order)
    return rgb @ colour_matrix(mosaic, white).T.astype(np.float32)
