"""Levels of the Earth's maps: means of the map itself, in sizes that OpenGL asks for."""

from __future__ import annotations

import resource

import moderngl
import numpy as np
import pytest

from simgl.arrays import Image8
from simgl.gpu.context import is_software, temporary_context
from simgl.passes.background.cloud_map import weather_levels
from simgl.passes.background.map_levels import level_texture, map_levels, map_texture, size_of
from tests.gpu.osmesa import needs_osmesa

FULL = """
#version 330 core
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }
"""
LEVEL = """
#version 330 core
uniform sampler2D map;
uniform float level;
out vec4 colour;
void main() { colour = textureLod(map, vec2(0.5), level); }
"""


def seen(ctx: moderngl.Context, texture: moderngl.Texture, level: int) -> list[int]:
    """Codes in the middle of a level, as a shader reads it."""
    program, target = ctx.program(FULL, LEVEL), ctx.texture((1, 1), 4)
    framebuffer, array = ctx.framebuffer([target]), ctx.vertex_array(program, [])
    program["level"] = level
    with ctx.scope(framebuffer):
        texture.use(0)
        array.render(moderngl.TRIANGLES, vertices=3)
    codes = list(target.read())
    for made in (array, framebuffer, target, program):
        made.release()
    return codes


@pytest.fixture
def noisy() -> Image8:
    """Odd in its third level."""
    return np.random.default_rng(1).integers(60, 200, (300, 600, 2), dtype=np.uint8)


def test_levels_halve_down_to_one_texel(noisy: Image8) -> None:
    sizes = [codes.shape[:2] for codes in map_levels(noisy)]
    assert sizes[:4] == [(300, 600), (150, 300), (75, 150), (37, 75)]
    assert sizes[-2:] == [(1, 2), (1, 1)]


def test_no_level_drifts_from_the_mean_of_the_map(noisy: Image8) -> None:
    # A level leaves out a row or a column of an odd one at most; what its one rounding adds is
    # uniform over a code, and halves with the square root of the number of texels.
    mean = noisy.mean(axis=(0, 1))
    for codes in map_levels(noisy):
        texels = codes[..., 0].size
        assert np.abs(codes.mean(axis=(0, 1)) - mean).max() < 5.0 * np.sqrt(1.0 / 12.0 / texels)


def reflected(codes: Image8) -> float:
    """Mean reflectance of clouds for light from all sides, by two streams."""
    share, thickness = codes[..., 0] / 255.0, 100.0 ** (codes[..., 1] / 255.0)
    return float(np.mean(share * thickness / (thickness + 4.0 / (3.0 * (1.0 - 0.85)))))


def test_clouds_reflect_as_much_in_pixels_of_any_size() -> None:
    """Thick cloud where there is much of it, as in storms, between thin scattered ones."""
    noise = np.random.default_rng(2).normal(size=(256, 512))
    codes = np.zeros((256, 512, 4), dtype=np.uint8)
    codes[..., 0] = np.clip(80.0 + 110.0 * noise, 0.0, 255.0)
    codes[..., 1] = np.clip(60.0 + 70.0 * noise, 0.0, 255.0)
    levels = weather_levels(codes)
    # By means of cover and of thickness each for itself 30 % are lost.
    assert reflected(map_levels(codes)[5]) < 0.75 * reflected(codes)
    for level in levels[1:6]:
        # Codes are rounded to a step: 0.9 % of a thickness, at most 0.4 % of a texel's reflectance.
        assert reflected(level) == pytest.approx(reflected(codes), rel=3e-3)
    for level, means in zip(levels, map_levels(codes), strict=True):
        np.testing.assert_array_equal(level[..., [0, 2, 3]], means[..., [0, 2, 3]])


def test_places_without_cloud_have_a_code_of_thickness() -> None:
    codes = np.full((4, 8, 4), 40, dtype=np.uint8)
    codes[..., 0] = 0
    for level in weather_levels(codes):
        np.testing.assert_array_equal(level[..., 1], 40)


@pytest.mark.parametrize("backend", ["egl", pytest.param("osmesa", marks=needs_osmesa)])
def test_a_shader_reads_the_levels_that_were_given(backend: str) -> None:
    levels = tuple(np.full((8 >> k, 16 >> k, 3), 10 * k + 5, dtype=np.uint8) for k in range(4))
    with temporary_context(backend) as ctx:
        texture, alone = map_texture(ctx, levels), level_texture(ctx, levels, 2)
        assert [seen(ctx, texture, k)[:3] for k in range(4)] == [[10 * k + 5] * 3 for k in range(4)]
        # There is no other level, and none is asked for that was not given.
        assert seen(ctx, texture, 7)[:3] == [35] * 3
        assert seen(ctx, alone, 0)[:3] == [25] * 3
        assert ctx.error == "GL_NO_ERROR"
        texture.release()
        alone.release()


def test_a_software_renderer_takes_the_memory_of_a_map_once() -> None:
    levels = map_levels(np.zeros((2048, 4096, 4), dtype=np.uint8))
    with temporary_context("egl") as ctx:
        if not is_software(ctx):
            pytest.skip("a graphics card has memory of its own")
        before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
        texture = map_texture(ctx, levels)
        pages = resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before
        texture.release()
    assert pages * resource.getpagesize() < 1.5 * size_of(levels)
