"""Light of other surfaces for every sample of a tile by rays, in the place of vertex light."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np
from numpy.typing import NDArray

from simgl.lattice import Lattice
from simgl.sky import SkyRadiance, cell_radiance
from simgl.transport.gather import SKY_ACROSS, LitBody, Points, gathered
from simgl.view.frame import CraftView, Tile

Floats = NDArray[np.float32]

# Rays of a pixel, shared by its samples.
RAYS = 256

# Of the geometry pass's targets: place and label, normal, triangle's normal and share, others.
_PLACE, _SHAPE, _PLANE, _OTHERS = 0, 1, 2, 3


class GatherPass:
    """Writes what the geometry pass leaves to vertices: the light of others, the Earth's share."""

    def draw(
        self,
        tile: Tile,
        seen: Sequence[moderngl.Texture],
        bodies: Sequence[Sequence[LitBody] | None],
        skies: Sequence[SkyRadiance | None],
    ) -> None:
        """Changes the targets of the geometry pass.

        bodies : for each spacecraft of the tile, itself and what is around; None where nothing is
        skies : likewise what it sees around it
        """
        columns, rows = tile.lattice.raster_size(tile.width, tile.height)
        place, shape, plane, others = (
            _read(seen[target])[:rows, :columns] for target in (_PLACE, _SHAPE, _PLANE, _OTHERS)
        )
        craft_seen = place[..., 3].astype(np.int64) // 16384
        for craft, lit, sky in zip(tile.craft, bodies, skies, strict=True):
            row, column = np.nonzero((craft_seen == craft.instance) & (place[..., 3] >= 0.0))
            if lit is None or len(row) == 0:
                continue
            points = _points(
                craft,
                place[row, column],
                shape[row, column],
                plane[row, column],
                _spread(row, column),
            )
            cells = None if sky is None else cell_radiance(sky, SKY_ACROSS)
            light, share = gathered(points, lit, cells, _rays(tile.lattice))
            others[row, column] = light
            plane[row, column, 3] = share
        for target, values in ((_PLANE, plane), (_OTHERS, others)):
            seen[target].write(np.ascontiguousarray(values), viewport=(0, 0, columns, rows))


def _read(texture: moderngl.Texture) -> Floats:
    data = np.frombuffer(texture.read(), dtype=np.float32)
    return data.reshape(texture.height, texture.width, 4).copy()


def _rays(lattice: Lattice) -> int:
    return max(1, int(np.ceil(RAYS / lattice.scale**2)))


def _points(
    craft: CraftView, place: Floats, shape: Floats, plane: Floats, spread: NDArray[np.float64]
) -> Points:
    """Places and normals in body axes, normals towards the viewer."""
    camera_from_body = craft.camera_from_body
    R = camera_from_body[:3, :3]
    in_camera = place[:, :3] @ R.T + camera_from_body[:3, 3]
    away = np.einsum("ij,ij->i", plane[:, :3], in_camera) > 0.0
    facets = np.where(away[:, None], -plane[:, :3], plane[:, :3])
    return Points(places=place[:, :3], normals=shape[:, :3] @ R, facets=facets @ R, spread=spread)


def _spread(row: NDArray[np.int64], column: NDArray[np.int64]) -> NDArray[np.float64]:
    """(n, 2) numbers 0..1, even over any neighbourhood of samples (as in sunlight.frag)."""
    first = 0.7548776662466927 * column + 0.5698402909980532 * row
    second = 0.8566748838545029 * column + 0.7338918566271260 * row
    return np.stack([(0.5 + first) % 1.0, (0.5 + second) % 1.0], axis=1)
