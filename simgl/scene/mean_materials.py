"""Mean materials: images and vertex colours averaged over the surface that has them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from simgl.arrays import AnyArray, Array, IndexArray
from simgl.scene.materials import Material
from simgl.scene.mesh import Mesh
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.textures import MIRROR, REPEAT, Image, Maps

# Places at which a model's images are read, for all triangles together; at least 4 on each.
_PLACES = 200_000


def mean_materials(model: SpacecraftModel) -> tuple[Material, ...]:
    """The materials of a model with the means of images and vertex colours in their factors.

    Interreflection is computed with these. Normal maps are ignored.
    """
    if "DETAILED" not in model.variant:
        return model.materials
    triangle, weights, area = _places(model.mesh)
    corners = model.mesh.triangles[triangle]
    material = model.mesh.material[corners[:, 0]]
    means = []
    for row, one in enumerate(model.materials):
        here = material == row
        if np.any(here):
            one = _mean(one, model, corners[here], weights[here], area[here])
        means.append(one)
    return tuple(means)


def _mean(
    material: Material, model: SpacecraftModel, corners: Any, weights: Array, area: Array
) -> Material:
    mesh, textures, maps = model.mesh, model.textures, material.maps
    uv = None if mesh.uv is None else np.einsum("nc,ncd->nd", weights, mesh.uv[corners])
    tint = np.ones((1, 4))
    if mesh.colour is not None:
        tint = np.einsum("nc,ncd->nd", weights, mesh.colour[corners])

    def image(layers: tuple[Image, ...], layer: int | None, channels: int) -> Array:
        if layer is None or uv is None:
            return np.ones((1, channels))
        return texels_at(layers[layer], uv)

    # A material that only triangles without area have takes the plain mean.
    shares = area if np.any(area) else np.ones_like(area)

    def mean(values: Array) -> Array:
        everywhere = np.broadcast_to(values, (len(area), values.shape[1]))
        return np.average(everywhere, axis=0, weights=shares)

    # Weights and means of ones may round to the next number above.
    base = np.minimum(mean(tint * image(textures.base_colour, maps.base_colour, 4)), 1.0)
    law = np.minimum(mean(image(textures.law, maps.law, 2)), 1.0)
    glow = mean(image(textures.emission, maps.emission, 3))
    r, g, b, n = (float(v) for v in material.reflectance * base[[0, 1, 2, 0]])
    er, eg, eb, en = (float(v) for v in material.emission * glow[[0, 1, 2, 0]])
    return replace(
        material,
        reflectance=(r, g, b, n),
        metallic=float(material.metallic * law[1]),
        emission=(er, eg, eb, en),
        maps=Maps(),
    )


def texels_at(image: Image, uv: AnyArray) -> Array:
    """(n, channels) the nearest texels of an image at (n, 2) places."""
    height, width = image.values.shape[:2]
    index = []
    for axis, count in ((0, width), (1, height)):
        place = uv[:, axis].astype(np.float64)
        if image.wrap[axis] == REPEAT:
            place = place % 1.0
        if image.wrap[axis] == MIRROR:
            place = 1.0 - np.abs(place % 2.0 - 1.0)
        index.append(np.clip((place * count).astype(np.int64), 0, count - 1))
    return image.values[index[1], index[0]].astype(np.float64)


def _places(mesh: Mesh) -> tuple[IndexArray, Array, Array]:
    """Triangle (n,), weights of its corners (n, 3) and area (n,) [m2] of places over the mesh."""
    count = len(mesh.triangles)
    each = max(_PLACES // count, 4)
    # Even over the unit square (M. Roberts 2018), its far half folded back onto the triangle.
    step = np.arange(1, each + 1)
    u, v = (0.7548776662466927 * step) % 1.0, (0.5698402909980532 * step) % 1.0
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    weights = np.stack([1.0 - u - v, u, v], axis=1)
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles].astype(np.float64), 1, 0)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1) / each
    return np.repeat(np.arange(count), each), np.tile(weights, (count, 1)), np.repeat(area, each)
