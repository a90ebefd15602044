"""The table of directional albedos that the surface shader looks up."""

from __future__ import annotations

import moderngl

from simgl.physics.directional_albedo import TABLE_SIZE, lobe_table

LOBE_UNIT = 10


def lobe_texture(ctx: moderngl.Context) -> moderngl.Texture:
    """A new float texture of ``lobe_table``, interpolated between its texels."""
    texture = ctx.texture((TABLE_SIZE, TABLE_SIZE), 2, lobe_table().tobytes(), dtype="f4")
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = False
    return texture
