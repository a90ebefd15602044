"""The table of directional albedos that the surface shader looks up."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.disk_cache import computed_once
from simgl.physics import directional_albedo
from simgl.physics.directional_albedo import TABLE_SIZE, lobe_table

LOBE_UNIT = 10


def lobe_texture(ctx: moderngl.Context) -> moderngl.Texture:
    """A new float texture of ``lobe_table``, interpolated between its texels."""
    shape = (TABLE_SIZE, TABLE_SIZE, 4)
    table = computed_once(
        "tables",
        (directional_albedo.__name__, "numpy"),
        "albedo of lobes",
        lambda: {"albedo": lobe_table()},
        lambda arrays: arrays["albedo"].shape == shape and arrays["albedo"].dtype == np.float32,
    )["albedo"]
    texture = ctx.texture(shape[:2], 4, table.tobytes(), dtype="f4")
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = False
    return texture
