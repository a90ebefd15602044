"""What a body has inside: nodes without a surface, and paths of heat between them and its parts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from simgl.arrays import Array
from simgl.errors import SimglError
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.thermal_surface import links_problem


def linked_pairs(model: SpacecraftModel) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """(k, k) conductances [W K-1] and radiative couplings [m2] between structures and nodes.

    Both are symmetric with a zero diagonal; parts come first, then nodes. Raises SimglError for
    links that join no network.
    """
    problem = links_problem(model.parts, model.thermal_nodes, model.thermal_links)
    if problem is not None:
        raise SimglError(f"model {model.name}: {' '.join(problem)}")
    names = {name: place for place, name in enumerate([*model.parts, *model.thermal_nodes])}
    ends = [[names[name] for name in link.between] for link in model.thermal_links]
    conductance = [link.conductance for link in model.thermal_links]
    radiative = [link.radiative_coupling for link in model.thermal_links]
    return _symmetric(ends, conductance, len(names)), _symmetric(ends, radiative, len(names))


def _symmetric(
    ends: Sequence[Sequence[int]], values: Sequence[float], size: int
) -> sparse.csr_matrix:
    nonzero = np.flatnonzero(values)
    first, second = np.array(ends, dtype=np.int64).reshape(-1, 2)[nonzero].T
    half = sparse.csr_matrix((np.array(values)[nonzero], (first, second)), shape=(size, size))
    return sparse.csr_matrix(half + half.T)


def laplacian(pairs: sparse.csr_matrix) -> sparse.csr_matrix:
    """The Laplacian of conductances between nodes: rows sum to 0.

    pairs : (n, n) symmetric, zero diagonal
    """
    sums: Array = np.asarray(pairs.sum(axis=1)).ravel()
    return sparse.csr_matrix(sparse.diags_array(sums) - pairs)
