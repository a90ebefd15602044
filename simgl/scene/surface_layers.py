"""Layers on or in a surface: clear coats, solar cells, crinkles."""

from __future__ import annotations

from dataclasses import dataclass, fields

# Below this the highlight of a point Sun is narrower than float32 resolves.
SMOOTHEST = 0.01

Bands = tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class Coat:
    """A clear layer of index 1.5 over a surface: cover glass, varnish.

    strength : share of the surface that it covers, 0..1
    roughness : perceptual, of its outer face
    """

    strength: float = 1.0
    roughness: float = SMOOTHEST

    def __post_init__(self) -> None:
        if not 0.0 <= self.strength <= 1.0:
            raise ValueError(f"coat.strength lies in 0..1, got {self.strength:g}")
        if not SMOOTHEST <= self.roughness <= 1.0:
            raise ValueError(f"coat.roughness lies in {SMOOTHEST:g}..1, got {self.roughness:g}")


@dataclass(frozen=True, kw_only=True)
class Cells:
    """Solar cells laid side by side, in body axes; the material's own reflectance is the cell's.

    The pattern is seen along the body axis nearest to the normal; columns repeat along the first of
    the other two axes (in the order x, y, z), rows along the second, from the body's origin.

    width, height : of a cell along the first and the second axis, without the gap [m]
    gap : between cells [m]
    finger_pitch, finger_width : of the thin metal lines that repeat along the first axis [m]
    busbar_pitch, busbar_width : of the metal lines that repeat along the second axis [m]
    gap_reflectance, metal_reflectance : per band, of the gaps and of the metal lines
    """

    width: float
    height: float
    gap: float
    finger_pitch: float
    finger_width: float
    busbar_pitch: float
    busbar_width: float
    gap_reflectance: Bands
    metal_reflectance: Bands

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, tuple):
                if not all(0.0 <= v <= 1.0 for v in value):
                    raise ValueError(f"cells.{field.name} lies in 0..1, got {list(value)}")
            elif not value >= 0.0 or (value == 0.0 and field.name in ("width", "height")):
                raise ValueError(f"cells.{field.name} must be positive, got {value:g}")
        for line in ("finger", "busbar"):
            width, pitch = getattr(self, f"{line}_width"), getattr(self, f"{line}_pitch")
            if not width < pitch:
                got = f"got {width:g} and {pitch:g}"
                raise ValueError(f"cells.{line}_width must be less than {line}_pitch, {got}")


@dataclass(frozen=True, kw_only=True)
class Crinkle:
    """Facets of a crumpled foil, fixed in body axes.

    facet_size : mean spacing of the large facets; small ones lie in them [m]
    slope : width of the facets' slopes, which follow GGX's distribution of alpha = sqrt(2) slope
    """

    facet_size: float
    slope: float

    def __post_init__(self) -> None:
        if not self.facet_size > 0.0:
            raise ValueError(f"crinkle.facet_size must be positive, got {self.facet_size:g}")
        if not 0.0 <= self.slope <= 1.0:
            raise ValueError(f"crinkle.slope lies in 0..1, got {self.slope:g}")
