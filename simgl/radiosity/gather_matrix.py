"""What the vertices of a body get of its patches and of the sky."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from simgl.arrays import IndexArray, Mask
from simgl.radiosity.light_transport import LightTransport


@dataclass(frozen=True, kw_only=True, eq=False)
class GatherMatrix:
    """Rows of a ``LightTransport`` for each vertex and each of its sides, r in all.

    shape : (vertices, sides), whose product is r
    gather : two csr (r, p), about as many entries in each
    sky_part : (r, 96) csr, and whether it is what is seen, ``sky_part_seen`` (r,)
    whole, whole_row : all of the sky, and its row for each
    """

    shape: tuple[int, int]
    gather: tuple[sparse.csr_matrix, sparse.csr_matrix]
    sky_part: sparse.csr_matrix
    sky_part_seen: Mask
    whole: sparse.csr_matrix
    whole_row: IndexArray


def vertex_rows(transport: LightTransport) -> GatherMatrix:
    """The rows of all vertices of a body."""
    site = transport.site_of_vertex
    rows = site.T.ravel()
    gather = transport.gather[rows]
    middle = int(np.searchsorted(gather.indptr, gather.nnz // 2))
    return GatherMatrix(
        shape=(site.shape[1], site.shape[0]),
        gather=(gather[:middle], gather[middle:]),
        sky_part=transport.sky_part[rows],
        sky_part_seen=transport.sky_part_seen[rows],
        whole=transport.whole,
        whole_row=transport.whole_row[rows],
    )
