"""Interreflection on each spacecraft, as values of its vertices."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from functools import partial

import moderngl
import numpy as np

from simgl.arrays import Array32
from simgl.environment_map import SkyRadiance
from simgl.gpu.context import prefers_compute
from simgl.gpu.mesh_tables import COLUMNS, table
from simgl.gpu.render_targets import read_by_texel
from simgl.lru_cache import MANY, LruCache
from simgl.passes.mesh_store import MAX_BYTES, GridLight, VertexLighting
from simgl.passes.tasks_ahead import TasksAhead
from simgl.passes.vertex_sums import SkyOfVertices, VertexInputs, VertexSums, near_table
from simgl.radiosity.incident_light import IncidentLight, NearPair
from simgl.radiosity.isolated_light import MadeOf, PendingLight
from simgl.radiosity.light_transport import LightGrids, LightTransport
from simgl.radiosity.neighbour_light import FromNeighbours, MutualLight, NeighbourLight
from simgl.radiosity.next_poses import NextPoses
from simgl.radiosity.next_sunlight import NextSunlight
from simgl.radiosity.patch_light import BesidesSky, PatchLight, UnsummedSunlight
from simgl.radiosity.posed_transport import PosedTransport
from simgl.radiosity.precomputed_response import GatheredSunlight
from simgl.radiosity.solver import earth_share, vertex_irradiance
from simgl.radiosity.transport_store import JointLight, TransportStore, lit_mesh
from simgl.scene.mesh import Mesh
from simgl.scene.spacecraft import SpacecraftModel
from simgl.view.background import SkyView
from simgl.view.near_spacecraft import NearGroup, NearSpacecraft
from simgl.view.spacecraft_view import SpacecraftView

# Texels of a vertex and side: irradiance; the Earth's share, and what fills it up.
_VALUES = 8
# Vertices in a row of the table.
_ROW = 4 * COLUMNS // _VALUES


@dataclass(frozen=True, kw_only=True, eq=False)
class _Values:
    """The texels of vertices, filled up to whole rows of their table, and those of nodes."""

    vertices: Array32
    nodes: Array32 | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class _Solved:
    """The lighting of a spacecraft, the values that belong to it, and what they are made of: its
    isolated light, then that of all whose light comes to it."""

    made_of: tuple[MadeOf, ...]
    values: Future[_Values | VertexInputs]
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
        # Of a GPU; None where the CPU sums.
        self._sums = VertexSums(ctx) if prefers_compute(ctx) else None
        # One for each spacecraft of the largest scene so far.
        self._tables: dict[tuple[int, str], moderngl.Texture] = {}
        self._grids = LruCache[tuple[str, str], moderngl.Texture](
            MANY, moderngl.Texture.release, max_bytes=MAX_BYTES
        )
        self._unwritten: dict[int, _Solved] = {}
        self._written: dict[int, _Solved] = {}
        self._begun: dict[int, _Begun] = {}
        # What later frames need of light, and of poses that this thread looks for.
        self._light_ahead, self._poses_ahead = TasksAhead(executor), TasksAhead(executor)

    def prepare(self, models: Iterable[SpacecraftModel], joint_light: JointLight) -> None:
        """Make what the first image needs of models that are traced. In any thread."""
        for model in models:
            transport = self._transports.of(model, joint_light)
            if transport is not None:
                self.light.prepare(model, transport)

    def begin(self, spacecraft: Sequence[SpacecraftView], joint_light: JointLight) -> None:
        """Start what ``draw`` needs besides the skies, in another thread."""
        self._poses_ahead.finish()
        for one in spacecraft:
            light, transport = one.incident_light, self._transport(one, joint_light)
            if light is None or transport is None:
                continue
            made_of = one.model, transport, light.key
            last = self._begun.get(one.instance)
            if last is None or last.made_of != made_of:
                of_body = partial(self.light.besides_sky, *made_of[:2], light)
                besides = self._light_ahead.then(partial(of_body, summed=self._sums is None))
                self._begun[one.instance] = _Begun(made_of=made_of, besides_sky=besides)
        self._reserve(len(self._begun))

    def _reserve(self, bodies: int) -> None:
        """What a frame needs of all of its bodies stays in memory for the next one."""
        self._transports.reserve(bodies)
        self.light.reserve(bodies)
        if self._sums is not None:
            self._sums.reserve(bodies)
        self._grids.reserve(2 * bodies)

    def draw(
        self,
        spacecraft: Sequence[SpacecraftView],
        sky_around: Callable[[SkyView | None], SkyRadiance | None],
        joint_light: JointLight,
    ) -> list[VertexLighting | None]:
        """The lighting of each spacecraft; None where nothing sees itself or others.

        Its values are there after ``complete``, and valid until the next call.

        sky_around : what one sees around it
        """
        self.begin(spacecraft, joint_light)
        isolated: dict[int, PendingLight] = {}
        for one in spacecraft:
            transport = self._transport(one, joint_light)
            if transport is not None:
                besides = self._begun[one.instance].besides_sky
                isolated[one.instance] = self._pending(one, transport, sky_around(one.sky), besides)
        for one in spacecraft:
            for other in () if one.near is None else one.near.spacecraft:
                if other.instance not in isolated:
                    transport = self._transport_unseen(other.model, joint_light)
                    isolated[other.instance] = self._pending(
                        other, transport, sky_around(other.sky)
                    )
        all_mutual: dict[NearGroup, Future[MutualLight]] = {}
        lightings = [self._lighting(one, isolated, all_mutual) for one in spacecraft]
        for one in spacecraft:
            if joint_light == "quick" and one.incident_light is not None and one.model.joints:
                ahead = partial(self._next_poses.make_ahead, one.instance, one.model)
                self._poses_ahead.add(ahead)
        return lightings

    def dark(
        self, spacecraft: Sequence[SpacecraftView], joint_light: JointLight
    ) -> list[VertexLighting | None]:
        """In place of ``draw``: lightings without light, where surfaces see each other.

        Programs are compiled with them while that light is traced.
        """
        return [self._dark_lighting(one, joint_light) for one in spacecraft]

    def _dark_lighting(self, one: SpacecraftView, joint_light: JointLight) -> VertexLighting | None:
        model, light = one.model, one.incident_light
        if light is None or not self._transports.exchanges(model):
            return None
        posed, sides = model.posed_mesh, 2 if model.open_sheets else 1
        texels = sides * len(posed.mesh.positions) * _VALUES // 4
        values, grids = self._table((one.instance, "vertices"), texels), None
        if light.sun_irradiance.any() and not self._transports.is_posed(model, joint_light):
            none = self._no_grids(posed.mesh)
            grids = GridLight(of_triangle=none, rows=none, light=values)
        return VertexLighting(mesh=posed, light=values, defines=_defines(sides, grids), grids=grids)

    def complete(self) -> None:
        """Write the values of the last call of ``draw``, as soon as they are made."""
        while self._unwritten:
            instance, solved = self._unwritten.popitem()
            values, lighting = solved.values.result(), solved.lighting
            if isinstance(values, VertexInputs):
                assert self._sums is not None
                self._sums.write(values, lighting)
            else:
                lighting.light.write(values.vertices)
                if lighting.grids is not None:
                    lighting.grids.light.write(values.nodes)
            self._written[instance] = solved
        self._light_ahead.begin()
        self._poses_ahead.begin()

    def _transport(self, one: SpacecraftView, joint_light: JointLight) -> LightTransport | None:
        """How light goes on a spacecraft; None where nothing sees itself or others."""
        if one.incident_light is None:
            return None
        transport = self._transports.of(one.model, joint_light)
        if transport is None and one.near is not None:
            return self._neighbours.coarse_transport(one.model)
        return transport

    def _transport_unseen(self, model: SpacecraftModel, joint_light: JointLight) -> LightTransport:
        """Of a spacecraft that is not drawn: no frame waits for bakes of its joints' poses."""
        transport = None
        if joint_light == "quick" or model.posed_mesh.motion is None:
            transport = self._transports.of(model, joint_light)
        return self._neighbours.coarse_transport(model) if transport is None else transport

    def _pending(
        self,
        one: SpacecraftView | NearSpacecraft,
        transport: LightTransport,
        sky: SkyRadiance | None,
        besides_sky: Future[BesidesSky | None] | None = None,
    ) -> PendingLight:
        assert one.incident_light is not None
        return PendingLight(
            instance=one.instance,
            model=one.model,
            transport=transport,
            sky=sky,
            incident=one.incident_light,
            besides_sky=besides_sky,
            light=self.light,
            executor=self._executor,
        )

    def _lighting(
        self,
        one: SpacecraftView,
        isolated: dict[int, PendingLight],
        all_mutual: dict[NearGroup, Future[MutualLight]],
    ) -> VertexLighting | None:
        pending = isolated.get(one.instance)
        if pending is None:
            return None
        near = () if one.near is None else tuple(isolated[o.instance] for o in one.near.spacecraft)
        made_of = pending.made_of, *(other.made_of for other in near)
        for all_solved in (self._unwritten, self._written):
            solved = all_solved.pop(one.instance, None)
            if solved is not None and solved.made_of == made_of:
                all_solved[one.instance] = solved
                return solved.lighting
        from_near = None
        if one.near is not None:
            if one.near not in all_mutual:
                all_mutual[one.near] = self._mutual_light(near, one.near.pairs)
            from_near = self._received(all_mutual[one.near], near.index(pending))
        solved = _Solved(
            made_of=made_of,
            values=self._solve(one.instance, pending, from_near),
            lighting=self._vertex_lighting(one, pending.incident, pending.transport),
        )
        self._unwritten[one.instance] = solved
        return solved.lighting

    def _mutual_light(
        self, near: Sequence[PendingLight], pairs: Sequence[NearPair]
    ) -> Future[MutualLight]:
        """Light that goes between some spacecraft."""
        isolated = [one.at_patches for one in near]

        def solved() -> MutualLight:
            return self._neighbours.mutual_light([one.result() for one in isolated], pairs)

        return self._executor.submit(solved)

    def _received(self, mutual: Future[MutualLight], number: int) -> Future[FromNeighbours]:
        return self._executor.submit(lambda: mutual.result().received(number))

    def _solve(
        self, instance: int, pending: PendingLight, from_near: Future[FromNeighbours] | None
    ) -> Future[_Values | VertexInputs]:
        """In other threads; each task waits only for some that were submitted before it."""

        def make_ahead() -> None:
            response = self.light.response(pending.model, pending.transport)
            self._next_sunlight.make_ahead(instance, response, pending.incident.sun_direction)

        solved: Future[_Values | VertexInputs]
        if self._sums is None or isinstance(pending.transport, PosedTransport):
            solved = self._summed(pending, from_near)
        else:
            solved = self._unsummed(pending, from_near)
        if _in_sunlight(pending.incident, pending.transport):
            self._light_ahead.add(make_ahead)
        return solved

    def _summed(
        self, pending: PendingLight, from_near: Future[FromNeighbours] | None
    ) -> Future[_Values | VertexInputs]:
        """The values of a body."""
        gather, cells, at_vertices = (
            pending.transport.of_vertices,
            pending.cells,
            pending.at_vertices,
        )
        share = self._executor.submit(lambda: earth_share(gather, cells.result()))
        lobes = pending.sky_lobes

        def values() -> _Values:
            exitance, sunlight = at_vertices.result()
            assert not isinstance(sunlight, UnsummedSunlight)
            near = None if from_near is None else from_near.result()
            if near is not None:
                exitance = exitance + near.exitance
            more = None if sunlight is None else sunlight.vertices
            irradiance = vertex_irradiance(gather, exitance, more, lobes.result())
            left = share.result().ravel()
            if near is not None:
                irradiance += near.at_rows
                np.maximum(irradiance, 0.0, out=irradiance)
                left = np.maximum(left - near.lost_share(gather, cells.result()), 0.0)
            nodes = None if sunlight is None else sunlight.nodes
            return _Values(vertices=_texels(irradiance, left), nodes=nodes)

        return self._executor.submit(values)

    def _unsummed(
        self, pending: PendingLight, from_near: Future[FromNeighbours] | None
    ) -> Future[_Values | VertexInputs]:
        """What a GPU makes the same values of."""
        transport, cells, at_vertices = pending.transport, pending.cells, pending.at_vertices
        lobes = pending.sky_lobes

        def inputs() -> VertexInputs:
            exitance, sunlight = at_vertices.result()
            assert not isinstance(sunlight, GatheredSunlight)
            at_rows = near = None
            if (light := lobes.result()) is not None:
                at_rows = np.take(light, transport.vertex_rows, axis=0)
            if from_near is not None:
                others = from_near.result()
                exitance = exitance + others.exitance
                hidden = others.lost_share(transport.of_vertices, cells.result())
                received = others.at_rows if at_rows is None else others.at_rows + at_rows
                near = near_table(received, hidden)
            elif at_rows is not None:
                near = near_table(at_rows, np.zeros(len(at_rows), dtype=np.float32))
            return VertexInputs(
                transport=transport,
                exitance=exitance,
                sky=SkyOfVertices.of(transport, cells.result()),
                sunlight=sunlight,
                near=near,
            )

        return self._executor.submit(inputs)

    def _vertex_lighting(
        self, spacecraft: SpacecraftView, light: IncidentLight, transport: LightTransport
    ) -> VertexLighting:
        """With tables that are yet to be filled."""
        grids = None
        if transport.grids is not None and _in_sunlight(light, transport):
            of_triangle, row_of_node = self._places_of_grids(transport, transport.grids)
            grids = GridLight(
                of_triangle=of_triangle,
                rows=row_of_node,
                light=self._table((spacecraft.instance, "grids"), transport.grids.rows),
            )
        count = transport.gather_point_of_vertex.size
        return VertexLighting(
            mesh=lit_mesh(spacecraft.model, transport),
            light=self._table((spacecraft.instance, "vertices"), count * _VALUES // 4),
            defines=_defines(transport.sides, grids),
            grids=grids,
        )

    def _table(self, key: tuple[int, str], texels: int) -> moderngl.Texture:
        size = COLUMNS, -(-texels // COLUMNS)
        present = self._tables.get(key)
        if present is None or present.size != size:
            if present is not None:
                present.release()
            self._tables[key] = self._ctx.texture(size, 4, dtype="f4")
            read_by_texel(self._tables[key])
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

    def _no_grids(self, mesh: Mesh) -> moderngl.Texture:
        """One texel for each triangle, 0."""
        count = len(mesh.triangles)
        return self._grids.get(
            (mesh.digest, "none"),
            lambda: table(self._ctx, np.zeros((count, 1), dtype=np.uint32)),
            4 * count,
        )

    def release(self) -> None:
        """Free everything."""
        if self._sums is not None:
            self._sums.release()
        for one in self._tables.values():
            one.release()
        self._tables.clear()
        self._grids.clear()
        self._unwritten.clear()
        self._written.clear()
        self._begun.clear()


def _in_sunlight(light: IncidentLight, transport: LightTransport) -> bool:
    """Whether vertices get the Sun's light as it was solved beforehand."""
    return not isinstance(transport, PosedTransport) and bool(light.sun_irradiance.any())


def _defines(sides: int, grids: GridLight | None) -> tuple[str, ...]:
    """What a program needs that reads a lighting."""
    two_sided = ("TWO_SIDED",) if sides == 2 else ()
    return ("INTERREFLECTION", *two_sided, *(() if grids is None else ("LIGHT_GRIDS",)))


def _texels(irradiance: Array32, share: Array32) -> Array32:
    """Two for each row of vertex and side, of the irradiance (r, 4) and the Earth's share (r,)."""
    texels = np.zeros((-(-len(share) // _ROW) * _ROW, _VALUES), dtype=np.float32)
    # Four numbers as one: numpy takes ten times as long to copy them one by one.
    texels.view(np.complex128)[: len(share), 0] = irradiance.view(np.complex128)[:, 0]
    texels[: len(share), 4] = share
    return texels
