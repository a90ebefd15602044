"""Contrast of fine detail in images, by slanted edges, against the formulas of optics."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from tests.camera.edge_scenes import BANDS, PITCH, edge_electrons, mtf_of, pixels_around
from tests.reference.slanted_edge import Edge, edge_spread, measured_edge, measured_mtf, system_mtf

# Up to where these lenses leave a tenth of the contrast [cycles per pixel].
_FREQUENCIES = np.array([0.05, 0.1, 0.2, 0.25])
_CENTRE = (192.3, 192.4)


def test_a_slanted_edge_measures_the_contrast_that_made_it() -> None:
    """An edge drawn from a transfer function, f/4, in the green band."""
    edge = Edge(place=np.array([64.2, 64.0]), normal=np.radians(5.0))
    rows, columns = np.mgrid[0:128, 0:128]
    distance = edge.distance(columns, rows).ravel()
    frequency = np.linspace(0.0, 6.0, 1501)
    bands = [(*BANDS[1], 1.0)]
    mtf = system_mtf(frequency, edge.normal, f_number=4.0, pitch=PITCH, blur=0.0, bands=bands)
    found = measured_mtf(distance, edge_spread(frequency, mtf, distance), _FREQUENCIES)
    # 0.2 % of an Airy disc's light along a line lies beyond the 32 pixels that are looked at, and
    # the window takes twice as much within; it raises all contrasts alike.
    np.testing.assert_allclose(found, np.interp(_FREQUENCIES, frequency, mtf), atol=8e-3)


@pytest.mark.parametrize("normal", [5.0, 94.0], ids=["columns", "rows"])
@pytest.mark.parametrize(
    ("f_number", "blur"), [(16.0, 0.0), (8.0, 4e-6)], ids=["diffraction", "aberration"]
)
def test_contrast_is_that_of_lens_and_pixel(
    gl: moderngl.Context, f_number: float, blur: float, normal: float
) -> None:
    optics = {"diffraction": True, "aberration_um": 1e6 * blur}
    edge, electrons = edge_electrons(gl, optics, f_number, _CENTRE, np.radians(normal))
    wanted, found = mtf_of(edge, electrons, "mono", f_number, blur, _FREQUENCIES)
    # Five samples a pixel place each of 180 rows of the edge to a tenth of a pixel: a thousandth of
    # the contrast. A wavelength's photons, not its power, make electrons: 3e-3 of contrast.
    np.testing.assert_allclose(found, wanted, atol=1.8e-3)


@pytest.mark.parametrize("normal", [5.0, 94.0], ids=["columns", "rows"])
@pytest.mark.parametrize(("f_number", "blur"), [(2.8, 0.0), (4.0, 0.0), (4.0, 1e-6)])
def test_contrast_is_right_up_to_the_nyquist_frequency(
    gl: moderngl.Context, f_number: float, blur: float, normal: float
) -> None:
    """Lenses whose point spread is narrow beside a pixel."""
    optics = {"diffraction": True, "aberration_um": 1e6 * blur}
    edge, electrons = edge_electrons(gl, optics, f_number, _CENTRE, np.radians(normal), samples=45)
    frequency = np.array([0.1, 0.25, 0.4, 0.5])
    wanted, found = mtf_of(edge, electrons, "mono", f_number, blur, frequency)
    # Kernels of all bands share a ramp, and none has negative values, which leaves 0.002 up to a
    # quarter of a cycle, and up to 0.007 of all bands together at half a cycle; the samples' own
    # contrast is good to 0.003.
    np.testing.assert_allclose(found[:2], wanted[:2], atol=5e-3)
    np.testing.assert_allclose(found[2:], wanted[2:], atol=0.01)


def test_contrast_behind_each_colour_filter_is_its_own(gl: moderngl.Context) -> None:
    edge, electrons = edge_electrons(
        gl, {"diffraction": True}, 16.0, _CENTRE, np.radians(5.0), colour=True, samples=40
    )
    for letter in "RGB":
        wanted, found = mtf_of(edge, electrons, letter, 16.0, 0.0, _FREQUENCIES)
        # As above; a red or blue pixel is one of four, but has eight times the samples.
        np.testing.assert_allclose(found, wanted, atol=1.8e-3)


@pytest.mark.parametrize("f_number", [1.4, 2.8])
@pytest.mark.parametrize("samples", [5, 16])
def test_few_samples_place_an_edge_of_any_slant(
    gl: moderngl.Context, f_number: float, samples: int
) -> None:
    """Sharp lenses: what a pixel across the edge misses shows in the image. One edge each, also
    along the rows of the sample grid, 13.3 deg, where all samples of an edge miss alike."""
    frequencies = np.array([0.25, 0.5])
    for slant, place in ((4.0, _CENTRE), (13.3, (90.2, 110.0)), (96.5, _CENTRE), (207.0, _CENTRE)):
        optics = {"diffraction": True}
        edge, electrons = edge_electrons(
            gl, optics, f_number, place, np.radians(slant), samples=samples
        )
        wanted, found = mtf_of(edge, electrons, "mono", f_number, 0.0, frequencies)
        # The method itself: the pixels of a bin lie up to an eighth of a pixel off its middle, by
        # which exact edges of 180 pixels scatter by 0.006 at half a cycle per pixel.
        np.testing.assert_allclose(found, wanted, atol=0.01)
        # A kernel without negative parts: no pixel outshines the plate or is darker than the sky.
        distance, values = pixels_around(edge, electrons, "mono")
        plate = np.median(values[distance > 30.0])
        assert values.max() < 1.002 * plate
        assert values.min() >= 0.0
        # It lies where 64 samples put it. Along a row of the sample grid five would put it all up
        # to a fifth of a pixel off; 64, here, where they happen to fall beside it, 0.002.
        _, many = edge_electrons(gl, optics, f_number, place, np.radians(slant), samples=64)
        near = np.abs(distance) < 20.0
        _, wanted_values = pixels_around(edge, many, "mono")
        off = (values[near].sum() - wanted_values[near].sum()) / plate
        assert off / 180.0 == pytest.approx(0.0, abs=0.005)


def test_between_two_zones_the_contrasts_are_mixed(gl: moderngl.Context) -> None:
    """Edges across half of the way out, where the blur is between 4 um and 8 um."""
    optics = {"aberration_um": 4.0, "field_zones": [{"at": 1.0, "aberration_um": 8.0}]}
    place = (100.2, 100.4)
    edge, electrons = edge_electrons(gl, optics, 4.0, place, np.radians(4.0))
    distance, values = pixels_around(edge, electrons, "mono")
    outer = np.hypot(*(np.array(place) - 192.0)) / np.hypot(192.0, 192.0)
    pixel = np.sinc(_FREQUENCIES)
    inner_mtf, outer_mtf = (
        pixel * np.exp(-2.0 * (np.pi * blur / PITCH * _FREQUENCIES) ** 2) for blur in (4e-6, 8e-6)
    )
    wanted = (1.0 - outer) * inner_mtf + outer * outer_mtf
    found = measured_mtf(distance, values, _FREQUENCIES)
    # Along and across the edge the mixture changes by 0.17 on each side, which cancels but for the
    # square of that: 3 % of what two zones differ by, up to 0.3.
    np.testing.assert_allclose(found, wanted, atol=0.01)


def test_a_spread_edge_stays_where_it_is(gl: moderngl.Context) -> None:
    edge, electrons = edge_electrons(gl, {"diffraction": True}, 8.0, _CENTRE, np.radians(5.0))
    distance, values = pixels_around(edge, electrons, "mono")
    place, mean = measured_edge(distance, values)
    line = np.diff(mean)
    within = np.abs(place[1:]) < 8.0
    centre = np.sum(line[within] * (place[1:] - 0.125)[within]) / line[within].sum()
    # 180 rows, each to a tenth of a pixel: 0.0075 pixels.
    assert centre == pytest.approx(0.0, abs=0.0075)
    # Nowhere brighter than the plate, nor darker than the sky.
    plate = np.median(values[distance > 30.0])
    assert mean.max() < 1.002 * plate
    assert np.diff(mean).min() > -0.001 * plate
