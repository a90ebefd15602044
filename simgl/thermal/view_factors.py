"""How the patches of a body see each other and space: form factors, and Gebhart's factors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from simgl.arrays import Array, Mask
from simgl.radiosity.bake import patch_form_factors
from simgl.radiosity.patches import Patches
from simgl.rays import RayTracer
from simgl.scene.mesh import Mesh

# Of the sky, on each face of a cube: 7.5 deg apart.
CELLS_ACROSS = 12
# Cosine-weighted rays of a patch, a multiple of its sample points: 0.5 % of what it sees.
RAYS = 512
# Rounds of scaling that make rows sum to what rays met, and stay symmetric.
_ROUNDS = 100
# Pairs are left out that exchange less than this share of what they would if a patch's emission
# were spread over all: 0.1 % of the emission of a spacecraft of 3,000 patches, and 3 ms a step.
_LEFT_OUT = 0.05


@dataclass(frozen=True, kw_only=True, eq=False)
class ViewFactors:
    """Which share of a patch's hemisphere each patch and each cell of the sky covers.

    areas : (p,) [m2]
    factors : (p, p) csr, reciprocal: areas_i factors_ij = areas_j factors_ji
    sky : (p, 6 CELLS_ACROSS^2) csr; a row sums with that of ``factors`` to 1
    covered : (p,) patches inside other parts, which see nothing
    point_open : (p, n) sample points that are outside other parts
    """

    areas: Array
    factors: sparse.csr_matrix
    sky: sparse.csr_matrix
    covered: Mask
    point_open: Mask


def view_factors(mesh: Mesh, sides: int, patches: Patches) -> ViewFactors:
    """The view factors of a body by tracing rays.

    Rays from both ends of a pair are averaged, which makes the pair reciprocal; scaling rows and
    columns alike (Sinkhorn 1964) then keeps each row's sum, so that a closed box stays closed.
    """
    factors, sky, point_open = patch_form_factors(
        mesh, RayTracer(mesh), sides, patches, RAYS, CELLS_ACROSS
    )
    areas = patches.areas
    to_sky = np.asarray(sky.sum(axis=1), dtype=np.float64).ravel()
    to_body = np.asarray(factors.sum(axis=1), dtype=np.float64).ravel()
    covered = (to_sky + to_body < 0.5) | (areas <= 0.0)
    open_area = np.where(covered, 0.0, areas)
    pairs = sparse.diags_array(open_area) @ factors.astype(np.float64)
    pairs = sparse.csr_matrix(0.5 * (pairs + pairs.T))
    pairs = _without(pairs, covered)
    wanted = open_area * to_body
    for _ in range(_ROUNDS):
        sums = np.asarray(pairs.sum(axis=1)).ravel()
        scale = np.sqrt(np.divide(wanted, sums, out=np.ones_like(sums), where=sums > 0.0))
        if np.all(np.abs(scale - 1.0) < 1e-10):
            break
        pairs = sparse.csr_matrix(sparse.diags_array(scale) @ pairs @ sparse.diags_array(scale))
    sums = np.asarray(pairs.sum(axis=1)).ravel()
    excess = np.minimum(1.0, np.divide(open_area, sums, out=np.ones_like(sums), where=sums > 0.0))
    # A pair gives up what the fuller of its patches has too much.
    entries = pairs.tocoo()
    data = entries.data * np.minimum(excess[entries.row], excess[entries.col])
    pairs = sparse.csr_matrix((data, (entries.row, entries.col)), shape=pairs.shape)
    inverse = np.divide(1.0, open_area, out=np.zeros_like(areas), where=open_area > 0.0)
    reciprocal = sparse.csr_matrix(sparse.diags_array(inverse) @ pairs)
    rest = np.where(covered, 0.0, 1.0 - np.asarray(reciprocal.sum(axis=1)).ravel())
    seen = np.divide(rest, to_sky, out=np.zeros_like(rest), where=to_sky > 0.0)
    return ViewFactors(
        areas=areas,
        factors=reciprocal,
        sky=sparse.csr_matrix(sparse.diags_array(seen) @ sky.astype(np.float64)),
        covered=covered,
        point_open=point_open,
    )


def _without(matrix: sparse.csr_matrix, rows: Mask) -> sparse.csr_matrix:
    """A matrix with these rows and columns empty."""
    rest = sparse.diags_array((~rows).astype(np.float64))
    return sparse.csr_matrix(rest @ matrix @ rest)


def radiative_coupling(views: ViewFactors, emissivity: Array) -> tuple[sparse.csr_matrix, Array]:
    """Exchange areas of grey, diffuse patches after all reflections (Gebhart 1961).

    emissivity : (p,) above 0
    returns : (p, p) csr, symmetric with a zero diagonal, and (p,) to space [m2]

    With H the irradiance, H = F (eps sigma T^4 + (1 - eps) H): what patch i absorbs of the emission
    of j is A_i eps_i [(I - F rho)^-1 F]_ij eps_j sigma T_j^4. Small entries are left out in pairs,
    as if both patches were as warm.
    """
    absorbing = np.where(views.covered, 0.0, emissivity)
    rho = np.where(views.covered, 0.0, 1.0 - emissivity)
    scale = views.areas * absorbing
    concerned = np.flatnonzero(np.diff(views.factors.indptr))
    factors = views.factors[concerned][:, concerned].toarray()
    matrix = np.eye(len(concerned)) - factors * rho[concerned]
    gebhart = np.linalg.solve(matrix, factors) if len(concerned) else factors
    pairs = scale[concerned, None] * gebhart * absorbing[concerned]
    pairs = 0.5 * (pairs + pairs.T)
    total = np.zeros(len(scale))
    total[concerned] = pairs.sum(axis=1)
    to_space = np.maximum(scale - total, 0.0)
    np.fill_diagonal(pairs, 0.0)
    if len(concerned):
        small = _LEFT_OUT / len(concerned) * np.minimum.outer(scale[concerned], scale[concerned])
        pairs[pairs < small] = 0.0
    rows, columns = np.nonzero(pairs)
    shape = views.factors.shape
    entries = pairs[rows, columns], (concerned[rows], concerned[columns])
    return sparse.csr_matrix(entries, shape=shape), to_space


def absorbed_light(views: ViewFactors, absorptance: Array, irradiance: Array) -> Array:
    """(p,) share of the light on patches that they absorb after all reflections [W m-2].

    absorptance : (p,)
    irradiance : (p,) that arrives from outside [W m-2]
    """
    rho = np.where(views.covered, 0.0, 1.0 - absorptance)
    total = bounce = irradiance
    largest = float(np.max(np.abs(irradiance), initial=0.0))
    for _ in range(500):
        bounce = views.factors @ (rho * bounce)
        total = total + bounce
        if float(np.max(bounce, initial=0.0)) <= 1e-7 * largest:
            break
    return np.asarray(absorptance * total)
