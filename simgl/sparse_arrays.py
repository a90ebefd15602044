"""Sparse matrices as plain arrays, for files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.sparse import csc_matrix, csr_array, csr_matrix


def matrix_arrays(name: str, matrix: csr_array | csr_matrix | csc_matrix) -> dict[str, Any]:
    """The arrays of a matrix, named after it."""
    return {
        f"{name}.data": matrix.data,
        f"{name}.indices": matrix.indices,
        f"{name}.indptr": matrix.indptr,
        f"{name}.shape": np.array(matrix.shape),
    }


def matrix_of(name: str, arrays: Mapping[str, Any]) -> csr_array:
    """The matrix of arrays; ValueError where an index points nowhere: compiled code reads it."""
    parts = tuple(arrays[f"{name}.{part}"] for part in ("data", "indices", "indptr"))
    matrix = csr_array(parts, shape=tuple(arrays[f"{name}.shape"]))
    matrix.check_format(full_check=True)
    return matrix
