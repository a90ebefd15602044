"""Charged particles through the detector: number, tracks and deposited charge.

Each particle releases a charge proportional to its path in the collecting layer, distributed to the
pixels along the track in integer electrons.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from simgl.arrays import Array, IndexArray
from simgl.camera.camera import Camera
from simgl.camera.noise_streams import Stream, epoch_words, frame_key, list_words, uniform_01


@dataclass(frozen=True, kw_only=True, eq=False)
class Tracks:
    """Straight tracks, projected onto the detector.

    start, end : (n, 2) column and row [px]
    electrons : (n,) released along the track
    """

    start: Array
    end: Array
    electrons: Array


def expected_hits(camera: Camera) -> float:
    """Mean number of particles during an exposure: flux times area times time."""
    detector = camera.detector
    if detector.particles is None:
        return 0.0
    area = detector.width * detector.height * detector.pixel_pitch**2
    return detector.particles.flux * area * camera.exposure_time


def tracks(camera: Camera, tai_ns: int, seed: int, draw: int = 0) -> Tracks:
    """The particles of one frame.

    tai_ns, draw : epoch of the frame, and its number among those of this epoch

    Directions follow the cosine law of an isotropic flux through a plane: mu^2 is uniform, and the
    probability of a projected track longer than x is 1 / (1 + (x / depth)^2).
    """
    detector, epoch = camera.detector, epoch_words(tai_ns)
    particles = detector.particles
    count = 0
    if particles is not None:
        key = frame_key(seed, camera.name, Stream.HITS)
        u = uniform_01(list_words(1, key, epoch, draw))[0, 0]
        count = _poisson_quantile(u, expected_hits(camera))
    if particles is None or count == 0:
        return Tracks(start=np.zeros((0, 2)), end=np.zeros((0, 2)), electrons=np.zeros(0))
    key = frame_key(seed, camera.name, Stream.TRACKS)
    x, y, mu2, turn = uniform_01(list_words(count, key, epoch, draw)).T
    start = np.stack([x * detector.width, y * detector.height], axis=1)
    length = particles.depth * np.sqrt((1.0 - mu2) / mu2) / detector.pixel_pitch
    angle = 2.0 * np.pi * turn
    along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return Tracks(
        start=start,
        end=start + length[:, None] * along,
        electrons=particles.charge * particles.depth / np.sqrt(mu2),
    )


def _poisson_quantile(probability: float, mean: float) -> int:
    """The smallest number that a Poisson variable does not exceed with this probability."""
    # Not scipy.stats, whose import takes as long as many frames.
    if mean == 0.0:
        return 0
    number = max(np.ceil(scipy.special.pdtrik(probability, mean)), 0.0)
    fewer = max(number - 1.0, 0.0)
    return int(fewer if scipy.special.pdtr(fewer, mean) >= probability else number)


def _deposit(start: Array, end: Array, electrons: float) -> tuple[IndexArray, IndexArray]:
    """(k, 2) pixels (column, row) along one track, and the (k,) electrons in each."""
    run = end - start
    cuts = [np.array([0.0, 1.0])]
    for axis in (0, 1):
        low, high = sorted((start[axis], end[axis]))
        lines = np.arange(np.floor(low) + 1.0, np.ceil(high))
        if lines.size:
            cuts.append((lines - start[axis]) / run[axis])
    places = np.sort(np.clip(np.concatenate(cuts), 0.0, 1.0))
    middle = 0.5 * (places[1:] + places[:-1])
    pixels = np.floor(start + middle[:, None] * run).astype(np.int64)
    # Differences of rounded sums: integers with the right total.
    return pixels, np.diff(np.floor(places * electrons + 0.5)).astype(np.int64)


def hits(camera: Camera, tai_ns: int, seed: int, draw: int = 0) -> tuple[IndexArray, IndexArray]:
    """Pixels hit in one frame, as row * width + column in increasing order, and their electrons."""
    detector = camera.detector
    particles = tracks(camera, tai_ns, seed, draw)
    parts = [
        _deposit(start, end, electrons)
        for start, end, electrons in zip(
            particles.start, particles.end, particles.electrons, strict=True
        )
    ]
    if not parts:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    pixels = np.concatenate([p for p, _ in parts])
    electrons = np.concatenate([e for _, e in parts])
    size = np.array([detector.width, detector.height])
    inside = np.all((pixels >= 0) & (pixels < size), axis=1)
    flat = pixels[inside, 1] * detector.width + pixels[inside, 0]
    unique, which = np.unique(flat, return_inverse=True)
    total = np.zeros(len(unique), dtype=np.int64)
    np.add.at(total, which, electrons[inside])
    return unique, total
