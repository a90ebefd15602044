"""Thin crescents of spheres: where their light is, and that their terminator is the sphere's."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array
from simgl.simulator import Simulator
from tests.radiometry.far_bodies import (
    ALBEDO,
    FOCAL_PX,
    RADIUS,
    SPHERE,
    at,
    centre_of_light,
    facet_light,
    light,
    place,
    sphere_light,
    sun,
    view,
)
from tests.scenes import IN_BANDS

# Between the pixels [px from the middle of the image].
_PLACES = ((0.5, 0.5), (0.29, -0.27), (0.125, 0.397), (-0.2, 0.37))


@pytest.mark.parametrize(
    ("size_px", "phase_deg"),
    [(20.0, 150.0), (36.0, 135.0), (36.0, 150.0), (100.0, 120.0), (100.0, 150.0)],
)
def test_the_centre_of_a_crescent_is_right_at_the_coarsest_sampling(
    gl: moderngl.Context, size_px: float, phase_deg: float
) -> None:
    phase, pixels = np.radians(phase_deg), 64 * int(np.ceil((size_px + 4.0) / 64.0))
    away = FOCAL_PX / size_px
    errors = []
    with Simulator(view({"body": at(SPHERE, 0.0, 0.0, away)}, size=pixels), gl) as simulator:
        for x, y in _PLACES:
            flux, middle = sphere_light(place(x, y, away), phase)
            image = light(simulator, view({"body": at(SPHERE, x, y, away)}, phase, pixels), 5)
            errors.append(np.hypot(*(centre_of_light(image) - middle)))
            assert image.sum() == pytest.approx(flux, rel=0.01)
    assert max(errors) < 0.02


@pytest.mark.parametrize(("size_px", "samples"), [(300.0, 16), (300.0, 40), (1000.0, 5)])
def test_the_centre_of_a_large_crescent_is_that_of_its_mesh(
    gl: moderngl.Context, size_px: float, samples: int
) -> None:
    """At a phase angle of 150 deg, with fewer samples than its limb needs, and half of these."""
    phase, pixels = np.radians(150.0), 64 * int(np.ceil((size_px + 4.0) / 64.0))
    away = FOCAL_PX / size_px
    with Simulator(view({"body": at(SPHERE, 0.0, 0.0, away)}, size=pixels), gl) as simulator:
        for x, y in _PLACES[:2]:
            flux, middle = facet_light(place(x, y, away), phase)
            image = light(simulator, view({"body": at(SPHERE, x, y, away)}, phase, pixels), samples)
            assert np.hypot(*(centre_of_light(image) - middle)) < 0.02
            assert image.sum() == pytest.approx(flux, rel=0.01)


@pytest.mark.parametrize("ramp", [0.0, 0.75])
@pytest.mark.parametrize("optics", [{}, {"distortion": {"k1": -0.05}}])
def test_a_crescent_shows_no_seams_between_its_finer_limb_and_the_rest(
    gl: moderngl.Context, ramp: float, optics: dict[str, object]
) -> None:
    """Its limb is drawn in boxes of more samples; a pixel's samples may lie in two of them."""
    phase, away, images = np.radians(150.0), FOCAL_PX / 100.0, []
    standing = view({"body": at(SPHERE, 0.29, -0.27, away)}, phase, 128, optics=optics)
    # So many samples serve the limb as well.
    for samples in (5, 192):
        scenario = replace(standing, samples_per_pixel=samples)
        with Simulator(scenario, gl) as simulator:
            still = simulator._still(scenario.at(scenario.epoch_tai_ns), "cam")
            images.append(still._with_ramps((ramp,) * 4).read()[..., 0].astype(np.float64))
    # Of a pixel on the limb 192 samples tell to some 2 % of its area, each of two images; where it
    # turns, with the slope of its light, that is three times as much. A seam is a pixel's light.
    assert np.abs(images[0] - images[1]).max() < 0.08 * images[1].max()


def _smooth_cosines(pixels: int, centre: Array, phase: float, finer: int = 4) -> Array:
    """(pixels, pixels) mean of the cosine of incidence on a sphere, 0 on its dark side."""
    steps = (np.arange(pixels * finer) + 0.5) / finer - 0.5 * pixels
    x, y = np.meshgrid(steps / FOCAL_PX, -steps / FOCAL_PX)
    rays = np.stack([x, y, -np.ones_like(x)], axis=-1)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    along = rays @ centre
    inside = along**2 - centre @ centre + RADIUS**2
    depth = along - np.sqrt(np.maximum(inside, 0.0))
    normal = (rays * depth[..., None] - centre) / RADIUS
    cosine = np.where(inside > 0.0, np.maximum(normal @ sun(phase), 0.0), 0.0)
    return np.asarray(cosine.reshape(pixels, finer, pixels, finer).mean(axis=(1, 3)))


def test_facets_that_sunlight_grazes_are_as_bright_as_the_sphere(gl: moderngl.Context) -> None:
    """A thousand pixels wide: a facet is 16 pixels long, and some lie along the light."""
    phase, pixels, away = np.radians(150.0), 1024, FOCAL_PX / 1000.0
    cosine = _smooth_cosines(pixels, place(0.5, 0.5, away), phase)
    body = {"body": at(SPHERE, 0.5, 0.5, away)}
    with Simulator(view(body, phase, pixels), gl) as simulator:
        image = light(simulator, view(body, phase, pixels), 20)
    # From 0.3 to 1.1 deg within the terminator.
    band = (cosine > 0.005) & (cosine < 0.02)
    wanted = IN_BANDS * ALBEDO / np.pi * cosine[band].sum()
    # Half a facet is 0.9 deg. Some 2700 pixels of 20 samples leave 0.3 %, five leave 0.8 %; where
    # facets along the light are black, more than 1 % of the band's light is missing.
    assert image[band].sum() == pytest.approx(wanted, rel=0.005)
