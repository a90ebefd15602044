"""Light of other surfaces by rays from every sample: the open box, and one craft lit by another."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.passes.reference_gather import _Cells, _evened
from simgl.radiosity.final_gather import Points
from simgl.scenario.scenario import Scenario
from tests.radiosity.boxes import C6, c6_scene, floor_means
from tests.scenes import IN_BANDS, TOTAL, lambert, radiance, scene

Table = dict[str, Any]
Image = np.ndarray[Any, np.dtype[np.float64]]

# C8: radiance of the shadow's core with all bounces, over a plate of 2 m x 2 m; by quadrature of
# form factors 2.84 without what the box's sides add. A plate of 20 m would have 3.47.
CORE = 2.86


def total(gl: moderngl.Context, scenario: Scenario) -> Image:
    """(height, width) radiance [W m-2 sr-1] of a grey scene under the whole Sun."""
    image = radiance(gl, scenario).astype(np.float64)
    return image.sum(axis=2) * (TOTAL / IN_BANDS)


def box_over_plate(gather: str, *, height: float = 0.5) -> Scenario:
    """C8 from afar: the camera sees 6 cm x 4 cm of the plate about the shadow's middle."""
    material = {"material": lambert(0.5)}
    return scene(
        {
            "plate": {
                "model": {"plate": {"width_m": 2.0, "height_m": 2.0, **material}},
                "position_icrf_m": [0.0, 0.0, 0.0],
            },
            "box": {
                "model": {"box": {"size_m": [0.29, 0.20, 0.30], **material}},
                "position_icrf_m": [0.0, 0.0, height + 0.15],
            },
        },
        {
            "position_icrf_m": [0.0, -8.0, 4.0],
            "boresight": [0.0, 8.0, -4.0],
            "up": [0.0, 0.0, 1.0],
            "focal_length_mm": 50.0,
            "pixel_pitch_um": 14.0,
            "width_px": 24,
            "height_px": 8,
        },
        render={"gather": gather, "samples_per_pixel": 16},
    )


def test_the_core_of_a_shadow_has_the_light_between_box_and_plate(gl: moderngl.Context) -> None:
    found = total(gl, box_over_plate("pixel"))
    # 192 pixels of 256 rays, a sixteenth of which meet the box's bottom: 3,000 paths, of which
    # each goes on to the plate and meets sunlight or the shadow there: 1.5 %, and 0.2 % in CORE.
    np.testing.assert_allclose(found.mean(), CORE, rtol=0.04)


def test_a_dark_shadow_is_even_to_a_ten_thousandth_of_sunlight(gl: moderngl.Context) -> None:
    """Of a box 1.4 m up a pixel's 256 rays meet three; those that go on are most of its error."""
    found = total(gl, box_over_plate("pixel", height=1.4))
    sunlit = TOTAL * 0.5 / np.pi
    # What counts as certain; without the mean of the cells around it would be 1.6e-4, and with the
    # rays of 3e-4 besides 2.7e-4. The light itself changes by less than 1 % of 1e-3 over 6 cm.
    assert found.mean() < 1e-3 * sunlit
    assert found.std() < 1e-4 * sunlit


def test_uncertain_light_is_evened_within_a_surface_and_not_across_an_edge() -> None:
    """A step 0.5 m high beside a wall, 9 x 8 cells of 4 points, each by chance with all or none."""
    rows, columns = 9, 8
    cell = np.repeat(np.arange(rows * columns), 4)
    column = cell % columns
    surface = np.select([column < 3, column < 6], [0, 1], 2)
    normals = np.array([[0, 0, 1], [0, 0, 1], [1, 0, 0]], dtype=np.float32)[surface]
    places = np.zeros((len(cell), 3), dtype=np.float32)
    places[surface == 1, 2] = 0.5
    points = Points(places=places, normals=normals, facets=normals, spread=np.zeros((len(cell), 2)))
    levels = np.array([1.0, 10.0, 100.0])[surface]
    chance = np.where(np.random.default_rng(5).random(len(cell)) < 0.5, 2.0, 0.0)
    light = np.repeat((levels * chance)[:, None], 4, axis=1).astype(np.float32)
    cells = _Cells(shape=(rows, columns), of_point=cell, group=np.arange(len(cell)) % 4)
    uncertain = np.flatnonzero(column != 0)
    found = _evened(light, points, cells, uncertain, 0.1)
    np.testing.assert_array_equal(found[column == 0], light[column == 0])
    inner = (column != 0) & (cell // columns > 0) & (cell // columns < rows - 1)
    for level in (1.0, 10.0, 100.0):
        share = found[inner & (levels == level), 0] / level
        # Means of at least 6 cells of 4 points, each 0 or 2: sigma 0.2, and 3.5 of them.
        np.testing.assert_allclose(share, 1.0, atol=0.72)
        np.testing.assert_allclose(share.mean(), 1.0, atol=0.2)


def test_vertex_light_stays_within_a_spacecraft(gl: moderngl.Context) -> None:
    assert total(gl, box_over_plate("vertex")).max() == 0.0


def test_a_craft_that_is_far_away_gives_no_light(gl: moderngl.Context) -> None:
    """A box of 0.2 m at 300 m covers 2e-7 of the sky; only its penumbra is on the plate."""
    found = total(gl, box_over_plate("pixel", height=300.0))
    plain = total(gl, box_over_plate("vertex", height=300.0))
    assert plain.min() > 0.0
    np.testing.assert_array_equal(found, plain)


@pytest.mark.parametrize("reflectance", [0.8])
def test_the_open_box_has_the_floor_of_all_bounces(
    gl: moderngl.Context, reflectance: float
) -> None:
    scenario = replace(c6_scene(reflectance, on=True), gather="pixel")
    found = floor_means(total(gl, scenario))
    np.testing.assert_allclose(found["shadow"], C6[0]["shadow"], rtol=0.025)
    np.testing.assert_allclose(found["lit"], C6[0]["lit"], rtol=0.01)


def test_the_same_frame_has_the_same_bits(gl: moderngl.Context) -> None:
    first, second = (total(gl, box_over_plate("pixel")) for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_a_free_plate_over_the_earth_keeps_all_of_its_light(gl: moderngl.Context) -> None:
    """Beside a box that is too low to hide anything: the share of rays that pass is exactly one."""
    earth = {"shape": "sphere", "radius_km": 6371.0, "albedo": 0.3, "atmosphere": "none"}
    craft = {
        "plate": {
            "model": {"plate": {"width_m": 1.0, "height_m": 1.0, "material": lambert(0.5)}},
            "position_icrf_m": [0.0, 0.0, 6_771_000.0],
            "quaternion_icrf_from_body_xyzw": [1.0, 0.0, 0.0, 0.0],
        },
        "box": {
            "model": {"box": {"size_m": [0.3, 0.3, 0.3], "material": lambert(0.5)}},
            "position_icrf_m": [0.0, 0.0, 6_771_003.0],
        },
    }
    camera = {
        "position_icrf_m": [0.0, 0.0, 6_770_990.0],
        "boresight": [0.0, 0.0, 1.0],
        "up": [0.0, 1.0, 0.0],
        "focal_length_mm": 50.0,
        "width_px": 16,
        "height_px": 16,
    }
    by = {
        gather: scene(craft, camera, earth=earth, render={"gather": gather, "samples_per_pixel": 8})
        for gather in ("pixel", "vertex")
    }
    found, plain = (radiance(gl, by[gather]) for gather in ("pixel", "vertex"))
    assert plain.min() > 0.0
    np.testing.assert_array_equal(found, plain)
