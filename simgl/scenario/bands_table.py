"""The ``[bands]`` table: the wavelengths that a scenario's light and reflectances are given in."""

from __future__ import annotations

import re
from itertools import pairwise

from simgl.config.curve_files import read_fractions
from simgl.config.path_sandbox import Base
from simgl.errors import ConfigError
from simgl.physics.spectrum import BANDS, LONGEST_NM, SHORTEST_NM, Bands
from simgl.scenario.schema import BandsTable

# The curves of detectors are taken every nanometre.
NARROWEST_NM = 1.0
_NAME = re.compile(r"[A-Za-z0-9_-]{1,32}")
# Channels of EXR files that are no bands.
_TAKEN = ("Z", "partId")


def read_bands(table: BandsTable, where: str, base: Base) -> Bands:
    """The bands of a scenario; relative paths start at ``base``.

    Raises ConfigError for impossible values, AssetError for a missing file.
    """
    if table.edges_nm is None and table.filter is None:
        if table.names is not None:
            raise ConfigError(where, "names", "requires edges_nm or filter")
        return BANDS
    curve = None if table.filter is None else read_fractions(table.filter, base, where, "filter")
    if table.edges_nm is not None:
        edges_nm = table.edges_nm
    else:
        assert curve is not None
        edges_nm = [(curve[0][0], curve[0][-1])]
    key = "filter" if table.edges_nm is None else "edges_nm"
    for low, high in edges_nm:
        if not (low >= SHORTEST_NM and high <= LONGEST_NM and high - low >= NARROWEST_NM):
            problem = (
                f"must hold bands from {SHORTEST_NM:g} to {LONGEST_NM:g}, at least "
                f"{NARROWEST_NM:g} wide, got [{low:g}, {high:g}]"
            )
            raise ConfigError(where, key, problem)
    for (_, high), (low, _) in pairwise(sorted(edges_nm)):
        if low < high:
            problem = f"must not overlap; one band ends at {high:g}, another begins at {low:g}"
            raise ConfigError(where, key, problem)
    bands = Bands(
        names=_names(table, edges_nm, where),
        edges=tuple((low * 1e-9, high * 1e-9) for low, high in edges_nm),
        filter=curve,
    )
    for index, (low, high) in enumerate(edges_nm):
        if not bands.transmission(bands.steps(index)).any():
            raise ConfigError(where, "filter", f"lets no light through from {low:g} to {high:g} nm")
    return bands


def _names(table: BandsTable, edges_nm: list[tuple[float, float]], where: str) -> tuple[str, ...]:
    if table.names is None:
        return tuple(f"{low:g}-{high:g}nm" for low, high in edges_nm)
    if len(table.names) != len(edges_nm) or len(set(table.names)) != len(edges_nm):
        problem = f"must be {len(edges_nm)} different names, one for each band"
        raise ConfigError(where, "names", problem)
    for name in table.names:
        if not _NAME.fullmatch(name) or name in _TAKEN:
            taken = " and ".join(_TAKEN)
            problem = (
                f"must be of letters a to z or A to Z, digits, _ and -, at most 32, not {taken}"
            )
            raise ConfigError(where, "names", problem)
    return tuple(table.names)
