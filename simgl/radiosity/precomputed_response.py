"""Precomputed response of a body to light: exitance is linear in it, so most is solved in advance.

The sky is 96 cells, each solved once. The Sun is the sum of three directions of a grid
(simgl/radiosity/sunlit_patches.py), solved when it comes near. Other light is solved on request.
"""

from __future__ import annotations

from functools import cached_property, partial

import numpy as np

from simgl.arrays import Array, Array32
from simgl.lru_cache import LruCache
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.solver import Reflectors, radiosity
from simgl.radiosity.sunlit_patches import CAPACITY, Node, SunlitPatches, grid_corners

# Of the responses to all cells of the sky, and to the directions of the Sun that are cached, with
# the cosines to those.
BYTES_OF_PATCH = 4 * (4 * 96 + CAPACITY * (4 + 1))


class PrecomputedResponse:
    """Exitance of the patches of a body after all bounces, light by light.

    Results follow from the body and the light alone; those in memory only save time.
    """

    def __init__(
        self, transport: LightTransport, surface: Reflectors, sunlit: SunlitPatches
    ) -> None:
        self._transport = transport
        self._surface = surface
        self._sunlit = sunlit
        self._nodes = LruCache[Node, Array32](CAPACITY)

    @cached_property
    def glow(self) -> Array32:
        """(p, 4) by what the surfaces give off by themselves [W m-2]."""
        emitted = self._surface.exitance
        if not np.any(emitted):
            return emitted
        return radiosity(self._transport, self._surface, emitted)

    def of_irradiance(self, irradiance: Array32) -> Array32:
        """(p, 4) of any light, solved now [W m-2].

        irradiance : (p, 4) of the patches [W m-2]
        """
        return radiosity(self._transport, self._surface, self._surface.albedo * irradiance)

    def of_sky(self, cell_radiance: Array32) -> Array32:
        """(p, 4) by the sky [W m-2].

        cell_radiance : (96, 4) mean radiance of its cells [W m-2 sr-1]
        """
        # Not by BLAS: its threads keep the cores busy while they wait for the next product.
        bands = np.ascontiguousarray(cell_radiance.T)
        return np.einsum("pbc,bc->pb", self._of_cells, bands)

    def of_sun(self, direction: Array, irradiance: Array) -> Array32:
        """(p, 4) by the Sun, where no other body is before it [W m-2].

        direction : (3,) unit, towards it, body axes
        irradiance : (4,) on a surface that faces it [W m-2]
        """
        corners = grid_corners(direction)
        # Held here: a node that is stored may evict one that is still needed.
        known = {
            node: cached for node, _ in corners if (cached := self._nodes.find(node)) is not None
        }
        known |= self._solved([node for node, _ in corners if node not in known])
        exitance = np.zeros_like(self._surface.albedo)
        for node, weight in corners:
            per_irradiance = self._nodes.get(node, partial(known.__getitem__, node))
            exitance += per_irradiance * (weight * irradiance).astype(np.float32)
        return exitance

    @cached_property
    def _of_cells(self) -> Array32:
        """(p, 4, 96) exitance for each cell of radiance 1 in each band [W m-2 / (W m-2 sr-1)]."""
        # Rays follow the cosine: each stands for pi over their number.
        free = np.float32(np.pi) * self._transport.sky.toarray()
        reflected = self._surface.albedo[:, :, None] * free[:, None]
        # A face of the sky at a time: less than 2 MB, which stays in the processor's cache.
        faces = np.split(reflected, 6, axis=2)
        return np.concatenate(
            [radiosity(self._transport, self._surface, face) for face in faces], axis=2
        )

    def _solved(self, nodes: list[Node]) -> dict[Node, Array32]:
        """(p, 4) each for a Sun of 1 W/m2 in that direction; together they take less time."""
        if not nodes:
            return {}
        cosines = np.stack([self._sunlit.at(node) for node in nodes], axis=1)
        reflected = self._surface.albedo[:, :, None] * cosines[:, None]
        solved = radiosity(self._transport, self._surface, reflected)
        return {node: np.ascontiguousarray(solved[:, :, i]) for i, node in enumerate(nodes)}
