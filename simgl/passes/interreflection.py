"""Interreflection on each spacecraft, as values of its vertices."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor

import moderngl
import numpy as np

from simgl.arrays import Array32
from simgl.environment_map import SkyRadiance, cell_radiance
from simgl.gpu.mesh_tables import COLUMNS, table_rows
from simgl.passes.mesh_store import VertexLighting
from simgl.radiosity.hemisphere import CELLS_ACROSS
from simgl.radiosity.patch_light import PatchLight
from simgl.radiosity.solver import earth_share, vertex_irradiance
from simgl.radiosity.transport_store import TransportStore, lit_mesh
from simgl.view.spacecraft_view import SpacecraftView

# Texels of a vertex and side: irradiance; the Earth's share, and what fills it up.
_VALUES = 8


class InterreflectionPass:
    """Solves for the light that surfaces of one spacecraft send to each other.

    executor : takes a part of the work on the CPU
    """

    def __init__(
        self, ctx: moderngl.Context, transports: TransportStore, executor: Executor
    ) -> None:
        self._ctx, self._transports, self._executor = ctx, transports, executor
        self._light = PatchLight()
        # One for each spacecraft of the largest scene so far.
        self._tables: dict[int, moderngl.Texture] = {}

    def draw(
        self, spacecraft: Sequence[SpacecraftView], skies: Sequence[SkyRadiance | None]
    ) -> list[VertexLighting | None]:
        """The values of each spacecraft; None where nothing sees itself. Valid until the next call.

        skies : what each sees around it
        """
        return [self._lighting(s, sky) for s, sky in zip(spacecraft, skies, strict=True)]

    def _lighting(
        self, spacecraft: SpacecraftView, sky: SkyRadiance | None
    ) -> VertexLighting | None:
        if spacecraft.incident_light is None:
            return None
        model = spacecraft.model
        transport = self._transports.of(model)
        if transport is None:
            return None
        cells = None if sky is None else cell_radiance(sky, CELLS_ACROSS)
        gather = transport.of_vertices
        # In another thread while this one is busy with the bounces.
        share = self._executor.submit(earth_share, gather, cells)
        exitance = self._light.exitance(model, transport, sky, spacecraft.incident_light)
        values = np.zeros((*gather.shape, _VALUES), dtype=np.float32)
        vertex_irradiance(gather, exitance, values, self._executor)
        values[..., 4] = share.result()
        two_sided = transport.sides == 2
        return VertexLighting(
            mesh=lit_mesh(model, transport),
            light=self._table(spacecraft.instance, values.reshape(-1, 4)),
            defines=("INTERREFLECTION", "TWO_SIDED") if two_sided else ("INTERREFLECTION",),
        )

    def _table(self, instance: int, texels: Array32) -> moderngl.Texture:
        rows = table_rows(texels)
        size = COLUMNS, len(rows)
        present = self._tables.get(instance)
        if present is None or present.size != size:
            if present is not None:
                present.release()
            self._tables[instance] = self._ctx.texture(size, 4, dtype="f4")
            self._tables[instance].filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._tables[instance].write(rows)
        return self._tables[instance]

    def release(self) -> None:
        """Free everything."""
        for table in self._tables.values():
            table.release()
        self._tables.clear()
