"""Pictures of light between surfaces: the open box, and a ball that must have none."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from simgl.scenario.scenario import Scenario
from simgl.scene.mesh import sphere
from simgl.scene.spacecraft import SpacecraftModel
from tests.radiosity.boxes import C6, at_rest, c6_scene, floor_means, white
from tests.scenes import IN_BANDS, radiance


def floor(gl: moderngl.Context, *, on: bool) -> dict[str, float]:
    # All bands have one reflectance: their sum scales with the irradiance in them.
    return floor_means(radiance(gl, c6_scene(0.8, on=on)).sum(axis=2) * (1367.0 / IN_BANDS))


@pytest.mark.parametrize("by_compute", [False, True])
def test_the_picture_of_the_open_box_has_the_floor_of_all_bounces(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, by_compute: bool
) -> None:
    monkeypatch.setattr("simgl.passes.interreflection.prefers_compute", lambda _: by_compute)
    found = floor(gl, on=True)
    np.testing.assert_allclose(found["shadow"], C6[0]["shadow"], rtol=0.05)
    np.testing.assert_allclose(found["lit"], C6[0]["lit"], rtol=0.05)


def test_without_inter_reflection_the_shadow_is_black(gl: moderngl.Context) -> None:
    found = floor(gl, on=False)
    assert found["shadow"] == 0.0
    np.testing.assert_allclose(found["lit"], C6[1]["lit"], rtol=1e-3)


def two_sided_ball(*, on: bool) -> Scenario:
    """A ball of double-sided facets, seen from behind the Sun's side but for a crescent."""
    model = SpacecraftModel(
        name="ball",
        mesh=sphere(1.0, 96),
        parts=("ball",),
        materials=tuple(white(0.8, 1)),
        open_sheets=True,
    )
    return at_rest(model, 0.0, 0.0, (0.8, 0.0, -0.6), on=on)


@pytest.mark.parametrize("by_compute", [False, True])
def test_the_shadow_side_of_a_two_sided_ball_is_dark(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, by_compute: bool
) -> None:
    monkeypatch.setattr("simgl.passes.interreflection.prefers_compute", lambda _: by_compute)
    found, plain = (radiance(gl, two_sided_ball(on=on)) for on in (True, False))
    assert plain.max() > 1.0
    assert found[:, :64].max() == 0.0
    np.testing.assert_array_equal(found, plain)
