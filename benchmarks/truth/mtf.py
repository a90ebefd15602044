"""Contrast of fine detail through lenses, by slanted edges."""

from __future__ import annotations

import moderngl
import numpy as np

from benchmarks.truth.rows import Row, Table, difference
from tests.camera.edge_scenes import edge_electrons, mtf_of

_GOAL = 0.01
# f-number, blur of the lens [um].
_LENSES = [(2.8, 0.0), (4.0, 0.0), (4.0, 1.0), (4.0, 2.0), (8.0, 0.0), (11.0, 0.0)]
_FREQUENCIES = np.array([0.25, 0.5])
# Where the edge passes [px], and its slants against columns or rows [deg]. The mean over them.
_PLACES = {
    "columns": ((192.3, 192.0), (4.0, 5.0, 7.0)),
    "rows": ((192.0, 192.4), (94.0, 95.0, 97.0)),
    "columns, off axis": ((90.2, 110.0), (4.0, 5.0, 7.0)),
}


def table(gl: moderngl.Context) -> Table:
    """Each lens on monochrome and colour detectors."""
    rows = []
    for f_number, blur in _LENSES:
        for where, (place, slants) in _PLACES.items():
            for letters in (("mono",), ("R", "G", "B")):
                rows += _rows(gl, f_number, blur, where, place, slants, letters)
    return Table(
        title="Contrast through a lens at a quarter and half a cycle per pixel",
        reference="diffraction of a circular pupil x Gaussian x pixel aperture, by their formulas",
        quantity="MTF of mean electrons by a slanted edge (ISO 12233), mean of three slants",
        error="difference",
        rows=rows,
    )


def _rows(
    gl: moderngl.Context,
    f_number: float,
    blur: float,
    where: str,
    place: tuple[float, float],
    slants: tuple[float, ...],
    letters: tuple[str, ...],
) -> list[Row]:
    optics = {"diffraction": True, "aberration_um": blur}
    contrasts = np.zeros((len(letters), 2, len(_FREQUENCIES)))
    for slant in slants:
        edge, electrons = edge_electrons(
            gl, optics, f_number, place, np.radians(slant), colour=len(letters) > 1
        )
        contrasts += [
            mtf_of(edge, electrons, letter, f_number, 1e-6 * blur, _FREQUENCIES)
            for letter in letters
        ]
    lens = f"f/{f_number:g}" + (f", {blur:g} um of blur" if blur else "")
    return [
        difference(f"{lens}, {letter}, along {where}, {cycles:g} cycles/px", truth, simgl, _GOAL)
        for letter, (truths, simgls) in zip(letters, contrasts / len(slants), strict=True)
        for cycles, truth, simgl in zip(
            _FREQUENCIES.tolist(), truths.tolist(), simgls.tolist(), strict=True
        )
    ]
