"""Curves over wavelength in CSV files."""

from __future__ import annotations

import csv
import math
from itertools import pairwise
from pathlib import Path

from simgl.config.path_sandbox import Base
from simgl.config.validation import read_text
from simgl.errors import AssetError, ConfigError
from simgl.physics.spectrum import LONGEST_NM, SHORTEST_NM, Curve

# Characters of a line with two numbers, and more blanks than anybody leaves.
_LONGEST_LINE = 1000


def read_curve_file(
    name: str, base: Base, where: str, key: str
) -> tuple[Path, list[float], list[float]]:
    """A CSV file: its path, its wavelengths [nm] and values; a first line of words is a heading.

    base : folder of relative paths
    where, key : the place in the file that names this one, for errors

    Raises ConfigError for lines that are not two numbers and for wavelengths that are none,
    AssetError for a missing file.
    """
    try:
        path = base / name
        text = read_text(path)
    except AssetError as error:
        raise AssetError(f"{where}: {key}: {error}") from None
    wavelength, value = [], []
    for number, line in enumerate(text.splitlines(), 1):
        if len(line) > _LONGEST_LINE:
            problem = f"must be a wavelength in nm and a value, got {len(line)} characters"
            raise ConfigError(str(path), f"line {number}", problem)
        row = next(csv.reader([line]), [])
        try:
            nm, share = (float(cell) for cell in row)
        except ValueError:
            if number == 1 or not row:
                continue
            problem = f'must be a wavelength in nm and a value, got "{",".join(row)}"'
            raise ConfigError(str(path), f"line {number}", problem) from None
        wavelength.append(nm)
        value.append(share)
    check_wavelengths(str(path), "wavelength_nm", wavelength)
    return path, wavelength, value


def read_fractions(name: str, base: Base, where: str, key: str) -> Curve:
    """A curve of values 0..1 over wavelength [nm] in a CSV file.

    base : folder of relative paths
    where, key : the place in the file that names this one, for errors

    Raises ConfigError for impossible values, AssetError for a missing file.
    """
    file, wavelength, value = read_curve_file(name, base, where, key)
    for one in value:
        if not 0.0 <= one <= 1.0:
            raise ConfigError(str(file), key, f"must lie in 0..1, got {one:g}")
    return tuple(wavelength), tuple(value)


def check_wavelengths(where: str, key: str, wavelength: list[float]) -> None:
    """Raise ConfigError unless these are two wavelengths [nm] or more that increase, of light."""
    if len(wavelength) < 2 or any(not b > a for a, b in pairwise(wavelength)):
        raise ConfigError(where, key, "must increase, over two points or more")
    # In micrometres or metres a curve ends, and in angstroms it may begin, beside all bands.
    first, last = wavelength[0], wavelength[-1]
    if not (0.0 < first <= LONGEST_NM and SHORTEST_NM <= last < math.inf):
        problem = f"must reach into {SHORTEST_NM:g} to {LONGEST_NM:g} nm, got {first:g} to {last:g}"
        raise ConfigError(where, key, problem)
