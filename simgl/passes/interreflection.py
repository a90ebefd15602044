"""Interreflection on each spacecraft, as values of its vertices."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import moderngl
import numpy as np

from simgl.arrays import Array32
from simgl.environment_map import SkyRadiance
from simgl.gpu.mesh_tables import COLUMNS, table_rows
from simgl.passes.mesh_store import VertexLighting
from simgl.radiosity.incident_light import IncidentLight
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.neighbour_light import NeighbourLight
from simgl.radiosity.next_poses import NextPoses
from simgl.radiosity.patch_light import PatchLight
from simgl.radiosity.solver import earth_share, vertex_irradiance
from simgl.radiosity.transport_store import JointLight, TransportStore, lit_mesh
from simgl.scene.spacecraft import SpacecraftModel
from simgl.view.spacecraft_view import SpacecraftView

# Texels of a vertex and side: irradiance; the Earth's share, and what fills it up.
_VALUES = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class _Solved:
    """What the vertices of a spacecraft hold, and what that was made of."""

    made_of: tuple[SpacecraftModel, LightTransport, SkyRadiance | None, tuple[Hashable, ...]]
    lighting: VertexLighting


class InterreflectionPass:
    """Solves for the light that surfaces of one spacecraft send to each other.

    It does not depend on who looks: further cameras of one state, and further rasters of one image,
    read what the first one got.

    executor : takes a part of the work on the CPU
    light : what leaves the patches
    """

    def __init__(
        self, ctx: moderngl.Context, transports: TransportStore, executor: Executor
    ) -> None:
        self._ctx, self._transports, self._executor = ctx, transports, executor
        self.light = PatchLight()
        self._neighbours = NeighbourLight(transports, self.light)
        self._next_poses = NextPoses(transports, self.light)
        # One for each spacecraft of the largest scene so far.
        self._tables: dict[int, moderngl.Texture] = {}
        self._solved: dict[int, _Solved] = {}

    def draw(
        self,
        spacecraft: Sequence[SpacecraftView],
        skies: Sequence[SkyRadiance | None],
        joint_light: JointLight,
    ) -> list[VertexLighting | None]:
        """The values of each spacecraft; None where nothing sees itself. Valid until the next call.

        skies : what each sees around it
        """
        lightings = [
            self._lighting(s, sky, joint_light) for s, sky in zip(spacecraft, skies, strict=True)
        ]
        for one in spacecraft:
            if joint_light == "quick" and one.incident_light is not None and one.model.joints:
                self._next_poses.make_ahead(one.instance, one.model)
        return lightings

    def _lighting(
        self, spacecraft: SpacecraftView, sky: SkyRadiance | None, joint_light: JointLight
    ) -> VertexLighting | None:
        if spacecraft.incident_light is None:
            return None
        model = spacecraft.model
        transport: LightTransport | None
        if spacecraft.incident_light.lit_by:
            transport = self._neighbours.transport(model, joint_light)
        else:
            transport = self._transports.of(model, joint_light)
        if transport is None:
            return None
        made_of = model, transport, sky, spacecraft.incident_light.key
        last = self._solved.pop(spacecraft.instance, None)
        if last is None or last.made_of != made_of:
            lighting = self._solve(
                spacecraft, spacecraft.incident_light, transport, sky, joint_light
            )
            last = _Solved(made_of=made_of, lighting=lighting)
        self._solved[spacecraft.instance] = last
        return last.lighting

    def _solve(
        self,
        spacecraft: SpacecraftView,
        light: IncidentLight,
        transport: LightTransport,
        sky: SkyRadiance | None,
        joint_light: JointLight,
    ) -> VertexLighting:
        model = spacecraft.model
        cells = None if sky is None else transport.cells_of(sky)
        gather = transport.of_vertices
        # In another thread while this one is busy with the bounces.
        share = self._executor.submit(earth_share, gather, cells)
        near = None
        if light.lit_by:
            near = self._neighbours.received(model, sky, light, joint_light)
            exitance = near.exitance
        else:
            exitance = self.light.exitance(model, transport, sky, light)
        values = np.zeros((*gather.shape, _VALUES), dtype=np.float32)
        vertex_irradiance(gather, exitance, values, self._executor)
        values[..., 4] = share.result()
        if near is not None:
            values.reshape(-1, _VALUES)[:, :4] += near.at_rows
            left = values[..., 4].ravel() - near.lost_share(gather, cells)
            values[..., 4] = np.maximum(left, 0.0).reshape(gather.shape)
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
        self._solved.clear()
