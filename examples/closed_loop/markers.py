"""Near features: dark discs on a white board, found, measured and told apart.

A dark disc is what vanishes when the image is closed (a maximum over a disc's size, then a
minimum): darkness is how far a pixel lies below the closed image. Its blobs of the right size are
candidates; the shift between predicted and found places that explains most of them says which disc
is which. Discs with a bright middle, the rings, prove it where they are large enough.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.spatial import KDTree

from examples.closed_loop.camera import Pinhole
from simgl.arrays import Array, Image16, IndexArray, Mask

DARK = 0.5  # of the white around it; the paint is at 0.05, half of a pixel's area makes the rest
MIN_SIGNAL = 20.0  # [DN] of the white around a disc, five times the noise of reading
AREAS = (0.45, 1.8)  # of the area expected
SMALLEST_RADIUS = 1.3  # [px] smaller discs have less than 5 pixels
MATCH = 0.3  # of the distance between discs: nearer belongs together
ENOUGH = 0.6  # share of the discs expected in view that must be found
RING_RADIUS = 5.0  # [px] from which on a ring's bright middle can be seen
MAX_MISMATCHED = (
    2  # the edge of a beam across a disc makes a ring of it; any wrong match has 4 or more
)
RINGS = ((0, 0), (0, 2), (4, 0))  # row and column, by the board's drawing
BRIGHT_PERCENT = 90.0  # of the board's pixels are dimmer than its white


@dataclass(frozen=True, kw_only=True, eq=False)
class Board:
    """The drawing of the board.

    names : row and column of each disc
    centres : (n, 3) in the board's axes [m]
    radius : of a disc [m]
    pitch : from disc to disc [m]
    """

    names: tuple[tuple[int, int], ...]
    centres: Array
    radius: float = 0.036
    pitch: float = 0.12

    @classmethod
    def from_keypoints(cls, keypoints: dict[str, Array]) -> Board:
        """The board in the keypoints circle_ROW_COLUMN of its model."""
        discs = {
            (int(name.split("_")[1]), int(name.split("_")[2])): place
            for name, place in keypoints.items()
            if name.startswith("circle_")
        }
        return cls(names=tuple(discs), centres=np.array(list(discs.values())))


@dataclass(frozen=True, kw_only=True, eq=False)
class Sighting:
    """Discs that were found.

    index : (n,) which of the board's
    points : (n, 2) their centres [px]
    """

    index: IndexArray
    points: Array


def board_level(dn: Image16, camera: Pinhole, predicted: Array) -> float:
    """How bright the white is where the board should be, above the pedestal [DN]."""
    low, high = _window(camera, predicted, 0.0)
    if np.any(high - low < 2):
        return 0.0
    patch = dn[low[1] : high[1], low[0] : high[0]]
    return float(np.percentile(patch, BRIGHT_PERCENT)) - camera.pedestal_dn


def find_markers(
    dn: Image16, camera: Pinhole, board: Board, predicted: Array, scale: float, search: float
) -> Sighting | None:
    """The board's discs in an image, or None where they are not beyond doubt.

    predicted : (n, 2) where the discs should be [px]
    scale : pixels per metre there
    search : how far off they may be, all alike [px]
    """
    radius, pitch = board.radius * scale, board.pitch * scale
    if radius < SMALLEST_RADIUS:
        return None
    low, high = _window(camera, predicted, search + pitch)
    if np.any(high - low < 4.0 * radius):
        return None
    signal = dn[low[1] : high[1], low[0] : high[0]].astype(np.float64) - camera.pedestal_dn
    discs, ringed = _dark_discs(signal, radius)
    if len(discs) == 0:
        return None
    discs = discs + low
    match = _matched(discs, predicted, pitch, search)
    if match is None:
        return None
    index, chosen = match
    edge = np.array([camera.width, camera.height])
    inside = np.all((predicted > radius) & (predicted < edge - radius), axis=1)
    if len(index) < ENOUGH * max(int(inside.sum()), 1):
        return None
    if radius >= RING_RADIUS:
        distinguished = ringed[chosen] == np.array([board.names[i] in RINGS for i in index])
        if np.sum(~distinguished) > MAX_MISMATCHED:
            return None
        index, chosen = index[distinguished], chosen[distinguished]
    return Sighting(index=index, points=discs[chosen])


def _window(camera: Pinhole, predicted: Array, margin: float) -> tuple[IndexArray, IndexArray]:
    """Corners (column, row) of the part of the image around places, high ones excluded."""
    edge = np.array([camera.width, camera.height])
    low = np.clip(np.floor(predicted.min(axis=0) - margin), 0, edge).astype(np.intp)
    high = np.clip(np.ceil(predicted.max(axis=0) + margin), 0, edge).astype(np.intp)
    return low, high


def _dark_discs(signal: Array, radius: float) -> tuple[Array, Mask]:
    """(n, 2) centres of dark discs [px], and which of them have a bright middle."""
    size = 2 * int(np.ceil(1.15 * radius)) + 1
    white = ndimage.grey_closing(signal, size=(size, size))
    lit = white > MIN_SIGNAL
    darkness = np.where(lit, 1.0 - signal / np.where(lit, white, 1.0), 0.0)
    regions, count = ndimage.label(ndimage.binary_fill_holes(darkness > DARK))
    if count == 0:
        return np.zeros((0, 2)), np.zeros(0, dtype=bool)
    areas = np.bincount(regions.ravel(), minlength=count + 1)[1:]
    expected = np.pi * radius**2
    centres, ringed = [], []
    height, width = signal.shape
    for label, (rows, columns) in enumerate(ndimage.find_objects(regions), 1):
        if not AREAS[0] * expected - 1.0 < areas[label - 1] < AREAS[1] * expected + 2.0:
            continue
        # One pixel around it holds the light of pixels that the disc covers in part.
        top, bottom = rows.start - 1, rows.stop + 1
        left, right = columns.start - 1, columns.stop + 1
        if top < 0 or left < 0 or bottom > height or right > width:
            continue
        member = np.isin(regions[top:bottom, left:right], (0, label))
        # The hole of a ring counts as covered: its middle is that of the disc.
        hole = (regions[top:bottom, left:right] == label) & (
            darkness[top:bottom, left:right] < DARK
        )
        weight = np.clip(np.where(hole, 1.0, darkness[top:bottom, left:right]), 0.0, 1.0) * member
        v, u = np.mgrid[top:bottom, left:right] + 0.5
        centres.append(((weight * u).sum() / weight.sum(), (weight * v).sum() / weight.sum()))
        ringed.append(int(hole.sum()) > 0.08 * expected)
    return np.array(centres).reshape(-1, 2), np.array(ringed, dtype=bool)


def _matched(
    discs: Array, predicted: Array, pitch: float, search: float
) -> tuple[IndexArray, IndexArray] | None:
    """Which disc each found place is: indices of ``predicted`` and of ``discs``, pairwise."""
    tree = KDTree(discs)
    middle = predicted.mean(axis=0)
    guides = np.argsort(np.linalg.norm(predicted - middle, axis=1))[:6]
    shifts = (discs[None] - predicted[guides, None]).reshape(-1, 2)
    shifts = shifts[np.linalg.norm(shifts, axis=1) < search]
    best, best_score = None, 0.0
    for shift in shifts:
        distance, _ = tree.query(predicted + shift, distance_upper_bound=MATCH * pitch)
        # Among equals the smaller shift is the likelier.
        score = float(np.isfinite(distance).sum()) - 0.5 * float(np.linalg.norm(shift)) / search
        if score > best_score:
            best, best_score = shift, score
    if best is None:
        return None
    moved = predicted + best
    for _ in range(2):
        distance, nearest = tree.query(moved, distance_upper_bound=MATCH * pitch)
        index = np.flatnonzero(np.isfinite(distance))
        if len(index) < 4:
            return None
        # Distance and turn are off a little too: a linear map takes up both.
        source = np.column_stack([predicted[index], np.ones(len(index))])
        linear, *_ = np.linalg.lstsq(source, discs[nearest[index]], rcond=None)
        moved = np.column_stack([predicted, np.ones(len(predicted))]) @ linear
    distance, nearest = tree.query(moved, distance_upper_bound=MATCH * pitch)
    index = np.flatnonzero(np.isfinite(distance))
    chosen = nearest[index]
    if len(np.unique(chosen)) != len(chosen):
        return None
    return index, chosen
