"""Means over gather points near each other: what few rays miss of small bright surfaces evens out.

A thousand rays find a surface that covers a thousandth of the hemisphere once, or twice, or not at
all. Irradiance from surfaces changes over their harmonic mean distance (Ward et al. 1988): points
much closer to each other see the same of what is far, and what is near keeps them distinct.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from simgl.arrays import Array32, IndexArray, Mask
from simgl.radiosity.light_grids import CUTS, STEPS
from simgl.radiosity.light_transport import LightGrids, LightTransport, by_columns

# Of the harmonic mean distance: beyond, points do not count for each other. With twice as much,
# what is blurred beside contacts costs more than less noise brings.
_REACH = 0.05
# How often means are taken, each over those next to a point.
TIMES = 3
# Cosine between normals of one surface.
_SMOOTH = 0.99


def near_means(transport: LightTransport, nearness: Array32) -> sparse.csc_matrix:
    """(s + g, s + g) means over each gather point and those next to it, of vertices and of grids.

    nearness : (s + g,) of what each sees, as of ``mean_nearness`` [m-1]
    """
    grids, corners = transport.grids, transport.mesh.triangles.astype(np.int64)
    links = []
    for side, of_vertex in enumerate(transport.gather_point_of_vertex):
        at = of_vertex[corners]
        links += [at[:, [k, (k + 1) % 3]] for k in range(3)]
        if grids is not None:
            node, held = _points_of_nodes(transport, grids, side)
            links += _links_of_grids(node, held, of_vertex[corners[grids.triangles]])
    place, normal = transport.start_places, transport.start_normals
    return _means(np.concatenate(links), place, normal, nearness)


def _points_of_nodes(
    transport: LightTransport, grids: LightGrids, side: int
) -> tuple[IndexArray, Mask]:
    """(t, nodes) gather points of the nodes on a side, and whether they have one."""
    node = grids.point_of_node[:, :, side]
    return transport.gather.shape[0] + node, node >= 0


def _links_of_grids(node: IndexArray, held: Mask, corners: IndexArray) -> list[IndexArray]:
    """Pairs of gather points next to each other: nodes, and nodes with the vertices there.

    node, held : (t, nodes) gather points of the nodes, and whether they have one
    corners : (t, 3) those of the triangles' vertices
    """
    links = []
    for i, j in zip(*np.triu_indices(len(STEPS), 1), strict=True):
        if np.abs(STEPS[i] - STEPS[j]).max() == 1:
            both = held[:, i] & held[:, j]
            links.append(np.stack([node[both, i], node[both, j]], axis=1))
    for k in range(3):
        (at,) = np.flatnonzero(STEPS[:, k] == CUTS)
        links.append(np.stack([node[held[:, at], at], corners[held[:, at], k]], axis=1))
    return links


def _means(
    links: IndexArray, place: Array32, normal: Array32, nearness: Array32
) -> sparse.csc_matrix:
    count = len(place)
    first, second = np.sort(links[links[:, 0] != links[:, 1]], axis=1).T
    keys = np.sort(first * count + second)
    first, second = np.divmod(keys[np.diff(keys, prepend=-1) > 0], count)
    separation = np.linalg.norm(place[first] - place[second], axis=1)
    weight = 1.0 - separation * np.maximum(nearness[first], nearness[second]) / _REACH
    alike = np.einsum("ij,ij->i", normal[first], normal[second]) > _SMOOTH
    used = alike & (weight > 0.0)
    first, second, weight = first[used], second[used], weight[used]
    diagonal = np.arange(count)
    rows, columns = (
        np.concatenate([diagonal, first, second]),
        np.concatenate([diagonal, second, first]),
    )
    values = np.concatenate([np.ones(count), weight, weight])
    values /= np.bincount(rows, values)[rows]
    entries = values.astype(np.float32), (rows, columns)
    return by_columns(sparse.coo_matrix(entries, shape=(count, count)))
