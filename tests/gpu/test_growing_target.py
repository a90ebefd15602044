"""Targets that grow with what is drawn."""

from __future__ import annotations

import moderngl

from simgl.gpu.render_targets import GrowingTarget, textures_of


def test_a_target_takes_the_size_of_a_depth_buffer_that_has_grown_with_others(
    gl: moderngl.Context,
) -> None:
    """A radiance image of a close spacecraft, then the layers of one farther away."""
    others, layers = GrowingTarget(gl, [[0]]), GrowingTarget(gl, [[0, 1]])
    others.covering((600, 300))
    depth = others.covering((300, 600))[0].depth_attachment
    assert isinstance(depth, moderngl.Renderbuffer)
    (framebuffer,) = layers.covering((100, 100), depth)
    assert [texture.size for texture in textures_of(framebuffer)] == [(768, 768)] * 2
    assert layers.covering((700, 700), depth)[0] is framebuffer
    layers.release()
    others.release()
