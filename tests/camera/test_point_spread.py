"""What a lens does after the image is formed: all effects on planes of numbers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy

from simgl.camera.convolution import Window
from simgl.camera.ghosts import common_area, ghosts
from simgl.camera.lens import Blur, LensSurface, PointSpread, Zone
from simgl.camera.pixel_ramp import pixel_ramps
from simgl.camera.point_spread import Spread, SunInCamera
from simgl.camera.projections import Distortion, DoubleSphere, Fisheye
from simgl.physics.constants import SOLAR_CONSTANT, SOLAR_TEMPERATURE
from simgl.physics.spectrum import black_body_light
from tests.camera.cameras import DIFFRACTION, camera
from tests.camera.spreads import Spreading, on_cpu, on_gpu
from tests.reference.optics import convolved, point_spread

LIGHT = black_body_light(SOLAR_CONSTANT, SOLAR_TEMPERATURE).irradiance
WEIGHTS = np.array([3.1e18, 2.8e18, 2.2e18, 4.2e18]) * 0.5 * 7e-15


@pytest.fixture(params=["cpu", "compute"])
def spread(request: pytest.FixtureRequest) -> Spreading:
    """Each way to spread the bands."""
    if request.param == "cpu":
        return on_cpu
    return on_gpu(request.getfixturevalue("gl"))


def panel(height: int = 192, width: int = 256) -> np.ndarray[Any, np.dtype[np.float32]]:
    """Four bands of a sunlit panel, a shadow on it, and dark sky."""
    planes = np.zeros((4, height, width), dtype=np.float32)
    planes[:, 60:140, 50:130] = (LIGHT / 200.0)[:, None, None]
    planes[:, 90:110, 80:100] *= 1e-5
    return planes


def test_a_point_keeps_its_light(spread: Spreading) -> None:
    # A picture so large that only 2 lambda N / (pi^2 p R), here 1.5e-3, falls off it.
    planes = np.zeros((4, 192, 256), dtype=np.float32)
    planes[:, 96, 128] = 1.0
    results = spread(camera(spread=DIFFRACTION), list(planes), None)
    off = 2.0 * np.array([650.0, 550.0, 450.0, 840.0]) * 1e-9 * 4.0 / (np.pi**2 * 3.75e-6 * 108.0)
    for result, lost in zip(results, off, strict=True):
        assert result.min() >= 0.0
        # 108 pixels is the radius of a circle as wide as the picture, within a tenth.
        assert result.sum(dtype=np.float64) == pytest.approx(1.0 - lost, abs=0.15 * lost)


def test_one_sum_of_the_bands_is_the_sum_of_the_spread_bands() -> None:
    """The mixture of two kernels against the four of the bands."""
    cam = camera(
        spread=PointSpread(diffraction=True, zones=(Zone(share=0.0, blur=Blur(aberration=1e-6)),))
    )
    planes = panel()
    # Blue paint beside red.
    planes[:2, 60:140, 50:90] *= 0.2
    planes[2:, 60:140, 90:130] *= 0.2
    four = Spread(cam).apply(list(planes))
    wanted = np.einsum("b,bhw->hw", WEIGHTS, np.stack(four).astype(np.float64))
    one = Spread(cam, WEIGHTS[None])
    (actual,) = one.apply(
        [np.einsum("b,bhw->hw", row, planes).astype(np.float32) for row in one.mixture]
    )
    # The third term of a series in the wavelength is left: 0.3 % of the step at the panel's edge.
    np.testing.assert_allclose(actual, wanted, atol=3e-3 * wanted.max())
    dark = np.s_[150:, 150:]
    np.testing.assert_allclose(actual[dark], wanted[dark], rtol=5e-3)


@pytest.mark.parametrize("f_number", [2.8, 4.0, 8.0])
def test_one_sum_of_the_bands_is_exact_for_a_white_point(f_number: float) -> None:
    cam = camera(f_number=f_number, spread=DIFFRACTION)
    planes = np.zeros((4, 192, 256), dtype=np.float32)
    planes[:, 96, 128] = LIGHT / LIGHT.sum()
    four = Spread(cam).apply(list(planes))
    wanted = np.einsum("b,bhw->hw", WEIGHTS, np.stack(four).astype(np.float64))
    one = Spread(cam, WEIGHTS[None])
    (actual,) = one.apply(
        [np.einsum("b,bhw->hw", row, planes).astype(np.float32) for row in one.mixture]
    )
    # The sum counts 1e4 times a band's square, whose own fit is good to 1e-3: some 1e-6 are left.
    np.testing.assert_allclose(actual, wanted, rtol=0.0, atol=1e-5 * wanted.sum())


def test_a_panel_and_its_veil_are_those_of_the_reference(spread: Spreading) -> None:
    """A panel drawn and spread on pixels a twelfth as wide, then averaged over the detector's."""
    cam, finer = camera(96, 64, spread=DIFFRACTION), 12
    panel_there = np.zeros((64 * finer, 96 * finer))
    # Its right edge in the middle of a pixel.
    panel_there[15 * finer : 49 * finer, 20 * finer : 54 * finer + finer // 2] = 1.0
    finely = convolved(panel_there, point_spread(cam, Blur(), 1, finer, 2048))
    wanted = finely.reshape(64, finer, 96, finer).mean(axis=(1, 3))
    of_green = pixel_ramps(cam)[1]
    ramp = round(of_green * finer)
    assert ramp == of_green * finer
    softened = panel_there
    for width in (finer, ramp):
        for axis in (0, 1):
            softened = scipy.ndimage.uniform_filter1d(softened, width, axis, mode="constant")
    # Of an even and an odd width the middle lies in the middle of a pixel of the detector.
    plane = softened[finer // 2 :: finer, finer // 2 :: finer].astype(np.float32)
    actual = spread(cam, [plane] * 4, None)[1]
    # At corners, along both axes: half a wave of 0.75 cycles, of which pixel and ramp leave 0.14 of
    # the contrast and the kernel 0.02 too much of that.
    np.testing.assert_allclose(actual, wanted, atol=6e-3)
    for distance in (2, 3, 5, 10):
        column = np.s_[25:40, 54 + distance]
        # The veil of the tail, on cells of 8 pixels.
        assert actual[column].mean() == pytest.approx(wanted[column].mean(), rel=0.025)


def test_several_sums_of_the_bands_are_sums_of_the_spread_bands() -> None:
    """What lies behind colour filters, a glint among it."""
    cam = camera(spread=DIFFRACTION, veiling_glare=0.01)
    planes = panel()
    planes[:, 30, 200] = 900.0
    filters = np.array([[1.0, 0.1, 0.05, 0.6], [0.1, 0.9, 0.1, 0.5], [0.0, 0.0, 0.0, 0.0]])
    four = Spread(cam).apply(list(planes))
    wanted = np.einsum("rb,bhw->rhw", filters, np.stack(four).astype(np.float64))
    actual = Spread(cam, filters).apply(list(planes))
    # Single precision's noise, 1e-7 of the brightest that it convolves: 300 sunlit plates.
    np.testing.assert_allclose(actual, wanted, rtol=1e-5, atol=3e-5 * wanted[0, 100, 60])


def test_veiling_glare_spreads_its_share_evenly(spread: Spreading) -> None:
    planes = panel()
    results = spread(camera(veiling_glare=0.03), list(planes), None)
    for plane, result in zip(planes, results, strict=True):
        mean = plane.mean(dtype=np.float64)
        np.testing.assert_allclose(result, 0.97 * plane + 0.03 * mean, rtol=1e-5)
        assert result.mean(dtype=np.float64) == pytest.approx(mean, rel=1e-5)


def test_veiling_glare_comes_on_top_of_the_spread(spread: Spreading) -> None:
    planes = list(panel())
    without = spread(camera(spread=DIFFRACTION), planes, None)
    both = spread(camera(spread=DIFFRACTION, veiling_glare=0.5), planes, None)
    for plane, one, two in zip(planes, without, both, strict=True):
        mean = plane.mean(dtype=np.float64)
        np.testing.assert_allclose(two, 0.5 * one + 0.5 * mean, rtol=1e-5)


def test_zones_blur_their_own_part_of_the_picture(spread: Spreading) -> None:
    zones = (
        Zone(share=0.0, blur=Blur()),
        Zone(share=0.5, blur=Blur()),
        Zone(share=1.0, blur=Blur(aberration=12e-6)),
    )
    planes = np.zeros((4, 192, 256), dtype=np.float32)
    planes[:, 96, 128] = 1.0
    planes[:, 20, 20] = 1.0
    results = spread(camera(spread=PointSpread(diffraction=False, zones=zones)), list(planes), None)
    # Sharp in the middle.
    assert results[1][96, 128] == pytest.approx(1.0, abs=1e-5)
    # Near the corner, 0.83 of the way: two thirds of its light have the outer zone's blur.
    share = (np.hypot(107.5, 75.5) / np.hypot(128.0, 96.0) - 0.5) / 0.5
    assert results[1][20, 20] == pytest.approx(1.0 - share + share * 0.0155, abs=2e-3)
    assert results[1].sum(dtype=np.float64) == pytest.approx(2.0, abs=1e-4)


def test_zones_lie_around_the_principal_point(spread: Spreading) -> None:
    zones = (Zone(share=0.0, blur=Blur()), Zone(share=1.0, blur=Blur(aberration=12e-6)))
    planes = np.zeros((4, 192, 256), dtype=np.float32)
    places = [(96, 188), (96, 68), (36, 188)]
    for row, column in places:
        planes[:, row, column] = 1.0
    # The axis meets the image 60.5 px right of its centre, in the middle of a pixel.
    cam = camera(
        spread=PointSpread(diffraction=False, zones=zones),
        principal_offset=(60.5 * 3.75e-6, 0.5 * 3.75e-6),
    )
    results = spread(cam, list(planes), None)
    for row, column in places:
        share = np.hypot(column - 188, row - 96) / np.hypot(128.0, 96.0)
        # 0.0155 is the peak of the outer zone, as above.
        assert results[1][row, column] == pytest.approx(1.0 - share + share * 0.0155, abs=2e-3)


def test_sun_in_the_picture(spread: Spreading) -> None:
    """No NaN or infinity, and far from it the tail of its light: lambda N / (pi^3 p r^3)."""
    cam = camera(512, 384, spread=DIFFRACTION)
    radius = 10.0
    y, x = np.mgrid[0:384, 0:512] + 0.5
    disc = np.hypot(x - 100.0, y - 190.0) < radius
    sun = 20.1e6 * np.pi / 64.0 * LIGHT / SOLAR_CONSTANT
    planes = np.where(disc, sun[:, None, None], 0.0).astype(np.float32)
    planes[:, 150:230, 300:380] += (LIGHT / 200.0)[:, None, None].astype(np.float32)
    results = spread(cam, list(planes), None)
    for band, nanometres in ((0, 649.0), (1, 549.5), (2, 451.0), (3, 838.0)):
        actual = results[band]
        assert np.isfinite(actual).all()
        assert actual.min() >= 0.0
        total = planes[band][:, :200].sum(dtype=np.float64)
        tail = nanometres * 1e-9 * 4.0 / (np.pi**3 * 3.75e-6)
        for row, column in ((190, 200), (62, 102), (190, 450), (350, 400)):
            distance = np.hypot(column - 100.0, row - 190.0)
            # The panel's own light is 1e-6 of the Sun's.
            patch = actual[row - 2 : row + 2, column - 2 : column + 2].mean(dtype=np.float64)
            # A disc of radius 10 at a distance of 100: 9/8 (10 / 100)^2 = 1 %; the coarse grid 2 %.
            assert patch == pytest.approx(total * tail / distance**3, rel=0.03)


TRIPLET_LIKE = (
    LensSurface(radius=40e-3, gap=4e-3, index=1.6, reflectance=0.01),
    LensSurface(radius=-60e-3, gap=0.0, index=1.0, reflectance=0.02),
)


def test_ghost_of_a_single_lens_has_its_place_and_share() -> None:
    """Two reflections inside a lens of 4 mm: paraxial formulas by hand.

    Powers of the surfaces 15 and 10 m-1, and of the mirrors inside glass 2 n / r.
    """
    (ghost,) = ghosts(TRIPLET_LIKE, 1.0 / 24.0)
    assert ghost.share == pytest.approx(0.01 * 0.02)

    def step(power_in_glass: float, height: float, slope: float) -> tuple[float, float]:
        slope = slope - power_in_glass * height
        return height + 4e-3 * slope, slope

    # f = 41.7 mm; thickness makes it 42.1, to which the lens is scaled back.
    focal = 1.0 / (15.0 + 10.0 - 4e-3 / 1.6 * 150.0)
    scale = (1.0 / 24.0) / focal
    back_focus = focal * (1.0 - 4e-3 / 1.6 * 15.0)

    def trace(height: float, slope: float) -> float:
        u = slope / 1.6 - height * 15.0 / 1.6
        y = height + 4e-3 * u
        # The back surface is concave towards the light: it collects; so does the front from behind.
        u -= 2.0 / 60e-3 * y
        y += 4e-3 * u
        u -= 2.0 / 40e-3 * y
        y += 4e-3 * u
        u = 1.6 * u - 10.0 * y
        return y + back_focus * u

    assert ghost.lever == pytest.approx(trace(0.0, 1.0) * scale, rel=1e-9)
    assert ghost.spread == pytest.approx(abs(trace(1.0, 0.0)), rel=1e-9)


@pytest.mark.parametrize("coating", [0.005, 0.04])
def test_ghosts_hold_the_products_of_the_reflectances(spread: Spreading, coating: float) -> None:
    surfaces = tuple(
        LensSurface(radius=s.radius, gap=s.gap, index=s.index, reflectance=coating)
        for s in TRIPLET_LIKE
    )
    cam = camera(1024, 1024, surfaces=surfaces, focal_length=8e-3, f_number=20.0)
    sun = SunInCamera(
        direction=np.array([0.02, 0.01, 0.99975]), irradiance=LIGHT, angular_radius=4.65e-3
    )
    dark = np.zeros((4, 1024, 1024), dtype=np.float32)
    # The Sun's own disc, behind which no spacecraft stands.
    x, y = cam.project(sun.direction)
    rows, columns = np.mgrid[0:1024, 0:1024] + 0.5
    dark[:, np.hypot(columns - x, rows - y) < 10.0] = 1e6
    before = dark.sum(axis=(1, 2), dtype=np.float64)
    after = np.array([r.sum(dtype=np.float64) for r in spread(cam, list(dark), sun)])
    area = np.pi * (8e-3 / 40.0) ** 2 / 3.75e-6**2
    direct = LIGHT * sun.direction[2] * area
    # A disc of some hundred pixels on a grid of 8 loses or gains 1 % of its light at its edge; the
    # float32 disc of the Sun beside it 1e-7 of 3e8.
    np.testing.assert_allclose(
        after - before, coating**2 * direct, rtol=0.02, atol=1e-7 * before.max()
    )


GHOST_LENSES: dict[str, dict[str, Any]] = {
    # The Sun 1390 px off the boresight, and 400 px off the middle of the image.
    "boresight beyond the image": {"principal_offset": (-1000 * 3.75e-6, 0.0)},
    "fisheye": {"distortion": Fisheye(k1=0.02)},
    "double sphere": {"distortion": DoubleSphere(xi=0.4, alpha=0.6)},
    "barrel": {"distortion": Distortion(k1=-0.12)},
    "unequal focal lengths": {"aspect": 1.3, "skew": 0.1},
    "thin lens": {"camera_equation": "1+4N2"},
}


@pytest.mark.parametrize("name", GHOST_LENSES)
def test_ghosts_lie_on_the_line_through_the_boresight_and_the_image_of_the_sun(name: str) -> None:
    """Of any lens that images the Sun within its image: at the multiple of its distance that
    Gaussian optics say, with the share of its light."""
    focal_length = 3e-3
    cam = camera(1024, 768, surfaces=TRIPLET_LIKE, focal_length=focal_length, f_number=20.0)
    lens = replace(cam.lens, **GHOST_LENSES[name])
    cam = replace(cam, lens=lens)
    wanted = np.array([900.0, 300.0])
    ray = cam.rays(wanted)
    sun = SunInCamera(direction=ray / np.linalg.norm(ray), irradiance=LIGHT, angular_radius=4.65e-3)
    rows, columns = np.mgrid[0:768, 0:1024] + 0.5
    # The Sun's own disc, behind which no spacecraft stands.
    disc = np.where(np.hypot(columns - wanted[0], rows - wanted[1]) < 8.0, 200.0, 0.0)
    planes = [disc.astype(np.float32)] * 4
    found = Spread(cam).within(Window.full((768, 1024)), planes, sun)
    (ghost,) = ghosts(TRIPLET_LIKE, 1.0)
    place = cam.principal_point + ghost.lever * (wanted - cam.principal_point)
    image = found.image(1).astype(np.float64) - disc
    centre = np.array([(image * columns).sum(), (image * rows).sum()]) / image.sum()
    np.testing.assert_allclose(centre, place, atol=0.5)
    # The pupil is a disc of the true focal length, which collects the Sun's light.
    scale = 1.0 if lens.distortion is None else lens.distortion.scale
    pupil = np.pi * (0.5 * scale * focal_length / 20.0) ** 2
    if lens.camera_equation == "1+4N2":
        pupil *= 1600.0 / 1601.0
    turned = lens.distortion is not None and lens.distortion.pupil_turns
    direct = LIGHT[1] * pupil / 3.75e-6**2 * (1.0 if turned else sun.direction[2])
    assert image.sum() == pytest.approx(0.0002 * direct, rel=0.02)


def test_area_that_two_circles_share() -> None:
    # Equal circles of radius 1, their centres 1 apart: 2 pi / 3 - sqrt(3) / 2.
    actual = common_area(1.0, 1.0, np.array([0.0, 1.0, 2.0, 3.0]))
    np.testing.assert_allclose(
        actual, [np.pi, 2.0 * np.pi / 3.0 - np.sqrt(0.75), 0.0, 0.0], atol=1e-6
    )
    assert common_area(2.0, 1.0, np.array(0.5)) == pytest.approx(np.pi)
