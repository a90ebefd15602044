"""The light of the sky around a spacecraft, and what its patches get of it.

The renderer draws it (simgl/rendering/spacecraft_skies.py): what heats a spacecraft is what lights
it in images, and what stands behind it in them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Array32
from simgl.camera.infrared_detector import InfraredDetector
from simgl.environment_map import cube_cell, cube_directions, cube_solid_angles
from simgl.scene.posed_mesh import PosedMesh
from simgl.scene.state import SceneState
from simgl.thermal.body import ThermalBody
from simgl.thermal.infrared_surroundings import space_in_band
from simgl.thermal.view_factors import CELLS_ACROSS

# Directions in a cell of the sky along each edge, over which its radiance is averaged, and along
# the edge of a cube.
_FINER = 4
SKY_CELLS = CELLS_ACROSS * _FINER


@dataclass(frozen=True, kw_only=True, eq=False)
class SkyLight:
    """Light from around a spacecraft on a cube (simgl/environment_map.py), the Sun's disc left out.

    cells : (6 SKY_CELLS^2, m) radiance of m lights, in the cube's axes
    R_sky_from_body : (3, 3) to those from the body's
    """

    cells: Array
    R_sky_from_body: Array

    def along(self, R_sky_from_body: Array) -> Array:
        """(6 SKY_CELLS^2, m) the same on a cube in other axes."""
        if np.array_equal(R_sky_from_body, np.eye(3)):
            return self.cells
        directions = cube_directions(SKY_CELLS).reshape(-1, 3)
        return self.cells[cube_cell(directions @ R_sky_from_body.T, SKY_CELLS)]


class Skies(Protocol):
    """What spacecraft have around them in a scene; each a pure function of it."""

    def heat(self, state: SceneState, name: str) -> SkyLight:
        """Sunlight that the Earth reflects, and its long-wave radiation, at all wavelengths
        [W m-2 sr-1]."""

    def in_band(self, state: SceneState, name: str, detector: InfraredDetector) -> SkyLight:
        """In the band of a detector, in W m-2 sr-1 and as it counts."""


class EmptySkies:
    """Of scenes without an Earth."""

    def heat(self, state: SceneState, name: str) -> SkyLight:  # noqa: ARG002
        """Darkness."""
        return _even(state, (0.0, 0.0))

    def in_band(self, state: SceneState, name: str, detector: InfraredDetector) -> SkyLight:  # noqa: ARG002
        """Deep space."""
        return _even(state, space_in_band(detector))


def _even(state: SceneState, radiance: tuple[float, float]) -> SkyLight:
    if state.earth is not None:
        raise ValueError("a scene with an Earth needs the skies of a simulator")
    cells = np.tile(np.array(radiance), (6 * SKY_CELLS**2, 1))
    return SkyLight(cells=cells, R_sky_from_body=np.eye(3))


@lru_cache(maxsize=4)
def _means(n: int) -> sparse.csr_array:
    """(6 SKY_CELLS^2, 6 n^2) from texels of a cube to means over its cells, by solid angle."""
    cell = np.arange(SKY_CELLS)[:, None] / SKY_CELLS
    texel = np.arange(n)[None, :] / n
    both = np.minimum(cell + 1.0 / SKY_CELLS, texel + 1.0 / n) - np.maximum(cell, texel)
    along = sparse.csr_array(np.maximum(both, 0.0))
    face = sparse.kron(along, along) @ sparse.diags_array(cube_solid_angles(n).ravel())
    face = sparse.diags_array(1.0 / np.asarray(face.sum(axis=1))) @ face
    return sparse.csr_array(sparse.block_diag([face] * 6), dtype=np.float32)


def on_cells(radiance: Array32) -> Array:
    """(6 SKY_CELLS^2,) means over cells of a light on a cube (6, n, n)."""
    return np.asarray(_means(radiance.shape[1]) @ radiance.ravel(), dtype=np.float64)


def motion_of(posed: PosedMesh, groups: int) -> Array:
    """(groups, 4, 4) body_from_stored of rigid groups."""
    return np.tile(np.eye(4), (groups, 1, 1)) if posed.motion is None else posed.motion


def light_of_sky(
    body: ThermalBody, state: SceneState, sky: SkyLight, hidden: sparse.csr_matrix | None = None
) -> Array:
    """(p, m) light of the sky on the patches, where the body leaves it free.

    hidden : (p, cells) shares of the patches' hemispheres that other bodies cover, by cells of the
        cube in the body's axes
    """
    posed = state.bodies[body.name].model.posed_mesh
    motion = motion_of(posed, int(body.group.max(initial=0)) + 1)
    rotations, of_group = np.unique(motion[:, :3, :3], axis=0, return_inverse=True)
    lights = np.zeros((body.patch_count, sky.cells.shape[1]))
    weight = np.tile(cube_solid_angles(SKY_CELLS).ravel(), 6)[:, None]
    solid_angles = _cell_sums(weight)
    for number, rotation in enumerate(rotations):
        chosen = np.flatnonzero(of_group.ravel()[body.group] == number)
        if not len(chosen):
            continue
        mean = _cell_sums(weight * sky.along(sky.R_sky_from_body @ rotation)) / solid_angles
        lights[chosen] = np.pi * (body.views.sky[chosen] @ mean)
    if hidden is None:
        return lights
    behind = np.pi * (hidden @ sky.along(sky.R_sky_from_body))
    return np.asarray(np.maximum(lights - behind, 0.0))


def _cell_sums(values: Array) -> Array:
    """(6 CELLS_ACROSS^2, m) sums of (k, m) over the finer directions of each cell of the sky."""
    shape = 6, CELLS_ACROSS, _FINER, CELLS_ACROSS, _FINER, values.shape[1]
    return values.reshape(shape).sum(axis=(2, 4)).reshape(-1, values.shape[1])
