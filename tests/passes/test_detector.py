"""Noise and conversion: moments, distribution, determinism."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest
from scipy import stats

from simgl.scene.camera import Camera
from tests.passes.exposures import EPOCH, SIDE, camera, expose


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("mean", [0.1, 1.0, 5.0, 20.0, 29.9, 30.0, 100.0, 1000.0, 10_000.0])
def test_shot_noise_is_poisson(gl: moderngl.Context, mean: float, seed: int) -> None:
    """Mean and variance both equal the expected count, and chi-square does not object."""
    counts = expose(gl, mean, camera(), seed=seed).ravel().astype(np.int64)
    n = counts.size
    assert abs(counts.mean() - mean) < 4.0 * np.sqrt(mean / n)
    assert abs(counts.var() - mean) < 4.0 * np.sqrt((mean + 2 * mean**2) / n)
    low, high = stats.poisson.ppf([1e-4, 1.0 - 1e-4], mean).astype(int)
    edges = np.unique(np.linspace(low, high + 1, min(high - low + 2, 80)).astype(int))
    observed = np.histogram(counts, bins=np.concatenate([[-0.5], edges - 0.5, [1e9]]))[0]
    below = stats.poisson.cdf(np.concatenate([edges - 1, [10**9]]), mean)
    expected = n * np.diff(np.concatenate([[0.0], below]))
    keep = expected > 5.0
    chi2 = np.sum((observed - expected)[keep] ** 2 / expected[keep])
    # 18 cases: a false alarm in 1e5 of them each.
    assert stats.chi2.sf(chi2, keep.sum() - 1) > 1e-5


def test_read_noise_is_gaussian_about_the_pedestal(gl: moderngl.Context) -> None:
    dn = expose(gl, 0.0, camera(read_noise=8.0, pedestal=200.0)).astype(np.float64)
    n = dn.size
    # floor() takes half a DN off the mean and adds 1/12 to the variance.
    assert abs(dn.mean() - 199.5) < 4.0 * 8.0 / np.sqrt(n)
    assert abs(dn.var() - (64.0 + 1.0 / 12.0)) < 4.0 * 64.0 * np.sqrt(2.0 / n)
    assert abs(stats.skew(dn.ravel())) < 4.0 * np.sqrt(6.0 / n)
    assert abs(stats.kurtosis(dn.ravel())) < 4.0 * np.sqrt(24.0 / n)


def test_photon_transfer_gives_back_the_gain(gl: moderngl.Context) -> None:
    """EMVA 1288: variance against mean has slope K."""
    cam = camera(gain_dn_per_e=0.34125, read_noise=4.0, pedestal=64.0, bits=12, full_well=12_000.0)
    points = []
    for mean in (0.0, 500.0, 1000.0, 2000.0, 4000.0, 6000.0, 8000.0):
        dn = expose(gl, mean, cam, seed=int(mean)).astype(np.float64)
        points.append((dn.mean(), dn.var()))
    mean_dn, variance = np.array(points).T
    slope = np.polyfit(mean_dn - mean_dn[0], variance - variance[0], 1)[0]
    # 262,144 samples a point: variances to 0.28 %, the fit over six points to some 0.2 %.
    np.testing.assert_allclose(slope, 0.34125, rtol=8e-3)
    # 6000 e-: mean 2047 + pedestal - 0.5, variance 700.656 (worked numbers of a 12-bit camera).
    np.testing.assert_allclose(mean_dn[5], 6000 * 0.34125 + 63.5, atol=4 * np.sqrt(700.0 / SIDE**2))
    np.testing.assert_allclose(variance[5], 0.34125**2 * 6016 + 1 / 12, rtol=4 * np.sqrt(2) / SIDE)


def test_full_well_and_converter_saturate(gl: moderngl.Context) -> None:
    cam = camera(full_well=1000.0, gain_dn_per_e=2.0, bits=12)
    assert np.all(expose(gl, 4.0e9, cam) == 2000)
    assert np.all(expose(gl, 4.0e9, camera(full_well=1e4, bits=12)) == 4095)


def test_noise_depends_on_seed_epoch_and_camera_alone(gl: moderngl.Context) -> None:
    cam = camera(read_noise=5.0, pedestal=100.0)
    first = expose(gl, 50.0, cam)
    np.testing.assert_array_equal(first, expose(gl, 50.0, cam))
    other = Camera(name="cam2", lens=cam.lens, detector=cam.detector, exposure_time=0.001)
    for different in (
        expose(gl, 50.0, cam, seed=2),
        expose(gl, 50.0, cam, tai_ns=EPOCH + 1),
        expose(gl, 50.0, cam, tai_ns=EPOCH + (1 << 32)),
        expose(gl, 50.0, other),
    ):
        correlation = np.corrcoef(first.ravel(), different.ravel())[0, 1]
        # Independent images of n pixels correlate by 1 / sqrt(n).
        assert abs(correlation) < 5.0 / SIDE


def test_pixels_do_not_correlate_with_their_neighbours(gl: moderngl.Context) -> None:
    noise = expose(gl, 100.0, camera(read_noise=5.0, pedestal=100.0)).astype(np.float64)
    noise -= noise.mean()
    for shift, axis in ((1, 0), (1, 1), (7, 0), (64, 1)):
        rolled = np.roll(noise, shift, axis)
        assert abs((noise * rolled).mean() / noise.var()) < 5.0 / SIDE


def test_a_source_left_out_changes_no_other(gl: moderngl.Context) -> None:
    """Read noise comes from its own stream: shot noise is the same with and without it."""
    shot = expose(gl, 500.0, camera()).astype(np.int64)
    both = expose(gl, 500.0, camera(read_noise=1e-3)).astype(np.int64)
    # 1e-3 e- of read noise moves a whole count by one at most, downwards through floor().
    assert np.isin(shot - both, (0, 1)).all()
