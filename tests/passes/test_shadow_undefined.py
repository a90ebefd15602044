"""Images depend on nothing that the textures of shadow maps held before them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import moderngl
import numpy as np
import pytest

from simgl.passes.shadow import ShadowPass, _ShadowAtlas
from simgl.scenario.scenario import Scenario
from tests.passes.thin_casters import sun_directions, thin_scenes
from tests.scenes import lambert, radiance, scene

BOX = {"box": {"size_m": [1.0, 0.6, 0.4], "material": lambert(0.5)}}


def boxes() -> Scenario:
    """One below another, in whose shadow a part of it lies."""
    return scene(
        {
            "target": {"model": BOX, "position_icrf_m": [0.0, 0.0, 0.0]},
            "box": {"model": BOX, "position_icrf_m": [0.3, 0.0, 1.0]},
        },
        {
            "position_icrf_m": [3.0, 2.0, 10.0],
            "look_at": "target",
            "up": [0.0, 1.0, 0.0],
            "width_px": 64,
            "height_px": 64,
            "focal_length_px": 300.0,
        },
        sun_direction=(0.3, 0.2, 1.0),
        render={"samples_per_pixel": 5},
    )


def sheets_from_close() -> Scenario:
    """With a close map."""
    one = thin_scenes()["open box from 5 cm"]
    return replace(one, width_px=48).scenario(sun_directions(1)[0])


def fill(atlas: _ShadowAtlas, value: float) -> None:
    """Every texture with a value, depths with the nearest."""
    for texture in atlas.textures[2:]:
        count = texture.width * texture.height * texture.components
        texture.write(np.full(count, value, dtype=f"<{texture.dtype}").tobytes())
    for target in (atlas.depths, atlas.behind):
        ShadowPass.open_sheets.apply(target.ctx, target, (0, 0, *target.size))
        target.clear(depth=0.0)


@pytest.mark.parametrize("make_scene", [boxes, sheets_from_close])
def test_what_textures_held_before_is_not_read(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, make_scene: Callable[[], Scenario]
) -> None:
    """Parts of them are not drawn: slopes beside sheets, and what only a close map needs."""
    scenario = make_scene()
    clean = radiance(gl, scenario)
    make, filled = _ShadowAtlas.__init__, list[_ShadowAtlas]()
    for value in (-1e4, 1e4, np.nan):
        filled.clear()

        def made(self: _ShadowAtlas, *given: object, value: float = value) -> None:
            make(self, *given)  # type: ignore[arg-type]
            fill(self, value)
            filled.append(self)

        monkeypatch.setattr(_ShadowAtlas, "__init__", made)
        np.testing.assert_array_equal(radiance(gl, scenario), clean)
        assert filled
