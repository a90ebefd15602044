"""What glossy surfaces show of their own spacecraft: a mirror image, and light from all around."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from benchmarks.truth.glossy_paths import GlossyPaths
from simgl.scenario.scenario import Scenario
from simgl.scene.materials import Material
from tests.radiosity.glossy_scenes import (
    ACROSS,
    BOX,
    PANEL,
    at_rest,
    dielectric,
    from_other_surfaces,
    inside,
    metal,
    panel_and_box,
    radiance_and_parts,
)
from tools.spacecraft_models.shapes import box

GLOW = 100.0  # [W m-2 sr-1]


def under_a_glowing_ceiling(glossy: Material, **render: bool) -> Scenario:
    """A panel 3 m under a plate of 120 m that gives off ``GLOW``, seen at 45 degrees."""
    glow = Material(name="glow", reflectance=(0.0,) * 4, emission=(GLOW,) * 4)
    camera = {**ACROSS, "position_icrf_m": [3.35, 0.0, 2.0], "boresight": [-2.0, 0.0, -2.0]}
    shapes = [
        (box("0", (1.6, 1.6, 0.02), (1.35, 0.0, -0.01)), 0),
        (box("1", (120.0, 120.0, 0.5), (0.0, 0.0, 3.25)), 1),
    ]
    return at_rest(shapes, (glossy, glow), (0.0, 0.0, -1.0), camera, dict(render))


@pytest.mark.parametrize(("glossy", "f0"), [(metal(0.02), 0.9), (dielectric(0.02), 0.04)])
def test_a_mirror_shows_what_is_before_it(
    gl: moderngl.Context, glossy: Material, f0: float
) -> None:
    light, _ = from_other_surfaces(gl, under_a_glowing_ceiling(glossy))
    fresnel = f0 + (1.0 - f0) * (1.0 - np.sqrt(0.5)) ** 5
    # Schlick's term over a lobe of 0.02 is that of its middle to 1e-3; the table of lobes to 5e-3.
    np.testing.assert_allclose(light[62:66, 62:66, 3].mean(), fresnel * GLOW, rtol=0.01)


@pytest.mark.parametrize("alpha", [0.05, 0.2, 0.4])
def test_uniform_light_is_reflected_as_if_it_were_not_followed(
    gl: moderngl.Context, alpha: float
) -> None:
    followed, part = from_other_surfaces(gl, under_a_glowing_ceiling(metal(alpha)))
    again, _ = from_other_surfaces(gl, under_a_glowing_ceiling(metal(alpha)))
    mean, _ = from_other_surfaces(
        gl, under_a_glowing_ceiling(metal(alpha), glossy_reflections=False)
    )
    np.testing.assert_array_equal(followed, again)
    panel = inside(part == PANEL)
    # The ceiling ends 3 degrees above the horizon: 0.3 % of the irradiance, and of a wide lobe's
    # light up to 1.5 %, are not there.
    np.testing.assert_allclose(followed[panel], mean[panel], rtol=0.02)


def test_a_mirror_image_is_what_a_camera_behind_the_mirror_sees(gl: moderngl.Context) -> None:
    # Above the panel's plane, so that the panel shades nothing; a dark one, whose own light on the
    # box does not count.
    sun = (0.99, 0.15, 0.02)
    light, part = from_other_surfaces(gl, panel_and_box(dielectric(0.02), sun=sun))
    x, y, z = ACROSS["position_icrf_m"]
    dx, dy, dz = ACROSS["boresight"]
    behind = {
        **ACROSS,
        "position_icrf_m": [x, y, -z],
        "boresight": [dx, dy, -dz],
        "up": [0.0, 0.0, -1.0],
    }
    alone = panel_and_box(dielectric(0.02), sun=sun, camera=behind, panel=False)
    image, _ = radiance_and_parts(gl, alone)
    image = image[:, ::-1]
    panel = inside(part == PANEL)
    wanted, shown = (values.sum(axis=2) * panel for values in (image, light))
    rows, columns = np.mgrid[0:128, 0:128]
    for places in (rows, columns):
        middles = [(v * places).sum() / v.sum() for v in (wanted, shown)]
        # A lobe of 0.02 spreads the image's edges by a pixel or two, more where it is farther away.
        assert abs(middles[1] - middles[0]) < 0.7
    bright = inside(inside(inside(wanted > 0.9 * wanted.max())))
    assert bright.sum() > 300
    scenario = panel_and_box(dielectric(0.02))
    camera = scenario.at(scenario.epoch_tai_ns).cameras["cam"]
    sight = camera.camera.rays(np.stack([columns + 0.5, rows + 0.5], axis=-1).reshape(-1, 2))
    sight /= np.linalg.norm(sight, axis=1, keepdims=True)
    cosine = -(sight @ camera.R_camera_from_icrf)[:, 2].reshape(rows.shape)
    fresnel = 0.04 + 0.96 * (1.0 - cosine) ** 5
    share = np.median(shown[bright] / (fresnel * wanted)[bright])
    # Of a lobe of 0.02 one per cent goes farther than 0.2, past the image's edges.
    np.testing.assert_allclose(share, 1.0, atol=0.03)


@pytest.mark.parametrize("glossy", [metal(0.2), dielectric(0.2)])
def test_a_lobe_gives_the_light_of_paths(gl: moderngl.Context, glossy: Material) -> None:
    scenario = panel_and_box(glossy)
    light, part = from_other_surfaces(gl, scenario)
    pixels = np.argwhere(inside(part == PANEL))
    state = scenario.at(scenario.epoch_tai_ns)
    paths, rng = GlossyPaths(state), np.random.default_rng(3)
    truth = paths.light(state.cameras["cam"], pixels[:, ::-1], 32, rng).sum()
    # 170,000 paths: 0.3 %. The panel's own light on the box is diffuse here: 3 % of metal's.
    np.testing.assert_allclose(light[pixels[:, 0], pixels[:, 1]].sum(), truth, rtol=0.05)
    assert (part == BOX).any()
