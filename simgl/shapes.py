"""What stands for a spacecraft before a camera: its mesh or, far away, fewer triangles over it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simgl.arrays import IndexArray
from simgl.levels.levels import Levels, levels_of
from simgl.lru_cache import LruCache
from simgl.progress import ProgressCallback
from simgl.radiosity.transport_store import TransportStore
from simgl.radiosity.vertex_light import light_on_vertices
from simgl.scene.mesh import Mesh
from simgl.scene.spacecraft import SpacecraftModel
from simgl.view.detail import Detail


@dataclass(frozen=True, kw_only=True, eq=False)
class Shape:
    """The triangles over a mesh that stand for a spacecraft.

    levels : None for the mesh's own triangles
    chosen : the level of each part
    """

    mesh: Mesh
    levels: Levels | None = None
    chosen: tuple[int, ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class Drawn:
    """Those vertices of a mesh that are drawn, (k,) in order; the same object for the same ones."""

    vertices: IndexArray


_NONE = np.zeros(0, dtype=np.int64)

# Choices of levels whose vertices are remembered.
_DRAWN_KEPT = 64


class Shapes:
    """Meshes and levels of detail of models by their content.

    Where light between surfaces is drawn, the levels lie over the mesh that carries it, and keep
    apart what that light tells apart; without it they lie over the model's own mesh.
    """

    def __init__(self, transports: TransportStore) -> None:
        self._transports = transports
        self._levels: dict[tuple[str, bool], Levels] = {}
        self._drawn = LruCache[tuple[int, tuple[int, ...]], Drawn](_DRAWN_KEPT)

    def levels(
        self, model: SpacecraftModel, progress: ProgressCallback | None = None, *, exchanging: bool
    ) -> tuple[Mesh, Levels]:
        """What a model is drawn from where it is far, made at the first call if no file has it.

        exchanging : with the mesh that carries the light between its surfaces, its joints as stored
        """
        transport = self._transports.of(model, progress) if exchanging else None
        # Triangles are the same whatever its joints do.
        stored = (model.stored or model).mesh if transport is None else transport.mesh
        key = stored.digest, transport is not None
        if key not in self._levels:
            values = None if transport is None else light_on_vertices(transport)
            self._levels[key] = levels_of(stored, progress, values)
        return model.mesh if transport is None else stored, self._levels[key]

    def of(self, model: SpacecraftModel, detail: Detail) -> Shape:
        """What is drawn of a model."""
        if not any(detail.errors):
            return Shape(mesh=model.mesh)
        mesh, levels = self.levels(model, exchanging=detail.exchanging)
        return Shape(mesh=mesh, levels=levels, chosen=levels.chosen(detail.errors))

    def vertices(self, model: SpacecraftModel, detail: Detail) -> Drawn | None:
        """The vertices of what is drawn of a model; None for all."""
        shape = self.of(model, detail)
        if shape.levels is None:
            return None
        levels, chosen = shape.levels, shape.chosen
        # The levels are kept for good, so that no others get their identity.
        return self._drawn.get((id(levels), chosen), lambda: _drawn(levels, chosen))


def _drawn(levels: Levels, chosen: tuple[int, ...]) -> Drawn:
    parts = [levels.triangles[a : a + n] for a, n in levels.ranges(chosen)]
    used = np.unique(np.concatenate(parts)).astype(np.int64) if parts else _NONE
    return Drawn(vertices=used)
