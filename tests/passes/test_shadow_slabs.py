"""Both depths of the slabs in one texture: what its parts hold, and a search finds the same."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array32
from simgl.gpu.release import release_all
from simgl.passes.mesh_store import MeshStore
from simgl.passes.shadow import ShadowPass
from simgl.passes.sunlight import SunlightPass
from simgl.scenario.scenario import Scenario
from simgl.simulator import Product, Simulator
from tests.passes.shadow_scenes import sun_shadow
from tests.scenes import lambert, scene


def _close_scene(seed: int) -> Scenario:
    """A plate, far larger than the image, and boxes at random over it under a Sun at random."""
    rng = np.random.default_rng(seed)
    bodies = {
        "plate": {
            "model": {"plate": {"width_m": 8.0, "height_m": 8.0, "material": lambert(0.5)}},
            "position_icrf_m": [0.0, 0.0, 0.0],
        }
    }
    tilt, turn = rng.uniform(0.3, 0.8), rng.uniform(-np.pi, np.pi)
    towards = np.array([np.cos(turn), np.sin(turn)])
    for number in range(6):
        # Aside of the line of sight, the shadow in the image.
        height = rng.uniform(0.3, 1.6)
        across = height * np.tan(tilt) * towards + rng.uniform(-0.07, 0.07, 2)
        size = rng.uniform(0.01, 0.12, 3)
        bodies[f"box_{number}"] = {
            "model": {"box": {"size_m": size.tolist(), "material": lambert(0.5)}},
            "position_icrf_m": [*across.tolist(), height],
        }
    x, y = (np.sin(tilt) * towards).tolist()
    sun = x, y, float(np.cos(tilt))
    camera = {"position_icrf_m": [0.0, 0.0, 2.0], "boresight": [0, 0, -1], "up": [0, 1, 0]}
    return scene(bodies, camera, sun_direction=sun)


def _depths(texture: moderngl.Texture) -> Array32:
    return np.frombuffer(texture.read(), "<f4").reshape(texture.height, texture.width)


def test_a_texel_of_the_slabs_holds_both_depths_of_its_place(gl: moderngl.Context) -> None:
    view = sun_shadow(_close_scene(1), "plate")
    assert view.close is not None
    meshes = MeshStore(gl)
    shadows = ShadowPass(gl, meshes)
    ((depths, _, _, _, slabs, _),) = shadows.cast([view])
    shadows.complete([view])
    near = _depths(depths)
    together = np.frombuffer(slabs.read(), "<f4").reshape(slabs.height, slabs.width, 2)
    column = 0
    for one in view.maps:
        here = slice(0, one.size), slice(column, column + one.size)
        # A step of 24-bit depth by the read-back.
        for channel, expected in enumerate((near[here], near[one.size : 2 * one.size, here[1]])):
            np.testing.assert_allclose(together[here][..., channel], expected, atol=6e-8)
            assert expected.min() < expected.max()
        column += one.size
    release_all(gl, shadows, meshes)


@pytest.mark.parametrize("seed", [0, 2, 3, 5])
def test_a_search_in_the_slabs_finds_what_one_in_the_depths_finds(
    gl: moderngl.Context, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = _close_scene(seed)
    assert sun_shadow(scenario, "plate").close is not None
    look_for_the_rest = SunlightPass._look_for_the_rest
    ways: list[tuple[str, ...]] = []

    def radiance(way: tuple[str, ...] | None) -> Array32:
        def look(self: SunlightPass, points: object, search: tuple[str, ...], rest: object) -> None:
            ways.append(search)
            look_for_the_rest(self, points, search if way is None else way, rest)  # type: ignore[arg-type]

        with monkeypatch.context() as patch, Simulator(scenario, gl) as simulator:
            patch.setattr(SunlightPass, "_look_for_the_rest", look)
            state = scenario.at(scenario.epoch_tai_ns)
            frame = simulator.capture(state, "cam", {Product.RADIANCE}).radiance
            assert frame is not None
            return frame.radiance

    in_slabs, in_depths = radiance(None), radiance(("SEARCH",))
    assert ("SEARCH", "SLABS") in ways
    # These seeds put much penumbra into the image: the search decides.
    lit = in_slabs[..., 0] / in_slabs[..., 0].max()
    assert np.mean((lit > 0.02) & (lit < 0.98)) > 0.02
    np.testing.assert_array_equal(in_slabs, in_depths)
