"""Values at vertices and grid nodes between which light has the means that their rays found.

The rays of a gather point start at places around it. What they find is a mean over these places,
and where light falls off within centimetres it is not the light of the vertex: taken for it, linear
interpolation blurs the light a second time. With M the mean of what is interpolated over the places
of each gather point, M v = b gives values v whose interpolation has the means b that were found.
One step of Richardson's iteration from b, v = (2 - M) b, takes most of the error: M is near to 1,
and further steps only raise noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import sparse

from simgl.arrays import Array, IndexArray
from simgl.radiosity.gather_points import Places
from simgl.radiosity.light_grids import CUTS, STEPS
from simgl.radiosity.light_transport import LightGrids, LightTransport, by_columns

# Of weights.
_STEP = 2.0**-20
# Of places in steps of a grid, far beyond what float64 leaves unsure.
_ROUNDING = 1e-9


class _Entries(NamedTuple):
    """Of a sparse matrix."""

    rows: IndexArray
    columns: IndexArray
    values: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class _OpenPlaces:
    """Places that count, one by one.

    row : (m,) the gather point; side : (m,) 0 in front, 1 on the back
    triangle, weights : (m,) and (m, 3), as of ``Places``
    """

    row: IndexArray
    side: IndexArray
    triangle: IndexArray
    weights: Array

    def of(self, chosen: IndexArray) -> _OpenPlaces:
        """Some of them."""
        return _OpenPlaces(
            row=self.row[chosen],
            side=self.side[chosen],
            triangle=self.triangle[chosen],
            weights=self.weights[chosen],
        )


def sharpened(transport: LightTransport, at_vertices: Places) -> sparse.csc_matrix:
    """(s, s) 2 - M of the gather points of vertices, for light that is linear between vertices."""
    return _sharpened(_means(transport, None, at_vertices))


def sun_sharpened(
    transport: LightTransport, at_vertices: Places, at_nodes: Places | None
) -> sparse.csc_matrix:
    """(s + g, s + g) the same of those of vertices and grids, for light that has grids."""
    places = [at_vertices] if at_nodes is None else [at_vertices, at_nodes]
    rows = [_means(transport, transport.grids, some) for some in places]
    return _sharpened(sparse.vstack(rows, format="csr"))


def _sharpened(means: sparse.csr_matrix) -> sparse.csc_matrix:
    # In steps that float32 adds up exactly: rows whose sum is 1 leave a share of 1 as it is.
    means.data = np.round(means.data / _STEP) * _STEP
    # One inside another part keeps what it has: its row is empty.
    diagonal = 1.0 + np.asarray(means.sum(axis=1)).ravel()
    return by_columns((sparse.diags_array(diagonal) - means).astype(np.float32))


def _means(
    transport: LightTransport, grids: LightGrids | None, places: Places
) -> sparse.csr_matrix:
    """(n, s + g) with which weights gather points count at the open places of some of them, in the
    mean; nothing for those without any."""
    count, each = places.triangles.shape
    counts = (places.open & (places.triangles >= 0)).ravel()
    every = _OpenPlaces(
        row=np.repeat(np.arange(count), each),
        side=np.repeat(places.back.astype(np.int64), each),
        triangle=places.triangles.ravel(),
        weights=places.weights.reshape(-1, 3),
    ).of(np.flatnonzero(counts))
    vertices, nodes = transport.gather.shape[0], 0 if grids is None else grids.gather.shape[0]
    on_grid = np.zeros(len(transport.mesh.triangles), dtype=np.bool_)
    if grids is not None:
        on_grid[grids.triangles] = True
    of_grid = on_grid[every.triangle]
    parts = [_between_vertices(transport, every.of(np.flatnonzero(~of_grid)))]
    if grids is not None:
        parts += _between_nodes(transport, grids, every.of(np.flatnonzero(of_grid)))
    rows, columns, values = (np.concatenate(all_of) for all_of in zip(*parts, strict=True))
    number = np.bincount(every.row, minlength=count)
    entries = values / number[rows], (rows, columns)
    return sparse.csr_matrix(entries, shape=(count, vertices + nodes))


def _between_vertices(transport: LightTransport, at: _OpenPlaces) -> _Entries:
    """Linear between the corners of triangles."""
    corners = transport.mesh.triangles[at.triangle].astype(np.int64)
    columns = transport.gather_point_of_vertex[at.side[:, None], corners]
    return _Entries(np.repeat(at.row, 3), columns.ravel(), at.weights.ravel())


def _between_nodes(transport: LightTransport, grids: LightGrids, at: _OpenPlaces) -> list[_Entries]:
    """Linear between the nodes of grids, some of which have what is linear between the corners."""
    number = np.zeros(len(transport.mesh.triangles), dtype=np.int64)
    number[grids.triangles] = np.arange(len(grids.triangles))
    nodes, shares = nodes_around(at.weights)
    place, node, share = np.repeat(np.arange(len(nodes)), 3), nodes.ravel(), shares.ravel()
    point = grids.point_of_node[number[at.triangle[place]], node, at.side[place]]
    held = point >= 0
    columns = transport.gather.shape[0] + point[held]
    linear = replace(at.of(place[~held]), weights=STEPS[node[~held]] / CUTS)
    rest = _between_vertices(transport, linear)
    return [
        _Entries(at.row[place[held]], columns, share[held]),
        rest._replace(values=rest.values * np.repeat(share[~held], 3)),
    ]


def nodes_around(weights: Array) -> tuple[IndexArray, Array]:
    """(n, 3) nodes of the small triangle of a grid that each place lies in, and the shares that
    are linear between them.

    weights : (n, 3) of the grid's corners at the places
    """
    along = CUTS * weights
    low = np.floor(along + _ROUNDING).astype(np.int64)
    # On a node: any of the small triangles about it.
    on_node = np.flatnonzero(low.sum(axis=1) == CUTS)
    low[on_node, np.argmax(low[on_node], axis=1)] -= 1
    beyond = along - low
    # Small triangles stand as the grid does, or upside down.
    turned = low.sum(axis=1)[:, None] < CUTS - 1
    shares = np.where(turned, 1.0 - beyond, beyond)
    i, j = (low[:, [k]] + ((np.arange(3) == k) != turned) for k in range(2))
    return _NODE_OF_STEPS[i, j], np.clip(shares, 0.0, 1.0)


def _node_of_steps() -> IndexArray:
    number = np.full((CUTS + 1, CUTS + 1), -1)
    number[STEPS[:, 0], STEPS[:, 1]] = np.arange(len(STEPS))
    return number


# (CUTS + 1, CUTS + 1) nodes by their steps along the first two axes.
_NODE_OF_STEPS = _node_of_steps()
