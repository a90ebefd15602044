"""Shadow maps serve many frames: what they hold changes with what they show, not with rounding."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState, SunAtPosition, SunInDirection
from simgl.view.shadow_views import SIZES, ShadowView, shadow_view
from tests.scenes import lambert, scene

Array = np.ndarray[Any, np.dtype[np.float64]]

SUN_RADIUS = np.radians(0.263)
AU = 1.495978707e11


def _scenario() -> Scenario:
    """A plate, seen closely, a box that shades it and one that stands aside of what is seen."""
    box = {"box": {"size_m": [0.2, 0.2, 0.2], "material": lambert(0.5)}}
    return scene(
        {
            "plate": {
                "model": {"plate": {"width_m": 8.0, "height_m": 8.0, "material": lambert(0.5)}},
                "position_icrf_m": [0.0, 0.0, 0.0],
            },
            "box": {"model": box, "position_icrf_m": [0.1, 0.0, 0.5]},
            "aside": {"model": box, "position_icrf_m": [3.0, 0.0, 0.5]},
        },
        {"position_icrf_m": [0.0, 0.0, 2.0], "boresight": [0, 0, -1], "up": [0, 1, 0]},
    )


def _view(
    state: SceneState,
    sun: Array,
    sunlit: bool = True,
    samples_per_pixel: float | None = None,
    **moved: Array,
) -> ShadowView:
    """Of the plate, under a Sun in a direction, with bodies moved [m]."""
    assert isinstance(state.sun, SunInDirection)
    place = SunAtPosition(
        position=AU * sun / np.linalg.norm(sun),
        light_at_1_au=state.sun.light,
        radius=AU * np.sin(SUN_RADIUS),
    )
    bodies = {
        name: replace(
            body, pose=replace(body.pose, position=body.pose.position + moved.get(name, 0.0))
        )
        for name, body in state.bodies.items()
    }
    camera = state.cameras["cam"]
    matrix = np.eye(4)
    matrix[:3, :3] = camera.R_camera_from_icrf.T
    matrix[:3, 3] = camera.position - bodies["plate"].pose.position
    state = replace(state, sun=place, bodies=bodies)
    seen = state.direct_light(bodies["plate"].pose.position).main
    if not sunlit:
        seen = replace(seen, irradiance=np.zeros(4))
    return shadow_view(
        state,
        bodies["plate"],
        camera.camera,
        seen,
        matrix,
        samples_per_pixel=samples_per_pixel,
    )


def _state() -> SceneState:
    scenario = _scenario()
    return scenario.at(scenario.epoch_tai_ns)


def test_a_suns_direction_leans_little_against_its_maps_and_both_give_it_back() -> None:
    """Half a diagonal of a cell 0.6 Sun's radii wide; its coarse radius is 4.4 % larger at most."""
    state = _state()
    rng = np.random.default_rng(5)
    for direction in rng.normal(size=(300, 3)):
        if direction[2] > 0.0:
            view = _view(state, direction)
            lean = np.linalg.norm(view.lean) / np.tan(SUN_RADIUS)
            assert lean < 1.044 * 0.6 / np.sqrt(2.0) * 1.001
            # Light axes, and the lean in them, give the direction back.
            towards = view.R_light_from_body.T @ np.append(view.lean, 1.0)
            off = np.cross(towards, direction) / np.linalg.norm(towards)
            # float32: 6e-8 for each of some products.
            assert np.linalg.norm(off) / np.linalg.norm(direction) < 5e-7


def test_maps_stay_while_the_sun_moves_within_a_cell_of_the_grid() -> None:
    state = _state()
    first = _view(state, np.array([0.001, -0.001, 1.0]))
    second = _view(state, np.array([-0.0005, 0.001, 1.0]))
    assert [m.key for m in first.maps] == [m.key for m in second.maps]
    assert not np.array_equal(first.lean, second.lean)


def test_maps_stay_under_the_rounding_of_an_orbit_and_the_suns_changing_distance() -> None:
    state = _state()
    rounding = np.array([1e-9, -1e-9, 1e-9])
    # On an orbit the Sun's distance changes by 5e-5 of itself, in a day by 3e-4.
    for distance in (1.0, 1.0 + 5e-5, 1.0 - 3e-4):
        nearer = np.array([0.0, 0.0, AU * (1.0 - distance)])
        shifted = {name: nearer + rounding * (name != "plate") for name in state.bodies}
        camera = replace(state.cameras["cam"], position=state.cameras["cam"].position + nearer)
        moved = replace(state, cameras={"cam": camera})
        keys = [m.key for m in _view(moved, np.array([0.0, 0.0, 1.0]), **shifted).maps]
        assert keys == [m.key for m in _view(state, np.array([0.0, 0.0, 1.0])).maps]


def test_only_what_casts_into_a_map_is_drawn_there() -> None:
    state = _state()
    sun = np.array([0.0, 0.0, 1.0])
    view = _view(state, sun)
    assert view.close is not None
    assert len(view.wide.casters) == 3
    # The plate, and the box over it; the other one's shadow falls 3 m aside.
    assert len(view.close.casters) == 2
    moved = _view(state, sun, aside=np.array([0.1, 0.0, 0.3]))
    assert moved.close is not None
    assert moved.close.key == view.close.key
    assert moved.wide.key != view.wide.key


def test_maps_are_finer_only_where_a_scenario_asks_for_many_samples() -> None:
    up = np.array([0.0, 0.0, 1.0])
    automatic, many, most = (_view(_state(), up, samples_per_pixel=n) for n in (None, 64.0, 256.0))
    assert [m.key for m in automatic.maps] == [m.key for m in many.maps]
    # Twice as many samples along an edge, but for the steps of the sizes.
    assert most.maps[-1].texel <= 0.55 * automatic.maps[-1].texel


def test_what_no_sunlight_reaches_has_one_small_map_without_casters() -> None:
    up = np.array([0.0, 0.0, 1.0])
    assert _view(_state(), up).wide.casters
    dark = [_view(_state(), up, sunlit=False, box=np.array([x, 0.0, 0.0])) for x in (0.0, 0.1)]
    assert [(v.wide.casters, v.wide.size, v.close) for v in dark] == [((), SIZES[0], None)] * 2
    # Whatever moves, nothing is drawn anew.
    assert dark[0].wide.key == dark[1].wide.key
