"""Light on patches: all bounces between them, lamps, and the sky."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

from simgl.arrays import Array32
from simgl.radiosity.hemisphere import SKY_CELLS
from simgl.radiosity.lamp_light import LampLight, SpotLight
from simgl.radiosity.precomputed_response import PrecomputedResponse
from simgl.radiosity.solver import (
    RESIDUAL,
    Blocker,
    radiosity,
    reflectors,
)
from simgl.radiosity.sunlit_patches import SunlitPatches
from simgl.rays import RayTracer
from simgl.scene.mesh import plate
from tests.radiosity.boxes import C6, box_faces, closed_box, inside, open_box, sunlight, white


@pytest.mark.parametrize("albedo", [0.0, 0.5, 0.8, 0.95])
def test_a_closed_cavity_fills_with_its_emission_over_one_minus_albedo(albedo: float) -> None:
    transport = closed_box()
    surface = reflectors(transport, white(albedo, emission=2.0))
    inner = radiosity(transport, surface, surface.exitance)[inside(transport)]
    # The iteration stops at 1e-3 of what one bounce leaves; float32 rounds far below.
    np.testing.assert_allclose(inner, np.pi * 2.0 / (1.0 - albedo), rtol=2e-3)


@pytest.mark.parametrize("bounces", [1, 2, 3, 0], ids=["direct", "two", "three", "all"])
def test_the_open_box_has_the_radiance_of_every_bounce(bounces: int) -> None:
    transport = open_box()
    surface = reflectors(transport, white(0.8))
    irradiance = sunlight(transport)
    if bounces:
        first = exitance = surface.albedo * irradiance
        for _ in range(bounces - 1):
            exitance = first + surface.albedo * (transport.form_factors @ exitance)
    else:
        exitance = radiosity(transport, surface, surface.albedo * irradiance)
    for name, patches in box_faces(transport).items():
        area = transport.areas[patches]
        found = float((area * exitance[patches, 0]).sum() / area.sum() / np.pi)
        # The table is good to 0.2 %; faces send 100,000 rays, and 8 sample points a patch place the
        # shadow's edge to a tenth of a patch, 4 mm of the 2 m floor: below 1 %.
        np.testing.assert_allclose(found, C6[bounces][name], rtol=0.02, atol=0.3, err_msg=name)


def test_few_bounces_are_summed_where_light_dies_out_fast() -> None:
    """Pairs of patches, the first far larger: the other fills 1e-4 of its view, it fills 0.9 of the
    other's. Light that has come back is less by 0.8^2 9e-5: a geometric series."""
    box = open_box()
    count = len(box.areas)
    first = np.arange(0, count - 1, 2)
    entries = np.concatenate([np.full(len(first), 1e-4), np.full(len(first), 0.9)])
    place = np.concatenate([first, first + 1]), np.concatenate([first + 1, first])
    factors = sparse.csc_matrix((entries.astype(np.float32), place), shape=(count, count))
    transport = replace(box, form_factors=factors)
    surface = reflectors(transport, white(0.8))
    # The spectral radius, but for rounding; what single bounces leave bounds it by 0.0099.
    assert surface.contraction == pytest.approx(0.8 * np.sqrt(9e-5), rel=1e-5)
    emitted = np.ones((count, 4), dtype=np.float32)
    expected = emitted[:-1].copy()
    expected[::2] += 0.8 * 1e-4 * (1.0 + 0.8 * 0.9)
    expected[1::2] += 0.8 * 0.9 * (1.0 + 0.8 * 1e-4)
    expected = 1.0 + (expected - 1.0) / (1.0 - 0.8**2 * 9e-5)
    found = radiosity(transport, surface, emitted)[: len(expected)]
    bounced = 0.8 * 0.9
    np.testing.assert_allclose(found, expected, atol=RESIDUAL * bounced)


# Over the floor of the open box, towards it.
LAMP = SpotLight(
    place=np.array([1.0, 0.5, 0.9]),
    axis=np.array([0.0, 0.0, -1.0]),
    half_angle=0.2,
    edge=0.01,
    intensity=np.full(4, 10.0),
)


def test_a_lamp_lights_patches_by_the_inverse_square_within_its_cone() -> None:
    transport = open_box()
    found = LampLight(transport).irradiance(LAMP)
    points = transport.points
    offset = np.linalg.norm(points[..., :2] - [1.0, 0.5], axis=2)
    floor = inside(transport) & (transport.normals[:, 0, 2] > 0.9)
    lit = floor & (offset.max(axis=1) < 0.15)
    assert np.count_nonzero(lit) >= 4
    height = 0.9 - points[..., 2]
    expected = (height / np.hypot(height, offset) ** 3).mean(axis=1)
    # float32 places: 1e-7 of 1 m, three powers of it.
    np.testing.assert_allclose(found[lit], expected[lit], rtol=1e-5)
    distance = offset.min(axis=1)
    assert found[floor & (distance > 0.30)].max() == 0.0


def test_a_body_hides_a_lamp_from_before_it_and_not_from_behind() -> None:
    transport = open_box()
    square = plate(1.0, 1.0)

    def lit_past_a_square_at(height: float) -> Array32:
        other_from_body = np.eye(4)
        other_from_body[:3, 3] = (-1.0, -0.5, -height)  # over the lamp
        blocker = Blocker(
            tracer=RayTracer(square),
            other_from_body=other_from_body,
            centre=square.centre,
            radius=square.radius,
            hull=square.hull,
        )
        return LampLight(transport).irradiance(LAMP, [blocker])

    free = LampLight(transport).irradiance(LAMP)
    assert free.max() > 0.0
    np.testing.assert_array_equal(lit_past_a_square_at(0.95), free)
    # The lamp's own housing, within 1 cm.
    np.testing.assert_array_equal(lit_past_a_square_at(0.895), free)
    assert lit_past_a_square_at(0.5).max() == 0.0


def test_a_free_surface_under_a_uniform_sky_gets_pi_times_its_radiance() -> None:
    transport = open_box()
    sky = np.full((SKY_CELLS, 4), 3.0, dtype=np.float32)
    outer = ~inside(transport)
    response = PrecomputedResponse(
        transport, reflectors(transport, white(0.5)), SunlitPatches(transport)
    )
    # The outside of the box sees the sky with every ray; float32 sums.
    found = response.of_sky(sky)[outer]
    np.testing.assert_allclose(found, 0.5 * 3.0 * np.pi, rtol=1e-5)
