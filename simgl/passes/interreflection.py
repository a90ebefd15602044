"""Interreflection on each spacecraft, as values of its vertices."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass

import moderngl
import numpy as np

from simgl.arrays import Array32
from simgl.environment_map import SkyRadiance
from simgl.gpu.mesh_tables import COLUMNS, table, table_rows
from simgl.lru_cache import MANY, LruCache
from simgl.passes.mesh_store import MAX_BYTES, GridLight, VertexLighting
from simgl.radiosity.incident_light import IncidentLight
from simgl.radiosity.light_transport import LightGrids, LightTransport
from simgl.radiosity.neighbour_light import NeighbourLight
from simgl.radiosity.next_poses import NextPoses
from simgl.radiosity.next_sunlight import NextSunlight
from simgl.radiosity.patch_light import BesidesSky, PatchLight
from simgl.radiosity.solver import earth_share, vertex_irradiance
from simgl.radiosity.transport_store import JointLight, TransportStore, lit_mesh
from simgl.scene.spacecraft import SpacecraftModel
from simgl.view.spacecraft_view import SpacecraftView

# Texels of a vertex and side: irradiance; the Earth's share, and what fills it up.
_VALUES = 8
# Vertices in a row of the table.
_ROW = 4 * COLUMNS // _VALUES


@dataclass(frozen=True, kw_only=True, eq=False)
class _Solved:
    """What the vertices of a spacecraft hold, and what that was made of."""

    made_of: tuple[SpacecraftModel, LightTransport, SkyRadiance | None, tuple[Hashable, ...]]
    lighting: VertexLighting


@dataclass(frozen=True, kw_only=True, eq=False)
class _Begun:
    """What a spacecraft gets besides the light of its sky, and what that is made of."""

    made_of: tuple[SpacecraftModel, LightTransport, tuple[Hashable, ...]]
    besides_sky: Future[BesidesSky | None]


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
        self._next_sunlight = NextSunlight()
        # One for each spacecraft of the largest scene so far.
        self._tables: dict[tuple[int, str], moderngl.Texture] = {}
        self._grids = LruCache[tuple[str, str], moderngl.Texture](
            MANY, moderngl.Texture.release, max_bytes=MAX_BYTES
        )
        self._solved: dict[int, _Solved] = {}
        self._begun: dict[int, _Begun] = {}

    def begin(self, spacecraft: Sequence[SpacecraftView], joint_light: JointLight) -> None:
        """Start what ``draw`` needs besides the skies, in another thread."""
        for one in spacecraft:
            light = one.incident_light
            if light is None or light.lit_by:
                continue
            transport = self._transports.of(one.model, joint_light)
            if transport is None:
                continue
            made_of = one.model, transport, light.key
            last = self._begun.get(one.instance)
            if last is None or last.made_of != made_of:
                besides = self._executor.submit(self.light.besides_sky, one.model, transport, light)
                self._begun[one.instance] = _Begun(made_of=made_of, besides_sky=besides)
        self._reserve(len(self._begun))

    def _reserve(self, bodies: int) -> None:
        """What a frame needs of all of its bodies stays in memory for the next one."""
        self._transports.reserve(bodies)
        self.light.reserve(bodies)
        self._grids.reserve(2 * bodies)

    def draw(
        self,
        spacecraft: Sequence[SpacecraftView],
        skies: Sequence[SkyRadiance | None],
        joint_light: JointLight,
    ) -> list[VertexLighting | None]:
        """The values of each spacecraft; None where nothing sees itself. Valid until the next call.

        skies : what each sees around it
        """
        self.begin(spacecraft, joint_light)
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
        near, sunlight = None, None
        if light.lit_by:
            near = self._neighbours.received(model, sky, light, joint_light)
            exitance = near.exitance
        else:
            besides = self._begun[spacecraft.instance].besides_sky.result()
            exitance, sunlight = self.light.at_vertices(model, transport, sky, light, besides)
        if sunlight is not None:
            response = self.light.response(model, transport)
            self._next_sunlight.make_ahead(spacecraft.instance, response, light.sun_direction)
        rows = gather.shape[0] * gather.shape[1]
        # Filled up to whole rows of the table.
        texels = np.zeros((-(-rows // _ROW) * _ROW, _VALUES), dtype=np.float32)
        values = texels[:rows].reshape(*gather.shape, _VALUES)
        more = None if sunlight is None else sunlight.vertices
        vertex_irradiance(gather, exitance, values, self._executor, more)
        values[..., 4] = share.result()
        if near is not None:
            values.reshape(-1, _VALUES)[:, :4] += near.at_rows
            left = values[..., 4].ravel() - near.lost_share(gather, cells)
            values[..., 4] = np.maximum(left, 0.0).reshape(gather.shape)
        defines = ("INTERREFLECTION", "TWO_SIDED") if transport.sides == 2 else ("INTERREFLECTION",)
        grids = None
        if sunlight is not None and transport.grids is not None:
            of_triangle, row_of_node = self._places_of_grids(transport, transport.grids)
            grids = GridLight(
                of_triangle=of_triangle,
                rows=row_of_node,
                light=self._table((spacecraft.instance, "grids"), sunlight.nodes),
            )
            defines = (*defines, "LIGHT_GRIDS")
        return VertexLighting(
            mesh=lit_mesh(model, transport),
            light=self._table((spacecraft.instance, "vertices"), texels.reshape(-1, 4)),
            defines=defines,
            grids=grids,
        )

    def _table(self, key: tuple[int, str], texels: Array32) -> moderngl.Texture:
        rows = table_rows(texels)
        size = COLUMNS, len(rows)
        present = self._tables.get(key)
        if present is None or present.size != size:
            if present is not None:
                present.release()
            self._tables[key] = self._ctx.texture(size, 4, dtype="f4")
            self._tables[key].filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._tables[key].write(rows)
        return self._tables[key]

    def _places_of_grids(
        self, transport: LightTransport, grids: LightGrids
    ) -> tuple[moderngl.Texture, moderngl.Texture]:
        """One texel for each triangle: 1 and the number of its grid, or 0; and one for each node
        and side: its row in the table of their light."""

        def of_triangles() -> moderngl.Texture:
            number = np.zeros((len(transport.mesh.triangles), 1), dtype=np.uint32)
            number[grids.triangles, 0] = 1 + np.arange(len(grids.triangles))
            return table(self._ctx, number)

        def rows() -> moderngl.Texture:
            return table(self._ctx, grids.row_of_node.reshape(-1, 1).astype(np.uint32))

        size, key = 4 * len(transport.mesh.triangles), transport.digest
        return (
            self._grids.get((key, "triangles"), of_triangles, size),
            self._grids.get((key, "rows"), rows, 4 * grids.row_of_node.size),
        )

    def release(self) -> None:
        """Free everything."""
        for one in self._tables.values():
            one.release()
        self._tables.clear()
        self._grids.clear()
        self._solved.clear()
        self._begun.clear()
