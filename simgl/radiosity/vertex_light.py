"""What of the light between surfaces distinguishes one vertex from its neighbours."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from simgl.arrays import Array32
from simgl.radiosity.hemisphere import cosine_directions
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.sunlit_patches import SunlitPatches

# Directions of the Sun over each half of the sky.
_SUNS = 6
# Reflectance of all surfaces: what matters is where light comes from.
_REFLECTANCE = np.float32(0.6)
# Of full sunlight, a vertex may get so much less or more from its body's surfaces.
_STEP = 0.03


def light_on_vertices(transport: LightTransport) -> Array32:
    """(v, k) light of the body's own surfaces on each vertex with the Sun in k directions, in steps
    of 3 % of full sunlight.

    Vertices that differ little in any of these stand for each other under any light.
    """
    half = cosine_directions(_SUNS)
    lit = SunlitPatches(transport)
    direct = np.stack([lit.cosines(sun) for sun in np.concatenate([half, -half])], axis=1)
    left = _REFLECTANCE * direct
    left = left + _REFLECTANCE * (transport.form_factors @ left)
    arriving = (transport.gather @ left) / _STEP
    values = np.concatenate([arriving[sites] for sites in transport.site_of_vertex], axis=1)
    return np.asarray(_mean_of_neighbours(transport, values), dtype=np.float32)


def _mean_of_neighbours(transport: LightTransport, values: Array32) -> Array32:
    """Over each vertex and those that share triangles with it: a site's rays leave 3 % of noise."""
    triangles, count = transport.mesh.triangles.astype(np.int64), len(values)
    corner = np.repeat(np.arange(len(triangles)), 3)
    shape = len(triangles), count
    touching = sparse.csr_matrix((np.ones(len(corner)), (corner, triangles.ravel())), shape)
    total = touching.T @ (touching @ values) + values
    return total / (3.0 * (touching.T @ np.ones(len(triangles))) + 1.0)[:, None]
