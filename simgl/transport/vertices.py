"""What of the light between surfaces distinguishes one vertex from its neighbours."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from simgl.transport.transport import Floats, Transport

# Groups of patches along each axis of the body.
_ACROSS = 2
# Of a vertex's cosine-weighted hemisphere, this may be filled by another group.
_STEP = 0.1
# Means over neighbours, so often: 256 rays find half of a hemisphere to 0.03 only.
_SMOOTHED = 2


def light_on_vertices(transport: Transport) -> Floats:
    """(v, k) share of each vertex's hemisphere that groups of patches cover, in steps of 10 %.

    Where neighbours have the same ones, light that comes from the body's own surfaces, and light
    of the sky that they leave, is the same: whatever shines on the body.
    """
    places = transport.points.mean(axis=1)
    low, high = places.min(axis=0), places.max(axis=0)
    cell = np.clip(_ACROSS * (places - low) / np.maximum(high - low, 1e-9), 0, _ACROSS - 1)
    group = cell.astype(np.int64) @ np.array([_ACROSS**2, _ACROSS, 1])
    groups = np.zeros((len(places), _ACROSS**3), dtype=np.float32)
    groups[np.arange(len(places)), group] = 1.0 / _STEP
    seen = transport.gather @ groups
    values = np.concatenate([seen[row] for row in transport.site_of_vertex], axis=1)
    triangles = transport.mesh.triangles.astype(np.int64)
    ends = np.concatenate([triangles, np.roll(triangles, -1, axis=1)], axis=0)
    pairs = np.concatenate([ends[:, :2], ends[:, 1:], np.tile(np.arange(len(values)), (2, 1)).T])
    near = sparse.csr_matrix((np.ones(len(pairs)), pairs.T), shape=(len(values),) * 2)
    near = near + near.T
    count = np.asarray(near.sum(axis=1)).ravel()
    for _ in range(_SMOOTHED):
        values = (near @ values) / count[:, None]
    return values.astype(np.float32)
