"""Particles: how many, how long, how much charge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.camera.camera import Camera
from simgl.camera.detector import Particles
from simgl.camera.particle_hits import expected_hits, hits, tracks
from tests.passes.exposures import camera

FLUX = 1000e4  # 1000 cm-2 s-1 [m-2 s-1]


def vga(exposure_time: float, flux: float = FLUX) -> Camera:
    """1280 x 960 pixels of 3.75 um, a layer of 5 um, minimum-ionising particles."""
    particles = Particles(flux=flux, depth=5e-6, charge=80e6)
    return camera(exposure_time, width=1280, height=960, pixel_pitch=3.75e-6, particles=particles)


def test_the_worked_numbers_of_hits() -> None:
    # 8.64e-5 and 1.73e-2 for each particle per cm2 and second.
    assert expected_hits(vga(0.0005)) == pytest.approx(0.0864, rel=1e-9)
    assert expected_hits(vga(0.1)) == pytest.approx(17.28, rel=1e-9)
    assert expected_hits(camera()) == 0.0


def test_the_number_of_hits_is_poisson() -> None:
    cam = vga(0.1)
    counts = np.array([len(tracks(cam, epoch, 1).electrons) for epoch in range(2000)])
    # Standard errors of mean and variance over 2,000 frames: 0.093 and 0.56.
    assert abs(counts.mean() - 17.28) < 4 * 0.093
    assert abs(counts.var() - 17.28) < 4 * 0.56


def test_track_lengths_follow_the_cosine_law() -> None:
    actual = tracks(vga(1000.0), 1, 1)
    n = len(actual.electrons)
    assert n > 150_000
    length = np.linalg.norm(actual.end - actual.start, axis=1)
    for pixels, share in ((1, 0.640), (2, 0.308), (3, 0.165), (5, 0.066), (10, 0.0175)):
        # Printed to the last digit, four standard errors.
        error = 4.0 * np.sqrt(share * (1.0 - share) / n)
        assert np.mean(length > pixels) == pytest.approx(share, abs=error + 5e-4)
    # Charge of the path in space: the layer's 400 e- over the cosine.
    path = np.hypot(length * 3.75, 5.0)
    np.testing.assert_allclose(actual.electrons, 80.0 * path, rtol=1e-9)


def test_a_track_inside_the_picture_leaves_all_its_charge_in_neighbouring_pixels() -> None:
    cam = vga(0.001, flux=1e9)
    actual = tracks(cam, 5, 1)
    size = np.array([1280.0, 960.0])
    inside = np.all((actual.end > 0.0) & (actual.end < size), axis=1)
    pixels, electrons = hits(cam, 5, 1)
    # What leaves through the edge is missing; the rest is there to the electron.
    assert electrons.sum() <= np.round(actual.electrons).sum()
    assert electrons.sum() >= np.round(actual.electrons[inside]).sum() - inside.sum()
    assert np.all(np.diff(pixels) > 0)
    assert np.all((pixels >= 0) & (pixels < 1280 * 960))


def test_one_track_covers_what_a_fine_walk_along_it_covers() -> None:
    """Against 50,000 points along each of the longest tracks of a frame."""
    cam = vga(0.1)
    for epoch in range(40):
        actual = tracks(cam, epoch, 3)
        if len(actual.electrons) == 0:
            continue
        # One particle alone in its frame: its pixels are all that is hit.
        walk = np.linspace(0.0, 1.0, 50_000, endpoint=False) + 0.5 / 50_000
        wanted = np.zeros((960, 1280))
        for start, end, charge in zip(actual.start, actual.end, actual.electrons, strict=True):
            x, y = np.floor(start + walk[:, None] * (end - start)).astype(int).T
            seen = (x >= 0) & (x < 1280) & (y >= 0) & (y < 960)
            np.add.at(wanted, (y[seen], x[seen]), charge / 50_000)
        pixels, electrons = hits(cam, epoch, 3)
        got = np.zeros(960 * 1280)
        got[pixels] = electrons
        # Rounding of sums: less than one electron a pixel and track, two at a crossing.
        assert np.abs(got - wanted.ravel()).max() < 2.1
        if epoch >= 5:
            break


def test_particles_depend_on_seed_epoch_and_camera_alone() -> None:
    cam = vga(0.1)
    first = hits(cam, 7, 1)
    np.testing.assert_array_equal(first, hits(cam, 7, 1))
    twin = replace(cam, name="cam2")
    for other in (hits(cam, 8, 1), hits(cam, 7, 2), hits(cam, 7, 1, 1), hits(twin, 7, 1)):
        assert not np.array_equal(first[0], other[0])
