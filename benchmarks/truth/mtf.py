"""Contrast of fine detail through lenses, by slanted edges."""

from __future__ import annotations

import moderngl
import numpy as np

from benchmarks.truth.rows import Row, Table, difference
from tests.camera.edge_scenes import edge_electrons, mtf_of

_GOAL = 0.01
# f-number, blur of the lens [um].
_LENSES = [(1.4, 0.0), (2.8, 0.0), (4.0, 0.0), (4.0, 1.0), (4.0, 2.0), (8.0, 0.0), (11.0, 0.0)]
_FREQUENCIES = np.array([0.25, 0.5])
# Where the edge passes [px], and the columns or rows that it is slanted against [deg].
_PLACES = {
    "columns": ((192.3, 192.0), 0.0),
    "rows": ((192.0, 192.4), 90.0),
    "columns, off axis": ((90.2, 110.0), 0.0),
}
# [deg]. What one edge of 180 px tells at half a cycle scatters by 0.002, of red or blue pixels, one
# of four, by 0.004 rms, for the pixels of a bin lie beside its middle.
_SLANTS = np.arange(2.25, 9.3, 0.5)


def table(gl: moderngl.Context) -> Table:
    """Each lens on monochrome and colour detectors."""
    rows = []
    for f_number, blur in _LENSES:
        for where in _PLACES:
            for letters in (("mono",), ("R", "G", "B")):
                rows += _rows(gl, f_number, blur, where, letters)
    return Table(
        title="Contrast through a lens at a quarter and half a cycle per pixel",
        reference="diffraction of a circular pupil x Gaussian x pixel aperture, by their formulas",
        quantity="MTF of mean electrons by a slanted edge (ISO 12233), mean of fifteen slants",
        error="difference",
        rows=rows,
    )


def _rows(
    gl: moderngl.Context,
    f_number: float,
    blur: float,
    where: str,
    letters: tuple[str, ...],
) -> list[Row]:
    optics = {"diffraction": True, "aberration_um": blur}
    contrasts = np.zeros((len(letters), 2, len(_FREQUENCIES)))
    place, along = _PLACES[where]
    for slant in np.radians(along + _SLANTS).tolist():
        edge, electrons = edge_electrons(
            gl, optics, f_number, place, slant, colour=len(letters) > 1
        )
        contrasts += [
            mtf_of(edge, electrons, letter, f_number, 1e-6 * blur, _FREQUENCIES)
            for letter in letters
        ]
    lens = f"f/{f_number:g}" + (f", {blur:g} um of blur" if blur else "")
    return [
        difference(f"{lens}, {letter}, along {where}, {cycles:g} cycles/px", truth, simgl, _GOAL)
        for letter, (truths, simgls) in zip(letters, contrasts / len(_SLANTS), strict=True)
        for cycles, truth, simgl in zip(
            _FREQUENCIES.tolist(), truths.tolist(), simgls.tolist(), strict=True
        )
    ]
