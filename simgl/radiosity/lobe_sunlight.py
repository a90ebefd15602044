"""Sunlight that glossy patches send on in lobes: by where it goes, not evenly over the hemisphere.

Followed so are the first reflection of the Sun's light and, as if it came from one direction, what
glossy patches get of all others. What they send to each other otherwise leaves evenly.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from itertools import pairwise

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Array32, IndexArray, Mask
from simgl.radiosity.gather_points import middle_and_radius, open_in_turn, unit_rows
from simgl.radiosity.glossy_places import GRAZING, GlossyPlaces, above
from simgl.radiosity.in_turn import side_by_side
from simgl.radiosity.light_transport import LightTransport, by_columns
from simgl.radiosity.lobe_pairs import Light, LightOnPatches, LobePairs, SunOnPlaces
from simgl.radiosity.reflection_laws import ReflectionLaws, lost_by_widening
from simgl.radiosity.sunlit_patches import HiddenPatches, Sunlit

# Of the work for one direction of the Sun, for vertices and for grids each.
PARTS = 2
# Of how directions spread about their mean, what widens lobes: slopes are half as wide.
_OF_SPREAD = 0.25
# Patches that get less of others than this, by a Sun of 1 W/m2, send that evenly; as do those that
# get more, as much as their lobes are less than all that they send.
_DIM = 0.02
# Patches nearby, and those that cover so much more of the hemisphere than their area could from
# their middle, as do the lines between solar cells, are around: their light has no direction and
# goes on evenly. Few rays tell little of those that cover less than this.
_NEAR, _AROUND, _SMALL = 1.3, 1.5, 0.02
# What a cell of the sky, as wide as these lie apart, widens the squared width of lobes by.
_OF_CELL = 0.02


class LobeSunlight:
    """What the lobes of a body's patches make of the Sun's light.

    laws : of the body's materials
    """

    def __init__(self, transport: LightTransport, laws: ReflectionLaws) -> None:
        self._transport, self._laws = transport, laws
        self._places = GlossyPlaces(transport, laws)

    def __bool__(self) -> bool:
        """Whether there is any."""
        return self._places.count > 0

    @property
    def glossy(self) -> IndexArray:
        """(g,) which patches have lobes that are followed."""
        return self._places.glossy

    @property
    def cells(self) -> IndexArray:
        """(c,) which of the transport's cells send light by themselves."""
        return self._places.cells

    @property
    def nbytes(self) -> int:
        """Size of its arrays, which it makes at the latest now."""
        of_points = sum(pairs.nbytes for pairs in self._to_points)
        return of_points + self._to_patches.nbytes

    @property
    def parts(self) -> int:
        """Of ``at_points``."""
        return PARTS * len(self._to_points)

    def at_points(
        self, sunlit: Sunlit, direction: Array, on_cells: Array32 | None
    ) -> list[tuple[int, Callable[[], Array32]]]:
        """What gather points, of vertices and then of grids, get of the lobes of a Sun of 1 W/m2,
        in parts: the first point, and what works out (n, 4) more from that on.

        direction : (3,) unit, towards the Sun
        on_cells : of ``cells`` their cosines to it, 0 in shadow; None without cells
        """
        lights = self._sunlight(sunlit.lit, sunlit.cosines, direction, on_cells)
        parts: list[tuple[int, Callable[[], Array32]]] = []
        start = 0
        for pairs in self._to_points:
            reached = [np.array_split(pairs.reached(light), PARTS) for light in lights]
            for rows in zip(*reached, strict=True):
                lit_rows = list(zip(lights, rows, strict=True))
                parts.append((start, partial(pairs.sent, lit_rows)))
            start += pairs.count
        return parts

    def at_patches(self, sunlit: Sunlit, direction: Array, evenly: Array32) -> Array32:
        """(p, 4) the same of patches."""
        even = self._transport.form_factors @ evenly
        lights = self._sunlight(sunlit.lit, sunlit.cosines, direction, None)
        return _sent(self._to_patches, lights) - even

    def hidden_at_vertices(
        self, hidden: HiddenPatches, direction: Array, on_cells: Array32 | None
    ) -> Array32:
        """(s,) what gather points of vertices would get of the lobes of light that others take
        from a Sun of 1 W/m2, mean of the bands.

        on_cells : as of ``at_points``, where that light is taken
        """
        lights = self._sunlight(hidden.samples, hidden.cosines, direction, on_cells)
        return mean_of_bands(_sent(self._to_points[0], lights))

    def again_at_vertices(self, exitance: Array32) -> Array32:
        """(s, 4) what gather points of vertices get more than if lobes sent evenly what they get of
        other patches.

        exitance : (p, 4) of the patches [W m-2]
        """
        light, evenly = self._light_of_others(exitance)
        sent = _sent(self._to_points[0], [light])
        return np.asarray(sent - self._transport.sun_gather @ evenly)

    def again_at_patches(self, exitance: Array32) -> Array32:
        """(p, 4) the same of patches."""
        light, evenly = self._light_of_others(exitance)
        sent = _sent(self._to_patches, [light])
        return np.asarray(sent - self._transport.form_factors @ evenly)

    def of_sky(self, towards: Array32, irradiance: Array32) -> tuple[Array32, Array32]:
        """(s, 4) and (p, 4) what gather points of vertices and patches get of lobes of light from a
        cell of the sky, alike in all bands.

        towards, irradiance : (g, 3) unit and (g,) of the patches ``glossy``
        """
        law = self._places.law_of_patch
        raised, facing = above(towards, self._places.normal)
        alpha2 = self._laws.alpha2[law]
        wider = np.minimum(alpha2 + np.float32(_OF_CELL), np.float32(1.0))
        arriving = (
            lost_by_widening(alpha2, wider) * irradiance * self._laws.taking_part(law, facing)
        )
        light = LightOnPatches(
            bright=irradiance > 0.0,
            direction=np.ascontiguousarray(raised.T),
            facing=facing,
            spread2=np.full_like(facing, _OF_CELL),
            arriving=np.tile(arriving[:, None], 4),
        )
        return _sent(self._to_points[0], [light]), _sent(self._to_patches, [light])

    @cached_property
    def _normals(self) -> Array32:
        """(3, k) of the places, coordinate by coordinate."""
        return np.ascontiguousarray(self._places.normals.T)

    @cached_property
    def _to_points(self) -> list[LobePairs]:
        """To those of vertices and, where there are any, of grids."""
        transport = self._transport
        matrices = [transport.sun_gather]
        if transport.grids is not None:
            matrices.append(transport.grids.gather)
        ends = np.cumsum([0, *(gather.shape[0] for gather in matrices)]).tolist()
        parts = [slice(*ends_of) for ends_of in pairwise(ends)]
        some = zip(matrices, parts, strict=True)
        return side_by_side([partial(self._to_some, gather, part) for gather, part in some])

    def _to_some(self, gather: sparse.csc_matrix, part: slice) -> LobePairs:
        """To some of the gather points."""
        transport, cells = self._transport, None
        if transport.cells is not None:
            cells = transport.cells.gather[self._places.cells, part]
        seen = gather[:, self._places.glossy].tocsr().tocoo()
        pairs = self._places.pairs(
            seen,
            transport.start_places[part],
            transport.start_normals[part],
            transport.start_radii[part],
            cells,
        )
        return LobePairs(pairs, self._places, self._laws)

    @cached_property
    def _to_patches(self) -> LobePairs:
        transport = self._transport
        seen = transport.form_factors[:, self._places.glossy].tocsr().tocoo()
        # Of the sample points whose rays count, as ``form_factors`` has them.
        places, normals = (
            open_in_turn(vectors, transport.point_open)
            for vectors in (transport.points, transport.normals)
        )
        normal = unit_rows(normals.mean(axis=1).astype(np.float64)).astype(np.float32)
        middle, radius = middle_and_radius(places)
        pairs = self._places.pairs(seen, middle, normal, radius)
        return LobePairs(pairs, self._places, self._laws)

    @cached_property
    def _seen(self) -> tuple[sparse.csc_matrix, sparse.csc_matrix]:
        """(g, p) what glossy patches see of all that have a direction, and (3 g, p) that times each
        coordinate of the directions to these, less as these spread over the patch."""
        transport, places = self._transport, self._places
        seen = transport.form_factors.tocsr()[places.glossy].tocoo()
        away = transport.points.mean(axis=1)[seen.col] - places.middle[seen.row]
        distance = np.maximum(np.linalg.norm(away, axis=1), 1e-9)
        away /= distance[:, None]
        facing = np.maximum(np.einsum("ni,ni->n", away, places.normal[seen.row]), 0.0)
        # Of the patch as a disc that faces the place, the solid angle over pi.
        size = transport.areas[seen.col] / (np.pi * distance**2)
        away /= np.sqrt(1.0 + size)[:, None]
        has = (size < _NEAR) & (seen.data < _AROUND * size * facing)
        has = np.flatnonzero(has | (seen.data < _SMALL))
        entries = seen.data[has], (seen.row[has], seen.col[has])
        seen, away = sparse.coo_matrix(entries, shape=seen.shape), away[has]
        towards = sparse.vstack(
            [
                sparse.coo_matrix((seen.data * axis, (seen.row, seen.col)), shape=seen.shape)
                for axis in away.T
            ]
        )
        return by_columns(seen), by_columns(towards.astype(np.float32))

    def _sunlight(
        self, samples: Mask, cosines: Array32, direction: Array, on_cells: Array32 | None
    ) -> list[SunOnPlaces]:
        """The light of a Sun of 1 W/m2 on sample points (p, n), on patches by their mean cosines
        (p,), and on cells; not on these where they are not asked for."""
        glossy, places = self._places.glossy, self._places
        lit = (samples & self._transport.point_open)[glossy].ravel()
        towards = direction.astype(np.float32)
        # Not by BLAS: its threads keep the cores busy while they wait for the next product.
        facing = np.einsum("in,i->n", self._normals, towards)
        arriving = np.zeros_like(facing)
        np.multiply(np.maximum(facing[: len(lit)], 0.0), lit, out=arriving[: len(lit)])
        arriving[len(lit) : len(lit) + len(glossy)] = cosines[glossy]
        if on_cells is not None:
            arriving[len(lit) + len(glossy) :] = on_cells
        places_lit = np.flatnonzero(arriving > 0.0)
        low = places_lit[facing[places_lit] < GRAZING]
        by, scale = np.zeros_like(facing), np.ones_like(facing)
        by[low] = GRAZING - facing[low]
        # Of the direction and so much of the normal.
        length2 = 1.0 + by[low] * (2.0 * facing[low] + by[low])
        scale[low] = 1.0 / np.sqrt(np.maximum(length2, np.float32(1e-18)))
        facing[low] = GRAZING * scale[low]
        np.maximum(facing, np.float32(0.5 * GRAZING), out=facing)
        taking_part = self._laws.taking_part(places.law[places_lit], facing[places_lit])
        arriving[places_lit] *= taking_part
        on_low = np.zeros_like(arriving)
        on_low[low] = arriving[low]
        arriving[low] = 0.0
        return [
            SunOnPlaces(direction=towards, arriving=arriving, facing=facing, raised=None),
            SunOnPlaces(direction=towards, arriving=on_low, facing=facing, raised=(by, scale)),
        ]

    def _light_of_others(self, exitance: Array32) -> tuple[LightOnPatches, Array32]:
        """The light of other patches (p, 4), and what lobes send of it if evenly (p, 4).

        It counts as if it came from its mean direction, and lobes are widened by how much
        directions spread about that.
        """
        seen, towards = self._seen
        irradiance, law = seen @ exitance, self._places.law_of_patch
        bright = irradiance.max(axis=1) * self._laws.part_of_lobe[law] > _DIM
        some = np.flatnonzero(bright)
        vector = (towards @ mean_of_bands(exitance)).reshape(3, -1)[:, some]
        law, irradiance = law[some], irradiance[some]
        length = np.linalg.norm(vector, axis=0)
        ratio = np.minimum(length / np.maximum(mean_of_bands(irradiance), np.float32(1e-9)), 1.0)
        from_ = vector / np.maximum(length, np.float32(1e-9))
        spread2 = _OF_SPREAD * (1.0 - ratio * ratio)
        evenly = np.zeros_like(exitance)
        evenly[self._places.glossy[some]] = self._laws.lobe_albedo[law] * irradiance
        alpha2 = self._laws.alpha2[law]
        remaining = lost_by_widening(alpha2, np.minimum(alpha2 + spread2, np.float32(1.0)))
        raised, facing = above(from_.T, self._places.normal[some])
        remaining *= self._laws.taking_part(law, facing)

        def of_all(values: Array32) -> Array32:
            placed = np.zeros((*values.shape[:-1], len(bright)), dtype=np.float32)
            placed[..., some] = values
            return placed

        light = LightOnPatches(
            bright=bright,
            direction=of_all(raised.T),
            facing=of_all(facing),
            spread2=of_all(spread2),
            arriving=of_all((remaining[:, None] * irradiance).T).T,
        )
        return light, evenly


def mean_of_bands(light: Array32) -> Array32:
    """(n,) of (n, 4): numpy's means take three times as long over rows of four."""
    return np.einsum("nb->n", light) * np.float32(0.25)


def _sent(pairs: LobePairs, lights: Sequence[Light]) -> Array32:
    """(r, 4) what receivers get of lobes [W m-2]."""
    return pairs.sent([(light, pairs.reached(light)) for light in lights])
