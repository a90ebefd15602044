"""Light that the gases of the air let pass, by Malkmus' model and the table of its coefficients."""

from __future__ import annotations

import numpy as np

from simgl import assets
from simgl.arrays import Array

GASES = ("water", "oxygen", "mixed")


def gas_transmittance(gas: str, wavelength: Array, columns: Array) -> Array:
    """(n, k) of vertical columns (k,) of a gas of ``GASES``, in pieces of 5 nm.

    wavelength : (n,) [m]

    Mixed gases are carbon dioxide, methane, nitrous oxide and carbon monoxide. The law and its
    sources: ``simgl.physics.band_air``.
    """
    table = np.genfromtxt(assets.data() / "air_absorption.csv", delimiter=",", names=True)
    # Pieces are named by their middles.
    piece = np.abs(table["wavelength_nm"] - 1e9 * wavelength[:, None]).argmin(axis=1)
    mean, width = table[f"{gas}_mean"][piece, None], table[f"{gas}_width"][piece, None]
    return np.asarray(np.exp(width * (1.0 - np.sqrt(1.0 + 2.0 * mean * columns / width))))
