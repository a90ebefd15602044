"""Faces of a spacecraft's sky: fine where the Sun lights the Earth along its limb."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simgl.environment_map import cube_directions, draw_faces_out
from simgl.view.background import LIMB_TEXELS, SKY_TEXELS, sky_view
from tests.passes.earth_light_scenes import EARTH, PLACE, R, before, facing, sun_at
from tests.scenes import lambert


@pytest.mark.parametrize("zenith_deg", [99.5, 102.0, 104.0])
def test_all_sunlit_ground_lies_on_fine_faces(zenith_deg: float) -> None:
    """Seen from 400 km, whose horizon is 19.8 deg away, under a Sun 9 to 14 deg below nadir's."""
    ball = {"sphere": {"radius_m": 1.0, "material": lambert(1.0)}}
    in_body = cube_directions(64).reshape(-1, 3)
    coarse = 0
    for seed in range(12):
        turn = Rotation.random(random_state=seed)
        scenario = before(ball, turn, facing(0.0, 0.0), zenith_deg, earth=EARTH)
        state = scenario.at(scenario.epoch_tai_ns)
        sky = sky_view(state, "body", state.bodies["body"])
        assert sky is not None
        seen = turn.apply(in_body)
        along = seen @ PLACE
        root = along**2 - PLACE @ PLACE + R**2
        hits = (root > 0.0) & (along < 0.0)
        ground = PLACE + (-along - np.sqrt(np.maximum(root, 0.0)))[:, None] * seen
        sunlit = hits & (ground @ np.array(sun_at(zenith_deg)) > 0.0)
        assert sunlit.any()
        texels = np.repeat(sky.face_texels, len(in_body) // 6)
        assert np.all(texels[sunlit] == LIMB_TEXELS)
        coarse += sky.face_texels.count(SKY_TEXELS)
    # Nor are all fine: of six faces two or three see nothing of the lit limb.
    assert coarse >= 24


def test_a_coarse_face_fills_its_square() -> None:
    drawn = np.arange(6 * 4 * 4 * 4, dtype=np.float32).reshape(6, 4, 4, 4)
    whole = drawn.copy()
    draw_faces_out(whole, (4, 2, 1, 4, 4, 4))
    np.testing.assert_array_equal(whole[[0, 3, 4, 5]], drawn[[0, 3, 4, 5]])
    np.testing.assert_array_equal(whole[1, ::2, 1::2], drawn[1, :2, :2])
    np.testing.assert_array_equal(whole[1, 1::2, ::2], drawn[1, :2, :2])
    assert np.all(whole[2] == drawn[2, 0, 0])
