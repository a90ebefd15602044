"""Far features: the bright thing before a dark sky, and its two wing tips.

Line of sight and range follow from the tips, whose distance is the target's apparent size. Nothing
here knows the truth: it uses the pixels and a drawing of the wing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from examples.closed_loop.camera import Pinhole
from simgl.arrays import Array, Image16, Mask

BORDER = 16  # [px] the frame around the image that serves as dark sample
DETECTION_SIGMA = 6.0  # 360 000 pixels of normal noise exceed it 4e-4 times per image
SPECK = 0.01  # of the largest region; a smaller one is no part of the target
BRIGHT_PERCENT = 90.0  # what is brighter are glints
SMALLEST_SPAN = 8  # [px] a shorter target has no wing to measure


@dataclass(frozen=True, kw_only=True)
class TipPattern:
    """The outer end of a wing as drawn: strips (begin, end) inwards from the tip [m].

    span : from tip to tip [m]
    bars : of the panel's frame
    cells : solar cells
    length : how much of the wing is looked at [m]
    """

    span: float
    bars: tuple[tuple[float, float], ...]
    cells: tuple[tuple[float, float], ...]
    length: float


# Panels 1.0367 m wide with frames of 0.02 m, 0.05 m apart.
SPACE_RIDER_WING = TipPattern(
    span=10.0,
    bars=((0.0, 0.02), (1.0167, 1.0367), (1.0867, 1.1067)),
    cells=((0.02, 1.0167), (1.1067, 2.0)),
    length=1.6,
)


@dataclass(frozen=True, kw_only=True)
class Silhouette:
    """The target in the image [px]; points are (u, v).

    box : left, top, right, bottom
    level : of its brighter parts above the dark [DN]
    left_tip, right_tip : middle of the outermost edges; None where the image border cuts the target
    """

    box: tuple[int, int, int, int]
    area: int
    level: float
    left_tip: tuple[float, float] | None
    right_tip: tuple[float, float] | None


def find_target(dn: Image16, camera: Pinhole, pattern: TipPattern) -> Silhouette | None:
    """The largest bright region of the image with its neighbours, or None in an empty one."""
    signal = dn.astype(np.float64) - camera.pedestal_dn
    border = np.concatenate(
        [signal[:BORDER].ravel(), signal[-BORDER:].ravel(),
         signal[:, :BORDER].ravel(), signal[:, -BORDER:].ravel()]
    )  # fmt: skip
    dark = float(np.median(border))
    # Median absolute deviation to sigma of a normal; rounding alone gives 1/sqrt(12) DN.
    noise = np.hypot(1.4826 * float(np.median(np.abs(border - dark))), 12.0**-0.5)
    signal -= dark
    target = _largest_group(signal > DETECTION_SIGMA * noise)
    if target is None:
        return None
    rows, columns = np.flatnonzero(target.any(axis=1)), np.flatnonzero(target.any(axis=0))
    left, right = int(columns[0]), int(columns[-1]) + 1
    top, bottom = int(rows[0]), int(rows[-1]) + 1
    cut = left == 0 or top == 0 or right == camera.width or bottom == camera.height
    tips = None
    if not cut and right - left >= SMALLEST_SPAN:
        tips = _tips(signal, target, left, right, pattern)
    return Silhouette(
        box=(left, top, right, bottom),
        area=int(target.sum()),
        level=float(np.percentile(signal[target], BRIGHT_PERCENT)),
        left_tip=tips[0] if tips else None,
        right_tip=tips[1] if tips else None,
    )


def _largest_group(bright: Mask) -> Mask | None:
    """The largest connected region and, step by step, those beside it.

    Shadow and dark paint cut a spacecraft into pieces; a piece belongs to it where the gap is less
    than a quarter of what is already found. Specks, such as stars, are left out.
    """
    regions, count = ndimage.label(bright, structure=np.ones((3, 3)))
    if count == 0:
        return None
    areas = np.bincount(regions.ravel(), minlength=count + 1)[1:]
    boxes = np.array([[c.start, r.start, c.stop, r.stop] for r, c in ndimage.find_objects(regions)])
    member = areas == areas.max()
    able = areas >= SPECK * areas.max()
    while True:
        low, high = boxes[member, :2].min(axis=0), boxes[member, 2:].max(axis=0)
        reach = 0.25 * float((high - low).max())
        adjacent = np.all((boxes[:, :2] < high + reach) & (boxes[:, 2:] > low - reach), axis=1)
        grown = member | (able & adjacent)
        if np.array_equal(grown, member):
            return np.concatenate([[False], member])[regions]
        member = grown


def _tips(
    signal: Array, target: Mask, left: int, right: int, pattern: TipPattern
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Both wing tips (u, v) of a target that covers the columns ``left`` up to ``right`` [px]."""
    width = signal.shape[1]
    scale = (right - left) / pattern.span
    u, v = _tip(signal, target, left, scale, pattern)
    mirrored, w = _tip(signal[:, ::-1], target[:, ::-1], width - right, scale, pattern)
    return (u, v), (width - mirrored, w)


def _tip(
    signal: Array, target: Mask, left: int, scale: float, pattern: TipPattern
) -> tuple[float, float]:
    """Middle (u, v) of the wing's outer edge near column ``left``; ``scale`` in px per metre."""
    length = max(int(pattern.length * scale), 4)
    inside = slice(left + 1, left + length)
    rows = np.flatnonzero(target[:, inside].any(axis=1))
    top, bottom = max(int(rows[0]) - 3, 0), int(rows[-1]) + 4
    down = signal[top:bottom, inside].sum(axis=1)
    upper, lower = top + edge(down), bottom - edge(down[::-1])
    first = max(left - 3, 0)
    along = signal[top:bottom, first : left + length].mean(axis=0)
    return first + fit_tip(along, left - first, scale, pattern), 0.5 * (upper + lower)


def edge(profile: Array) -> float:
    """Where a profile that starts dark becomes bright [px from its start], to a part of a pixel.

    The light before the first bright sample, divided by the level inside, is the length that it
    covers: exact for a sharp edge anywhere within a pixel, unmoved by a symmetric blur. Light above
    the level inside, of a bright rim, is cut off.
    """
    third = len(profile) // 3
    level = float(np.median(profile[third:-third]))
    covered = np.clip(profile / level, 0.0, 1.0)
    first = int(np.argmax(covered > 0.5))
    bright = min(first + 2, len(profile) - 1)
    return bright - float(covered[:bright].sum())


def fit_tip(profile: Array, rough: float, scale: float, pattern: TipPattern) -> float:
    """Where along a profile [px from its start] the wing begins, by least squares.

    The drawing says where bars and cells lie; each kind has one unknown brightness.
    rough : the place to a pixel or two
    scale : pixels per metre
    """
    tips = rough + np.arange(-2.0, 2.0, 0.01)
    pixels = np.arange(len(profile), dtype=np.float64)

    def coverage(strips: tuple[tuple[float, float], ...]) -> Array:
        """(tip, pixel) share of each pixel that the strips cover."""
        cover = np.zeros((len(tips), len(pixels)))
        for begin, end in strips:
            low = np.maximum(tips[:, None] + begin * scale, pixels)
            high = np.minimum(tips[:, None] + end * scale, pixels + 1.0)
            cover += np.maximum(high - low, 0.0)
        return cover

    kinds = np.stack([coverage(pattern.bars), coverage(pattern.cells)], axis=-1)
    # For each candidate: the two brightnesses by the normal equations, then what they explain.
    normal = kinds.swapaxes(1, 2) @ kinds + 1e-9 * np.eye(2)
    wanted = kinds.swapaxes(1, 2) @ profile
    explained = np.einsum("ij,ij->i", wanted, np.linalg.solve(normal, wanted[..., None])[..., 0])
    return float(tips[int(np.argmax(explained))])
