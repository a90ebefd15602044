"""A thermal network: nodes that store, conduct and radiate heat, stepped implicitly in time."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from simgl.arrays import Array
from simgl.errors import SimglError
from simgl.lru_cache import LruCache
from simgl.physics.constants import STEFAN_BOLTZMANN

# Cosmic background (Fixsen 2009) [K].
SPACE_TEMPERATURE = 2.7255

# Newton's method ends where the heat that is not accounted for is below this share of what flows
# through each node, and through all of them together.
BALANCE = 3e-7
_MAX_STEPS = 60
# Of the radiative exchange that the direction of a step knows.
_MAIN_SHARE = 0.9
# Of the linear systems: share of the right-hand side that is left, and directions at most.
_ACCURACY, _MAX_DIRECTIONS = 1e-2, 60
# The factorised matrix takes all nodes to be as warm, so that it depends on nothing but the length
# of the step: a step is a pure function, to the last bit [K].
_REFERENCE = 280.0
# Long enough that nothing is stored any more, short enough for the matrix to stay regular: a node
# without any coupling stays as it is.
_FOR_EVER = 1e13  # [s]
_COLDEST = 2.0  # [K]


@dataclass(frozen=True, kw_only=True, eq=False)
class ThermalNetwork:
    """Heat balance of n nodes, C dT/dt = Q - L T - sigma X T^4 + sigma g T_space^4.

    capacity : (n,) C [J K-1], above 0
    conduction : (n, n) csr L, conductances [W K-1] as a Laplacian: rows sum to 0
    coupling : (n, n) csr, symmetric, zero diagonal: the radiative exchange area between two nodes,
        area times emissivity times Gebhart's factor [m2]
    to_space : (n,) g, the same to space [m2]
    """

    capacity: Array
    conduction: sparse.csr_matrix
    coupling: sparse.csr_matrix
    to_space: Array
    space_temperature: float = SPACE_TEMPERATURE
    _factors: LruCache[float, SuperLU] = field(default_factory=lambda: LruCache(4), repr=False)

    def __post_init__(self) -> None:
        if not np.all(self.capacity > 0.0):
            raise ValueError("every node needs a heat capacity above 0")

    @cached_property
    def emitting_area(self) -> Array:
        """(n,) sum of a node's radiative exchange areas [m2]."""
        return np.asarray(self.coupling.sum(axis=1)).ravel() + self.to_space

    @cached_property
    def _main_coupling(self) -> sparse.csr_matrix:
        """What the direction of a step knows of ``coupling``: the tenth of the pairs that exchange
        nine tenths."""
        pairs = self.coupling.tocoo()
        emitting = np.maximum(self.emitting_area, 1e-30)
        strength = pairs.data / np.sqrt(emitting[pairs.row] * emitting[pairs.col])
        order = np.argsort(-strength, kind="stable")
        share = np.cumsum(pairs.data[order]) / max(float(pairs.data.sum()), 1e-300)
        main = order[: int(np.searchsorted(share, _MAIN_SHARE)) + 1]
        entries = pairs.data[main], (pairs.row[main], pairs.col[main])
        return sparse.csr_matrix(entries, shape=pairs.shape)

    @cached_property
    def digest(self) -> str:
        """Hash of the content."""
        h = hashlib.sha256(repr(self.space_temperature).encode())
        for matrix in (self.conduction, self.coupling):
            for array in (matrix.data, matrix.indices, matrix.indptr):
                h.update(array.tobytes())
        h.update(self.capacity.tobytes() + self.to_space.tobytes())
        return h.hexdigest()

    def net_heat(self, temperatures: Array, heat: Array) -> Array:
        """(n,) heat that nodes gain [W].

        temperatures : (n,) [K]
        heat : (n,) absorbed light and internal power [W]
        """
        fourth = STEFAN_BOLTZMANN * temperatures**4
        space = STEFAN_BOLTZMANN * self.space_temperature**4
        gained = heat - self.conduction @ temperatures + self.coupling @ fourth
        return np.asarray(gained - self.emitting_area * fourth + self.to_space * space)

    def step(self, temperatures: Array, before: Array, after: Array, seconds: float) -> Array:
        """(n,) temperatures after a time, right to the second order of the step [K].

        temperatures : (n,) before [K]
        before, after : (n,) absorbed light and internal power at both ends, linear between [W]

        Implicit Euler by one full step and by two halves, extrapolated (Richardson): the errors of
        the first order cancel. A mode that decays fast is damped to 4 % or less of itself in a long
        step, and a foil ends it near the balance with the heat at its end.
        """
        full = self.implicit_step(temperatures, 0.5 * (before + after), seconds)
        half = self.implicit_step(temperatures, 0.75 * before + 0.25 * after, 0.5 * seconds)
        halves = self.implicit_step(half, 0.25 * before + 0.75 * after, 0.5 * seconds)
        return np.maximum(2.0 * halves - full, _COLDEST)

    def implicit_step(self, temperatures: Array, heat: Array, seconds: float) -> Array:
        """(n,) temperatures after a time, by the implicit Euler method [K].

        temperatures : (n,) before [K]
        heat : (n,) mean of absorbed light and internal power over the step [W]

        Newton's method on the heat balance of the end of the step; the linear systems are solved by
        GMRES, preconditioned by the factorised matrix without the radiation between nodes. Raises
        SimglError where no balance is reached.
        """
        t = np.maximum(temperatures, _COLDEST)
        stored = self.capacity / seconds
        linear = stored + self.conduction.diagonal()
        for _ in range(_MAX_STEPS):
            residual = self.net_heat(t, heat) - stored * (t - temperatures)
            if self._balanced(t, heat, residual, stored):
                return t
            slope = 4.0 * STEFAN_BOLTZMANN * t**3
            change = self._solved(stored, slope, residual, seconds) / t
            # The balance of a node that radiates is linear in T^4, that of others in T.
            radiates = self.emitting_area * slope
            radiates /= radiates + linear
            by_fourth = np.sqrt(np.sqrt(np.maximum(1.0 + 4.0 * change, 0.0)))
            ratio = radiates * by_fourth + (1.0 - radiates) * (1.0 + change)
            # From far below, Newton's method on T^4 shoots up to where emission is far too strong.
            t = t * np.clip(ratio, 0.5, 2.0)
        raise SimglError(f"no heat balance after {_MAX_STEPS} iterations of {seconds:g} s")

    def steady(self, heat: Array, start: Array | None = None) -> Array:
        """(n,) temperatures at which every node gives off what it gets [K].

        start : (n,) first guess; a node that couples to nothing stays there
        """
        first = np.full(len(self.capacity), 280.0) if start is None else start
        return self.implicit_step(first, heat, _FOR_EVER)

    def _balanced(self, t: Array, heat: Array, residual: Array, stored: Array) -> bool:
        flows = np.abs(heat) + self.emitting_area * STEFAN_BOLTZMANN * t**4 + 1e-30
        # A short step of a heavy node: no temperature of float64 is nearer.
        left = np.maximum(np.abs(residual) - stored * np.spacing(t), 0.0)
        return bool(left.sum() <= BALANCE * flows.sum() and np.all(left <= BALANCE * flows.max()))

    def _solved(self, stored: Array, slope: Array, residual: Array, seconds: float) -> Array:
        def factorised() -> SuperLU:
            emission = self.emitting_area * 4.0 * STEFAN_BOLTZMANN * _REFERENCE**3
            matrix = self.conduction + sparse.diags_array(stored + emission)
            # For a symmetric pattern with a few full rows, those of the structures.
            return splu(
                sparse.csc_matrix(matrix),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )

        solve = self._factors.get(seconds, factorised).solve
        diagonal = stored + self.emitting_area * slope

        def preconditioned(x: Array) -> Array:
            exchanged = self._main_coupling @ (slope * x)
            return solve(diagonal * x + self.conduction @ x - exchanged)

        return _gmres(preconditioned, solve(residual))


def _gmres(matrix: Callable[[Array], Array], right: Array) -> Array:
    """The x of matrix(x) = right to a hundredth, for a matrix near the identity.

    GMRES without restarts (Saad & Schultz 1986), its small system kept triangular by Givens'
    rotations. scipy's spends four times as long on calls as on products of this size.
    """
    scale = math.sqrt(right @ right)
    if scale == 0.0:
        return right
    basis = np.empty((_MAX_DIRECTIONS + 1, len(right)))
    triangle = np.zeros((_MAX_DIRECTIONS, _MAX_DIRECTIONS))
    rotations: list[tuple[float, float]] = []
    wanted = [scale]
    basis[0] = right / scale
    for count in range(1, _MAX_DIRECTIONS + 1):
        image, known = matrix(basis[count - 1]), basis[:count]
        shares = known @ image
        image -= shares @ known
        length = math.sqrt(image @ image)
        column = shares.tolist()
        for place, (cosine, sine) in enumerate(rotations):
            one, other = column[place], column[place + 1]
            column[place : place + 2] = cosine * one + sine * other, cosine * other - sine * one
        last = math.hypot(column[-1], length)
        rotations.append((column[-1] / last, length / last))
        column[-1] = last
        triangle[:count, count - 1] = column
        cosine, sine = rotations[-1]
        wanted[-1:] = cosine * wanted[-1], -sine * wanted[-1]
        if abs(wanted[-1]) <= _ACCURACY * scale or length == 0.0:
            break
        np.divide(image, length, out=basis[count])
    parts = np.linalg.solve(triangle[:count, :count], wanted[:count])
    return np.asarray(parts @ basis[:count])
