"""Variants of the planet's shaders: their defines, and what those of bands of a scenario read."""

from __future__ import annotations

from simgl.passes.background.earth_air import PAIRS
from simgl.passes.background.earth_textures import BAND_SAMPLERS, CHARTS
from simgl.physics.spectrum import BANDS
from simgl.view.background import PlanetView

# Of the table of what passes the air twice, after ``BAND_SAMPLERS``.
PAIRS_UNIT = 15


def knows_ground_bands(name: str, variant: tuple[str, ...]) -> bool:
    """Whether a program draws ground and clouds of maps in bands of a scenario."""
    drawn = name in ("planet/planet", "planet/tiles")
    return drawn and "BANDS" in variant and "EARTH_MAPS" in variant


def band_samplers(name: str, variant: tuple[str, ...]) -> dict[str, int]:
    """Of bands of a scenario, with their units."""
    samplers = dict(BAND_SAMPLERS) if knows_ground_bands(name, variant) else {}
    # Only noise and snow ask what grows.
    if "SEA" in variant or ("FAR" in variant and "FROST" not in variant):
        samplers.pop("land_kind", None)
    if "CLEAR" in variant:
        samplers.pop("cloud_bands", None)
    from_space = "AIR" in variant and "AIR_INSIDE" not in variant
    if "BANDS" in variant and from_space and name in ("planet/planet", "planet/tiles"):
        samplers[PAIRS] = PAIRS_UNIT
    return samplers


def variant_of(planet: PlanetView, inside_air: bool | None, *, far: bool) -> tuple[str, ...]:
    """The defines of the shaders that draw an Earth.

    inside_air : whether the pinhole stands in it; None where there is none
    far : pixels resolve nothing of the chart
    """
    mapped = planet.earth.albedo is None
    optional = {
        "BANDS": planet.earth.bands != BANDS,
        "EARTH_MAPS": mapped,
        "REGOLITH": not mapped and planet.earth.regolith is not None,
        "FAR": far,
        "AIR": inside_air is not None,
        "AIR_INSIDE": bool(inside_air),
    }
    return tuple(define for define, wanted in optional.items() if wanted)


def unread_samplers(name: str, variant: tuple[str, ...]) -> list[str]:
    """Of those of the Earth's maps and noise, what a program does not read."""
    unread = [*CHARTS] if "FAR" in variant else []
    if "CLEAR" in variant:
        unread += ["weather_map", "cloud_reflection"]
        unread += ["cloud_chart"] if "FROST" not in variant else []
        unread += ["chart"] if "SEA" in variant and "GLINT" not in variant else []
    unread += ["frost_edges"] if "FROST" not in variant else []
    unread += ["cloud_reflection"] if name == "planet/ceiling" else []
    groundless = "SEA" in variant or name == "planet/ceiling"
    unread += ["land_map", "form_map"] if groundless else []
    unread += ["shore_map"] if groundless or "LAND" in variant else []
    unread += ["lamp_map"] if groundless or "NIGHT" not in variant else []
    return unread
