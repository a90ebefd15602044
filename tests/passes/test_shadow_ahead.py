"""Shadow maps of the Sun's next direction are drawn, a part in a frame, before it gets there."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.passes.mesh_store import MeshStore
from simgl.passes.outline_program import OutlineProgram
from simgl.passes.shadow import MAX_BYTES, ShadowPass, _atlas_bytes, _ShadowAtlas
from simgl.view.shadow_views import SIZES, ShadowMap, ShadowView
from tests.passes.shadow_scenes import sun_shadow
from tests.scenes import lambert, scene

# Steps of the grid of directions: 0.6 of the Sun's radius, rounded up by less than 4.4 %.
STEP = 0.6 * np.radians(0.263)
BOX = {"box": {"size_m": [1.0, 0.6, 0.4], "material": lambert(0.5)}}


def view_under(tilt: float, aside_m: float = 0.0) -> ShadowView:
    """Of a plate with a box above it, under a Sun tilted from the zenith [rad]."""
    scenario = scene(
        {
            "plate": {
                "model": {"plate": {"width_m": 2.0, "height_m": 2.0, "material": lambert(0.5)}},
                "position_icrf_m": [0.0, 0.0, 0.0],
            },
            "box": {"model": BOX, "position_icrf_m": [aside_m, 0.0, 1.0]},
        },
        {"position_icrf_m": [0.0, 0.0, 50.0], "boresight": [0, 0, -1], "up": [0, 1, 0]},
        sun_direction=(float(np.sin(tilt)), 0.0, float(np.cos(tilt))),
    )
    return sun_shadow(scenario, "plate")


@contextmanager
def shadows(gl: moderngl.Context) -> Iterator[ShadowPass]:
    meshes = MeshStore(gl)
    drawn = ShadowPass(gl, meshes)
    yield drawn
    drawn.release()
    meshes.release()


@pytest.fixture
def draws(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The casters that were drawn."""
    drawn: list[str] = []
    draw = OutlineProgram.draw

    def counted(self: OutlineProgram, model: Any) -> None:
        drawn.append(model.name)
        draw(self, model)

    monkeypatch.setattr(OutlineProgram, "draw", counted)
    return drawn


def frame(shadows: ShadowPass, view: ShadowView) -> list[bytes]:
    """Bytes of the maps."""
    (textures,) = shadows.cast([view])
    shadows.complete([view])
    return [texture.read() for texture in textures]


def test_the_next_direction_is_drawn_before_the_sun_gets_there_and_holds_the_same(
    gl: moderngl.Context, draws: list[str]
) -> None:
    near_edge, beyond = view_under(0.47 * STEP), view_under(0.6 * STEP)
    assert near_edge.wide.key != beyond.wide.key
    assert [one.key for one in near_edge.ahead()] == [beyond.wide.key]
    with shadows(gl) as one:
        each = []
        for _ in range(12):
            before = len(draws)
            frame(one, near_edge)
            each.append(len(draws) - before)
        # Two casters on three layers; the same again, a layer in a frame, and no more.
        assert each[0] == 6
        assert max(each[1:]) == 2
        assert sum(each[1:]) == 6
        drawn = len(draws)
        ahead = frame(one, beyond)
        assert len(draws) == drawn
    with shadows(gl) as other:
        assert frame(other, beyond) == ahead


def test_the_largest_maps_of_a_close_view_leave_room_for_those_ahead() -> None:
    largest = replace(view_under(0.0).wide, size=SIZES[-1])
    wide_and_close = _atlas_bytes((largest, largest))
    assert 2 * wide_and_close <= MAX_BYTES


def test_nothing_is_drawn_ahead_for_casters_that_move(
    gl: moderngl.Context, draws: list[str]
) -> None:
    with shadows(gl) as one:
        for index in range(10):
            frame(one, view_under(0.47 * STEP, aside_m=0.001 * index))
    assert len(draws) == 10 * 6


def test_the_textures_of_a_direction_that_the_sun_has_left_are_drawn_into_again(
    gl: moderngl.Context,
) -> None:
    """Over four directions two sets of textures take turns, and each holds what new ones would."""
    tilts = [(0.47 + step) * STEP for step in range(4)]
    textures = set()
    with shadows(gl) as one:
        for tilt in tilts:
            view = view_under(tilt)
            for _ in range(12):
                textures.add(one.cast([view])[0][0].glo)
                last = frame(one, view)
    assert len(textures) == 2
    with shadows(gl) as other:
        assert frame(other, view_under(tilts[-1])) == last


def test_the_textures_of_maps_that_are_asked_for_in_turn_stay_theirs(gl: moderngl.Context) -> None:
    """Two scenes under different Suns; both go on to another direction."""
    first, second = view_under(0.47 * STEP), view_under(20.47 * STEP)
    with shadows(gl) as one:
        before = [one.cast([view])[0][0].glo for view in (first, second)]
        for _ in range(20):
            for view in first, second:
                frame(one, view)
        assert [one.cast([view])[0][0].glo for view in (first, second)] == before


def test_casters_that_move_have_two_sets_of_textures_in_turn(gl: moderngl.Context) -> None:
    """No image waits for fresh memory to be cleared, and each holds what new ones would."""
    views = [view_under(0.0, aside_m=0.001 * index) for index in range(6)]
    with shadows(gl) as one:
        textures = []
        for view in views:
            last = frame(one, view)
            textures.append(one.cast([view])[0][0].glo)
    assert len(set(textures)) == 2
    with shadows(gl) as other:
        assert frame(other, views[-1]) == last


def test_maps_that_come_back_in_turn_are_drawn_twice_at_most(
    gl: moderngl.Context, draws: list[str]
) -> None:
    views = [view_under(0.0, aside_m=0.001 * index) for index in range(5)]
    with shadows(gl) as one:
        each = []
        for _ in range(4):
            before = len(draws)
            for view in views:
                frame(one, view)
            each.append(len(draws) - before)
    # Two casters on three layers.
    assert each[0] == 5 * 6
    assert each[1] <= 5 * 6
    assert each[2:] == [0, 0]


def test_textures_of_several_sizes_are_drawn_into_again(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Images far apart in time, each of maps of two sizes under a Sun of its own."""
    made = []

    class Counted(_ShadowAtlas):
        def __init__(self, ctx: moderngl.Context, maps: Sequence[ShadowMap]) -> None:
            super().__init__(ctx, maps)
            made.append(self.sizes)

    def maps_of(step: int) -> tuple[ShadowView, ShadowView]:
        view = view_under((0.47 + step) * STEP)
        return view, replace(view, wide=replace(view.wide, size=SIZES[0], key=b"%d" % step))

    monkeypatch.setattr("simgl.passes.shadow._ShadowAtlas", Counted)
    of_image = sum(_atlas_bytes(view.maps) for view in maps_of(0))
    monkeypatch.setattr("simgl.passes.shadow.MAX_BYTES", 3 * of_image - 1)
    with shadows(gl) as one:
        for step in range(9):
            one.cast(maps_of(step))
    # Of the third image the second maps evict larger ones, which the fourth takes over.
    assert len(made) <= 6
