"""Precomputed response of a body to light: exitance is linear in it, so most is solved in advance.

The sky is 96 cells, each solved once. The Sun is the sum of three directions of a grid
(simgl/radiosity/sunlit_patches.py), solved when it comes near, up to what vertices get of it. Other
light is solved on request.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TypeVar

import numpy as np

from simgl.arrays import Array, Array32, IndexArray
from simgl.lru_cache import LruCache
from simgl.radiosity.in_turn import side_by_side
from simgl.radiosity.light_grids import more_of_nodes
from simgl.radiosity.light_transport import LightTransport, PatchCells
from simgl.radiosity.lobe_sunlight import LobeSunlight, mean_of_bands
from simgl.radiosity.near_means import TIMES
from simgl.radiosity.patches import SAMPLES
from simgl.radiosity.sky_lobes import SkyLobes
from simgl.radiosity.solver import Reflectors, radiosity
from simgl.radiosity.sunlit_patches import CAPACITY, Node, SunlitPatches, direction_of, grid_corners

# Fields of light from elsewhere in memory: of some lamps, of the Sun about some directions.
_FIELDS = 32
# Of the responses to all cells of the sky, to the directions of the Sun that are cached, with the
# cosines to those and the sample points that they reach, and to those fields.
BYTES_OF_PATCH = 4 * (4 * 96 + CAPACITY * (4 + 1) + 4 * _FIELDS) + CAPACITY * SAMPLES
# Directions of the Sun whose light at vertices is in memory: those around it, before and behind.
_VERTEX_CAPACITY = 9
BYTES_OF_VERTEX = 4 * 4 * _VERTEX_CAPACITY
# Directions that are being made ahead.
_UNDER_WAY = 4
# Vertices whose light is scaled together, as many as a row of their table on the GPU.
_ROW = 2048

Name = TypeVar("Name", bound=Hashable)
Task = Callable[[], Array32]


@dataclass(frozen=True, kw_only=True, eq=False)
class GatheredSunlight:
    """Irradiance by surfaces that the Sun lights [W m-2].

    vertices : (r, 4) of each vertex and side
    nodes : (n, 4) the table of what the nodes of grids get more than is linear between vertices;
        filled up with zeros to whole rows
    """

    vertices: Array32
    nodes: Array32


@dataclass(frozen=True, kw_only=True, eq=False)
class AtVertices:
    """By a Sun of 1 W/m2 in one direction of the grid.

    rows : (k, 4 _ROW) of vertices and nodes, each filled up to whole rows
    lobes : (s,) what gather points of vertices get of lobes before bounces, mean of the bands;
        None without lobes
    """

    rows: Array32
    lobes: Array32 | None


@dataclass(frozen=True, kw_only=True, eq=False)
class SunTables:
    """``GatheredSunlight`` before it is summed.

    tables : three, and the irradiance (4,) by which each is multiplied [W m-2]
    first_node : where nodes begin in them, in rows of four bands
    """

    tables: tuple[tuple[AtVertices, Array32], ...]
    first_node: int


@dataclass(kw_only=True)
class _UnderWay:
    """What vertices get from one direction of the Sun, as it is made.

    parts : makes the next one at each step
    left : how many there are
    """

    parts: Iterator[None]
    left: int


def _one_by_one(tasks: list[Task]) -> Iterator[Array32]:
    """Their results, each worked out when it is asked for."""
    return (task() for task in tasks)


def _in_rows(count: int) -> int:
    """So many, filled up to whole rows."""
    return -(-count // _ROW) * _ROW


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
        self._at_vertices = LruCache[Node, AtVertices](_VERTEX_CAPACITY)
        self._under_way = LruCache[Node, _UnderWay](_UNDER_WAY)
        self._fields = LruCache[Hashable, Array32](_FIELDS)
        grids = transport.grids
        self._more_of_nodes = None if grids is None else more_of_nodes(transport, grids)

    @cached_property
    def glow(self) -> Array32:
        """(p, 4) by what the surfaces give off by themselves [W m-2]."""
        emitted = self._surface.exitance
        if not np.any(emitted):
            return emitted
        return radiosity(self._transport, self._surface, emitted)

    @property
    def lobe_bytes(self) -> int:
        """Size of what is known of glossy surfaces, which is made at the latest now."""
        if not self.lobes:
            return 0
        of_sky = 0 if self.sky_lobes is None else self.sky_lobes.nbytes
        return self.lobes.nbytes + of_sky + _VERTEX_CAPACITY * 4 * self._transport.gather.shape[0]

    def of_fields(
        self, fields: Mapping[Hashable, Callable[[], Array32]]
    ) -> dict[Hashable, Array32]:
        """(p, 4) each of light that is alike in all bands, solved unless it was before.

        fields : by a name for good, what makes its irradiance (p,) of the patches [W m-2]
        """
        # Held here: one that is stored may evict another that is still needed.
        solved = {
            name: cached for name in fields if (cached := self._fields.find(name)) is not None
        }
        made = {name: make() for name, make in fields.items() if name not in solved}
        lit = [name for name, field in made.items() if np.any(field)]
        if lit:
            solved |= self._reflected(lit, [made[name] for name in lit])
        dark = np.zeros_like(self._surface.albedo)
        solved |= {name: dark for name in made if name not in solved}
        return {name: self._fields.get(name, partial(solved.__getitem__, name)) for name in fields}

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
        solved = self._of_nodes([node for node, _ in corners])
        exitance = np.zeros_like(self._surface.albedo)
        for node, weight in corners:
            exitance += solved[node] * (weight * irradiance).astype(np.float32)
        return exitance

    def of_sun_at_vertices(self, direction: Array, irradiance: Array) -> GatheredSunlight:
        """What vertices and grids get where the surfaces send the light ``of_sun``."""
        # In long rows: numpy takes as long for four numbers as for hundreds.
        mean = scratch = None
        for table, light in self.sun_tables(direction, irradiance).tables:
            row = np.tile(light, _ROW)
            if mean is None:
                mean = table.rows * row
                scratch = np.empty_like(mean)
            else:
                mean += np.multiply(table.rows, row, out=scratch)
        assert mean is not None
        light, count = mean.reshape(-1, 4), len(self._transport.vertex_rows)
        return GatheredSunlight(vertices=light[:count], nodes=light[_in_rows(count) :])

    def sun_tables(self, direction: Array, irradiance: Array) -> SunTables:
        """The same for whoever sums it."""
        corners = grid_corners(direction)
        # Held here: a node that is stored may evict one that is still needed.
        known = {
            node: cached
            for node, _ in corners
            if (cached := self._at_vertices.find(node)) is not None
        }
        missing = [node for node, _ in corners if node not in known]
        of_nodes = self._of_nodes(missing)
        gathered = side_by_side([partial(self._gathered, *solved) for solved in of_nodes.items()])
        known |= zip(of_nodes, gathered, strict=True)
        tables = [
            (
                self._at_vertices.get(node, partial(known.__getitem__, node)),
                (weight * irradiance).astype(np.float32),
            )
            for node, weight in corners
        ]
        first_node = _in_rows(len(self._transport.vertex_rows))
        return SunTables(tables=tuple(tables), first_node=first_node)

    def lobes_at_vertices(self, nodes: Sequence[Node]) -> list[Array32] | None:
        """(s,) each: what gather points of vertices get of lobes by a Sun of 1 W/m2 in directions
        of the grid, before bounces, mean of the bands; None without lobes."""
        of_nodes = []
        for node in nodes:
            made = partial(self._gathered, node, self._of_nodes([node])[node])
            lobes = self._at_vertices.get(node, made).lobes
            if lobes is None:
                return None
            of_nodes.append(lobes)
        return of_nodes

    def parts_left(self, node: Node) -> int:
        """How many parts of what vertices get from a direction of the grid are to be made."""
        if node in self._at_vertices:
            return 0
        return self._making(node).left

    def make_part(self, node: Node) -> None:
        """Make the next of the parts that are left, each a quarter of the whole or less."""
        making = self._making(node)
        next(making.parts, None)
        making.left -= 1
        if making.left == 0:
            self._under_way.pop(node)

    def _making(self, node: Node) -> _UnderWay:
        transport = self._transport
        parts = 3 + 2 * (transport.grids is not None)
        parts += (transport.cells is not None) + (transport.means is not None)
        parts += transport.sun_sharpened is not None
        if self.lobes:
            parts += self.lobes.parts + 1
        return self._under_way.get(node, lambda: _UnderWay(parts=self._made(node), left=parts))

    def _made(self, node: Node) -> Iterator[None]:
        self._sunlit.at(node)
        yield
        solved = self._of_nodes([node])[node]
        yield
        at_vertices = yield from self._gather(node, solved, _one_by_one)
        self._at_vertices.put(node, at_vertices)

    def _gathered(self, node: Node, solved: Array32) -> AtVertices:
        """Of what leaves the patches (p, 4)."""
        gathering = self._gather(node, solved, side_by_side)
        while True:
            try:
                next(gathering)
            except StopIteration as end:
                at_vertices: AtVertices = end.value
                return at_vertices

    def _empty_rows(self) -> Array32:
        """(k, 4) of all vertices, then of all nodes, each filled up to whole rows."""
        grids = self._transport.grids
        nodes = 0 if grids is None else grids.rows
        count = _in_rows(len(self._transport.vertex_rows)) + _in_rows(nodes)
        return np.zeros((count, 4), dtype=np.float32)

    def _gather(
        self, node: Node, solved: Array32, worked_out: Callable[[list[Task]], Iterable[Array32]]
    ) -> Generator[None, None, AtVertices]:
        """What vertices and nodes get where so much leaves the patches (p, 4), with a pause between
        the parts of the work.

        worked_out : gives the results of tasks
        """
        transport, grids = self._transport, self._transport.grids
        rows, lobes = self._empty_rows(), None
        evenly = solved - self._of_first(node)[1] if self.lobes else solved
        at_points = transport.sun_gather @ evenly
        if grids is not None:
            yield
            at_points = np.concatenate([at_points, grids.gather @ evenly])
        sunlit, direction, on_cells = self._sunlit.at(node), direction_of(node), None
        if transport.cells is not None:
            yield
            asked, more = self._sunlit.more_on_cells(transport.cells, node)
            at_points += self._more_of_cells(transport.cells, direction, asked, more)
            if self.lobes:
                chosen = self.lobes.cells
                on_cells = self._sunlit.on_cells(transport.cells, chosen, node, asked, more)
        if transport.sun_sharpened is not None:
            yield
            at_points = transport.sun_sharpened @ at_points
        results: Iterator[Array32] = iter(())
        if self.lobes:
            lobes = np.zeros(transport.gather.shape[0], dtype=np.float32)
            parts = self.lobes.at_points(sunlit, direction, on_cells)
            of_others = partial(self.lobes.again_at_vertices, solved)
            results = iter(worked_out([*(part for _, part in parts), of_others]))
            for first, _ in parts:
                yield
                light = next(results)
                at_points[first : first + len(light)] += light
                if first == 0:
                    lobes += mean_of_bands(light)
        # Fewer rays tell what of a patch is dark than how much of it is seen; and linear light that
        # falls off to nothing within a triangle ends below it.
        np.maximum(at_points, 0.0, out=at_points)
        if transport.means is not None:
            yield
            for _ in range(TIMES):
                at_points = transport.means @ at_points
        again = None
        if self.lobes:
            yield
            again = next(results)
        count = len(transport.vertex_rows)
        if self._more_of_nodes is not None:
            yield
            more = self._more_of_nodes @ at_points
            rows[_in_rows(count) :][: len(more)] = more
        at_vertices = at_points[: transport.gather.shape[0]]
        if again is not None:
            # Nodes take what is linear between the vertices: this light has no sharp edges.
            at_vertices = np.maximum(at_vertices + again, 0.0)
        np.take(at_vertices, transport.vertex_rows, axis=0, out=rows[:count])
        return AtVertices(rows=rows.reshape(-1, 4 * _ROW), lobes=lobes)

    def _more_of_cells(
        self, cells: PatchCells, direction: Array, asked: IndexArray, more: Array32
    ) -> Array32:
        """(s + g, 4) what gather points get more as patches near them are lit in part: each sees
        the lit part or the dark one.

        asked, more : as of ``more_on_cells`` for a direction (3,)
        """
        even, _ = self._surface.of_sun(self._sunlit.facing(direction))
        reflected = even[cells.patch[asked]] * more[:, None]
        return np.asarray(cells.gather[asked].T @ reflected)

    @cached_property
    def _of_cells(self) -> Array32:
        """(p, 4, 96) exitance for each cell of radiance 1 in each band [W m-2 / (W m-2 sr-1)]."""
        albedo = self._surface.albedo
        if self.sky_lobes is not None:
            reflected = self.sky_lobes.leaving(albedo)
        else:
            # Rays follow the cosine: each stands for pi over their number.
            free = np.float32(np.pi) * self._transport.sky.toarray()
            reflected = albedo[:, :, None] * free[:, None]
        # A face of the sky at a time: less than 2 MB, which stays in the processor's cache.
        faces = np.split(reflected, 6, axis=2)
        return np.concatenate(
            [radiosity(self._transport, self._surface, face) for face in faces], axis=2
        )

    def _of_nodes(self, nodes: list[Node]) -> dict[Node, Array32]:
        """(p, 4) each for a Sun of 1 W/m2 in that direction, those in memory first."""
        # Held here: a node that is stored may evict one that is still needed.
        known = {node: cached for node in nodes if (cached := self._nodes.find(node)) is not None}
        known |= self._solved([node for node in nodes if node not in known])
        return {node: self._nodes.get(node, partial(known.__getitem__, node)) for node in nodes}

    def _solved(self, nodes: list[Node]) -> dict[Node, Array32]:
        """(p, 4) each for a Sun of 1 W/m2 in that direction."""
        if not nodes:
            return {}
        solved = self._bounced(nodes, [self._leaving(node) for node in nodes])
        if self.lobes:
            for node, exitance in solved.items():
                again = self.lobes.again_at_patches(exitance)
                solved[node] = exitance + self._surface.albedo * again
        return solved

    def _leaving(self, node: Node) -> Array32:
        """(p, 4) what leaves by a Sun of 1 W/m2 before bounces, and by that part of the second
        reflection by which lobes bring more than even light would."""
        even, lobes = self._of_first(node)
        leaving = even + lobes
        if self.lobes:
            sunlit, direction = self._sunlit.at(node), direction_of(node)
            more = self.lobes.at_patches(sunlit, direction, lobes)
            leaving += self._surface.albedo * more
        return leaving

    def _of_first(self, node: Node) -> tuple[Array32, Array32]:
        """(p, 4) what leaves by a Sun of 1 W/m2 before bounces: evenly, and in lobes."""
        cosines = self._sunlit.at(node).cosines[:, None]
        even, lobes = self._surface.of_sun(self._sunlit.facing(direction_of(node)))
        return even * cosines, lobes * cosines

    @cached_property
    def lobes(self) -> LobeSunlight:
        """What lobes make of sunlight."""
        return LobeSunlight(self._transport, self._surface.laws)

    @cached_property
    def sky_lobes(self) -> SkyLobes | None:
        """What lobes make of the light of the sky; None without lobes."""
        return SkyLobes(self._transport, self._surface.laws, self.lobes) if self.lobes else None

    def _reflected(self, names: list[Name], fields: list[Array32]) -> dict[Name, Array32]:
        """(p, 4) each by irradiance (p,) that is alike in all bands; together they take less
        time."""
        albedo = self._surface.albedo
        return self._bounced(names, [albedo * field[:, None] for field in fields])

    def _bounced(self, names: list[Name], leaving: list[Array32]) -> dict[Name, Array32]:
        """(p, 4) each after all bounces, by what leaves before (p, 4)."""
        solved = radiosity(self._transport, self._surface, np.stack(leaving, axis=2))
        return {name: np.ascontiguousarray(solved[:, :, i]) for i, name in enumerate(names)}
