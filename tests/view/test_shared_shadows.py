"""Which snapshots of a turning spacecraft share a shadow map, and how far its light leans there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.view.exposure_parts import LARGEST_LEAN, MovingScene, moving_scene
from simgl.view.image_motion import turn_of_bodies
from simgl.view.shadow_views import ShadowView
from simgl.view.spacecraft_view import ShadowsOf, spacecraft_views
from tests.simulator.blurred_scenes import before
from tests.simulator.moving_scenes import BOX
from tests.simulator.test_blurred_turns import OBLIQUE, turning


def turns(angle_deg: float) -> MovingScene:
    one = before({}, {"craft": BOX})
    moving = moving_scene(one.at(one.epoch_tai_ns), "cam", turning(one, angle_deg, OBLIQUE))
    assert moving is not None
    return moving


@pytest.mark.parametrize(("count", "maps"), [(2, 1), (3, 2), (6, 2), (9, 2)])
def test_snapshots_of_ten_degrees_to_either_side_share_a_map(count: int, maps: int) -> None:
    """Of 30 deg (20 for two): as many as whole snapshots allow."""
    moving = replace(turns(20.0 if count == 2 else 30.0), count=count)
    drawn_for = set()
    for (part,) in moving.snapshots():
        assert part.shadows is not None
        drawn_for.add(part.shadows.tai_ns)
        assert part.shadow_turn <= LARGEST_LEAN + 1e-6
        for end in (part.first, part.last):
            assert turn_of_bodies(part.shadows, end) <= part.shadow_turn + 1e-6
    assert len(drawn_for) == maps


@pytest.mark.parametrize("angle_deg", [1.0, 10.0])
def test_maps_of_shadows_that_a_turn_blurs_have_fewer_texels(angle_deg: float) -> None:
    """About half as many along an edge; of a turn by twice the Sun's width they have all."""
    (part,) = next(iter(replace(turns(angle_deg), count=1).snapshots()))

    def texels(while_open: float) -> int:
        shadows = ShadowsOf(
            state=part.state,
            camera=part.camera_of(part.state),
            turn=part.shadow_turn,
            while_open=while_open,
        )
        camera = part.camera_of(part.state)
        d = camera.camera.detector
        near = replace(camera.camera, detector=replace(d, pixel_pitch=d.pixel_pitch / 3.0))
        (view,) = spacecraft_views(
            part.state, replace(camera, camera=near), inter_reflection=False, shadows=shadows
        )
        assert isinstance(view.shadow, ShadowView)
        return sum(one.size**2 for one in view.shadow.maps)

    assert part.turn_while_open == pytest.approx(np.radians(angle_deg), rel=1e-3)
    if angle_deg < 2.0:
        assert texels(part.turn_while_open) == texels(0.0)
    else:
        assert texels(part.turn_while_open) < 0.5 * texels(0.0)
