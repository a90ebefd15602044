"""Noise and conversion: moments, distribution, determinism."""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest
from scipy import stats

from simgl.camera.camera import Camera
from simgl.camera.detector import FixedPattern, Particles
from simgl.camera.particle_hits import hits
from simgl.gpu.release import release_all
from simgl.gpu.render_targets import ImageTarget
from simgl.passes.exposure import ELECTRONS_FORMAT
from simgl.passes.readout import DN_FORMAT, ReadoutPass
from tests.passes.exposures import EPOCH, SIDE, camera, expose
from tests.patience import run_to_end


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("mean", [0.1, 1.0, 5.0, 19.9, 20.0, 30.0, 100.0, 1000.0, 10_000.0])
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
    # The Sun's own pixels overflow what a float counts in ones, and may overflow a float.
    assert np.all(expose(gl, np.inf, cam) == 2000)


@pytest.mark.parametrize("full_well", [8e6, 3e7])
def test_wells_of_many_electrons_hold_what_they_should(
    gl: moderngl.Context, full_well: float
) -> None:
    """Of a detector whose pixels are summed, or of one for the infrared."""
    cam = camera(full_well=full_well, gain_dn_per_e=1e-3, bits=16)
    for share in (0.5, 0.9):
        mean = share * full_well
        dn = expose(gl, mean, cam).astype(np.float64)
        assert dn.mean() == pytest.approx(1e-3 * mean - 0.5, abs=4e-3 * np.sqrt(mean / dn.size))
        assert dn.var() == pytest.approx(1e-6 * mean + 1.0 / 12.0, rel=4.0 * np.sqrt(2.0 / dn.size))
    assert np.all(expose(gl, 2.0 * full_well, cam) == round(1e-3 * full_well))


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


def test_fixed_patterns_follow_the_serial_number_alone(gl: moderngl.Context) -> None:
    """The mean of frames shows the same pattern under any seed, epoch and name."""
    pattern = FixedPattern(prnu=0.02, dsnu=15.0)
    cam = camera(pattern=pattern, pedestal=200.0, serial=4)
    first = expose(gl, 1000.0, cam).astype(np.float64)
    renamed = expose(gl, 1000.0, replace(cam, name="cam2"), seed=5, tai_ns=EPOCH + 9)
    other = replace(cam, detector=replace(cam.detector, serial=5))
    # Pattern variance 20^2 + 15^2, shot noise 1000, rounding 1/12: shared part of the variance.
    shared = 625.0 / (625.0 + 1000.0 + 1.0 / 12.0)
    seen = np.corrcoef(first.ravel(), renamed.ravel())[0, 1]
    assert abs(seen - shared) < 5.0 / SIDE
    strange = np.corrcoef(first.ravel(), expose(gl, 1000.0, other, seed=5).ravel())[0, 1]
    assert abs(strange) < 5.0 / SIDE


def test_each_part_of_the_pattern_has_its_size(gl: moderngl.Context) -> None:
    n = SIDE * SIDE
    prnu = expose(gl, 1e4, camera(pattern=FixedPattern(prnu=0.05))).astype(np.float64)
    # 1e4 e- of shot noise and 500^2 of pattern; five standard errors of a variance.
    assert abs(prnu.var() / (1e4 + 500.0**2) - 1.0) < 5.0 * np.sqrt(2.0 / n)
    dark = camera(pattern=FixedPattern(dsnu=20.0), pedestal=200.0)
    assert abs(expose(gl, 0.0, dark).var() / (400.0 + 1 / 12) - 1.0) < 5.0 * np.sqrt(2.0 / n)
    dead = expose(gl, 1000.0, camera(pattern=FixedPattern(dead_pixels=0.01))) == 0
    assert abs(dead.mean() - 0.01) < 5.0 * np.sqrt(0.01 * 0.99 / n)


def test_offsets_of_rows_and_columns_lie_along_them(gl: moderngl.Context) -> None:
    lines = expose(gl, 0.0, camera(pattern=FixedPattern(rows=20.0), pedestal=200.0))
    assert np.all(lines == lines[:, :1])
    assert abs(lines[:, 0].std() - 20.0) < 5.0 * 20.0 / np.sqrt(2.0 * SIDE)
    columns = expose(gl, 0.0, camera(pattern=FixedPattern(columns=20.0), pedestal=200.0))
    assert np.all(columns == columns[:1])
    assert abs(columns[0].std() - 20.0) < 5.0 * 20.0 / np.sqrt(2.0 * SIDE)
    moving = camera(row_noise=20.0, pedestal=200.0)
    first, second = expose(gl, 0.0, moving), expose(gl, 0.0, moving, tai_ns=EPOCH + 1)
    assert np.all(first == first[:, :1])
    assert abs(np.corrcoef(first[:, 0], second[:, 0])[0, 1]) < 5.0 / np.sqrt(SIDE)


def test_dark_current_grows_with_time_and_temperature_and_is_poisson(gl: moderngl.Context) -> None:
    n = SIDE * SIDE
    for temperature, ratio in ((300.0, 1.0), (273.15, 9.070567e-2), (323.15, 5.839465)):
        cam = camera(0.5, dark_current_300k=100.0, temperature=temperature)
        dn = expose(gl, 0.0, cam).astype(np.float64)
        mean = 50.0 * ratio
        assert abs(dn.mean() - mean) < 5.0 * np.sqrt(mean / n)
        assert abs(dn.var() - mean) < 5.0 * np.sqrt((mean + 2.0 * mean**2) / n)


def test_hot_pixels_have_exponential_dark_currents(gl: moderngl.Context) -> None:
    pattern = FixedPattern(hot_pixels=0.1, hot_current=1000.0)
    dn = expose(gl, 0.0, camera(2.0, pattern=pattern)).astype(np.float64)
    # A Poisson count of an exponential mean of 2000: 0 with probability 1/2001.
    hot = dn[dn > 0]
    n = dn.size
    assert abs(hot.size / n - 0.1 * 2000 / 2001) < 5.0 * np.sqrt(0.09 / n)
    assert abs(hot.mean() / 2000.0 - 1.0) < 5.0 / np.sqrt(hot.size)
    assert abs(np.mean(hot > 2000.0 * np.log(2.0)) - 0.5) < 5.0 * 0.5 / np.sqrt(hot.size)


def test_particles_are_added_after_shot_noise(gl: moderngl.Context) -> None:
    particles = Particles(flux=1e12, depth=5e-6, charge=80e6)
    cam = camera(particles=particles)
    with_hits = expose(gl, 50.0, cam).astype(np.int64)
    without = expose(gl, 50.0, camera()).astype(np.int64)
    pixels, electrons = hits(cam, EPOCH, 1)
    assert pixels.size > 1000
    np.testing.assert_array_equal((with_hits - without).ravel()[pixels], electrons)
    assert np.count_nonzero(with_hits - without) == np.count_nonzero(electrons)


def test_the_first_particle_finds_its_shader_compiled(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    # One in ten images has a particle.
    particles = Particles(flux=1.5e7, depth=5e-6, charge=80e6)
    cam = camera(particles=particles)
    epochs = [EPOCH + frame for frame in range(100)]
    struck = [epoch for epoch in epochs if hits(cam, epoch, 1)[0].size]
    quiet = next(epoch for epoch in epochs if epoch not in struck)
    size = (cam.detector.width, cam.detector.height)
    source, target = (ImageTarget(gl, size, [form]) for form in (ELECTRONS_FORMAT, DN_FORMAT))
    source.framebuffer.clear(50.0, 50.0, 50.0, 50.0)
    readout = ReadoutPass(gl)
    readout.draw(cam, quiet, 1, source.textures[0], target.framebuffer)
    np.testing.assert_array_equal(target.read(), expose(gl, 50.0, camera(), tai_ns=quiet))
    monkeypatch.setattr("simgl.passes.readout.FullscreenProgram", None)
    readout.draw(cam, struck[0], 1, source.textures[0], target.framebuffer)
    release_all(gl, source, target, readout)


@pytest.mark.parametrize("width", range(25, 33))
def test_a_row_ends_where_it_may(gl: moderngl.Context, width: int) -> None:
    """The last pixels of a row get their own light; the others' noise is that of a wider row."""
    mean = np.full((SIDE, width), 50.0, dtype=np.float32)
    mean[:, -1] = 1e4
    dn = expose(gl, mean, camera(width=width, read_noise=3.0, pedestal=20.0))
    assert dn.shape == (SIDE, width)
    assert np.all(dn[:, -1] > 9000)
    wider = expose(gl, 50.0, camera(width=40, read_noise=3.0, pedestal=20.0))
    np.testing.assert_array_equal(dn[:, :-1], wider[:, : width - 1])


_BITS = """
import hashlib
from simgl.gpu.context import open_context
from simgl.camera.detector import FixedPattern, Particles
from simgl.gpu.release import release_all
from simgl.gpu.render_targets import ImageTarget
from simgl.passes.exposure import ELECTRONS_FORMAT
from simgl.passes.readout import DN_FORMAT, ReadoutPass
from tests.passes.exposures import camera, expose
gl = open_context()
cam = camera(read_noise=5.0, pedestal=100.0, dark_current_300k=1e4, row_noise=3.0, blooming=0.5,
             full_well=4000.0, particles=Particles(flux=1e11, depth=5e-6, charge=80e6),
             pattern=FixedPattern(prnu=0.02, dsnu=3.0, hot_pixels=0.01, hot_current=1e5))
frames = {}
for epoch in ORDER:
    frames[epoch] = hashlib.sha256(expose(gl, 37.0, cam, tai_ns=epoch).tobytes()).hexdigest()
print([frames[epoch] for epoch in sorted(frames)])
"""


def test_all_charge_of_a_very_bright_pixel_flows_along_its_column(gl: moderngl.Context) -> None:
    """As that of the Sun, of 1e10 electrons."""
    mean = np.zeros((SIDE, SIDE), dtype=np.float32)
    mean[256, 100] = 4e7
    dn = expose(gl, mean, camera(full_well=1000.0, blooming=0.01))
    # 0.5 % of it each way fills 200 pixels; its shot noise is 0.03 of a pixel.
    column = dn[:, 100]
    np.testing.assert_array_equal(np.flatnonzero(column == 1000), np.arange(57, 456))
    # The well's own charge does not flow: 5 electrons each way.
    assert np.all(np.abs(column[[56, 456]] - 995.0) < 5 * 0.005 * np.sqrt(4e7))


def test_bits_are_the_same_for_any_number_of_threads_and_order_of_frames() -> None:
    root = Path(__file__).resolve().parents[2]
    said = set()
    for threads, order in (("1", "(3, 1, 2)"), ("4", "(2, 3, 1)")):
        run = run_to_end(
            [sys.executable, "-c", _BITS.replace("ORDER", order)],
            cwd=root,
            env=os.environ | {"LP_NUM_THREADS": threads},
        )
        said.add(run.stdout)
    assert len(said) == 1
    assert len(set(said.pop().split("'")[1::2])) == 3
