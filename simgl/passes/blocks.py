"""The uniform blocks that several passes share, and how a view fills them."""

from __future__ import annotations

from typing import Any

import numpy as np

from simgl.errors import AssetError
from simgl.gpu.blocks import Block
from simgl.scene.materials import Material
from simgl.view import CraftView

MAX_MATERIALS = 64

TILE = Block("Tile", 0, np.dtype([("clip_from_camera", "f4", (4, 4))]))

CRAFT = Block(
    "Craft",
    1,
    np.dtype(
        [
            ("camera_from_body", "f4", (4, 4)),
            ("light_from_body", "f4", (4, 4)),
            ("sun_direction", "f4", 4),
            ("sun_irradiance", "f4", 4),
            ("sun_angular_radius", "f4"),
            # Half the edge of the shadow map's cube [m].
            ("light_half_size", "f4"),
            ("instance", "u4"),
            ("craft_padding", "f4"),
        ]
    ),
)

MATERIALS = Block(
    "Materials",
    2,
    np.dtype(
        [
            ("material_reflectance", "f4", (MAX_MATERIALS, 4)),
            # metallic, roughness, 1 where Lambertian, unused
            ("material_law", "f4", (MAX_MATERIALS, 4)),
        ]
    ),
)


def craft_values(craft: CraftView) -> dict[str, Any]:
    """The Craft block of a spacecraft."""
    return {
        "camera_from_body": craft.camera_from_body,
        "light_from_body": craft.shadow.light_from_body,
        "sun_direction": (*craft.sun_direction, 0.0),
        "sun_irradiance": craft.sun_irradiance,
        "sun_angular_radius": craft.sun_angular_radius,
        "light_half_size": craft.shadow.half_size,
        "instance": craft.instance,
    }


def material_values(model_name: str, materials: tuple[Material, ...]) -> dict[str, Any]:
    """The Materials block of a model."""
    if len(materials) > MAX_MATERIALS:
        raise AssetError(
            f'model "{model_name}" has {len(materials)} materials, at most {MAX_MATERIALS} fit'
        )
    reflectance = np.zeros((MAX_MATERIALS, 4), dtype=np.float32)
    law = np.zeros((MAX_MATERIALS, 4), dtype=np.float32)
    for row, material in enumerate(materials):
        reflectance[row] = material.reflectance
        lambertian = material.roughness is None
        law[row] = material.metallic, material.roughness or 1.0, float(lambertian), 0.0
    return {"material_reflectance": reflectance, "material_law": law}
