"""What a scenario file may say of surfaces and calibration shapes."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from simgl.config.value_types import BandValues, Fraction, NonNegative, Positive, Table
from simgl.scene.surface_layers import SMOOTHEST

Roughness = Annotated[float, Meta(ge=SMOOTHEST, le=1.0)]


class CoatTable(Table, frozen=True, kw_only=True):
    """A clear layer of index 1.5: cover glass, varnish."""

    strength: Fraction = 1.0
    roughness: Roughness = SMOOTHEST


class CellsTable(Table, frozen=True, kw_only=True):
    """Solar cells laid side by side, seen along the body axis nearest to the normal.

    Columns and fingers repeat along the first of the other two axes, rows and busbars along the
    second, from the origin.
    """

    width_m: Positive
    height_m: Positive
    gap_m: NonNegative = 0.0
    finger_pitch_m: Positive = 1.0
    finger_width_m: NonNegative = 0.0
    busbar_pitch_m: Positive = 1.0
    busbar_width_m: NonNegative = 0.0
    gap_reflectance: BandValues = 0.0
    metal_reflectance: BandValues = 0.0


class CrinkleTable(Table, frozen=True, kw_only=True):
    """Facets of a crumpled foil: their mean spacing, and the width of their slopes."""

    facet_size_m: Positive
    slope: Fraction


class MaterialTable(Table, frozen=True, kw_only=True):
    """A material; without roughness it is Lambertian.

    conserving : keeps the light that meets several microfacets, which the model of glTF loses
    emission_w_m2_sr : radiance of its own, one number or four bands, 0 or more
    """

    reflectance: BandValues
    metallic: Fraction = 0.0
    roughness: Roughness | None = None
    conserving: bool = False
    coat: CoatTable | None = None
    cells: CellsTable | None = None
    crinkle: CrinkleTable | None = None
    emission_w_m2_sr: BandValues = 0.0


class FinishTable(MaterialTable, frozen=True, kw_only=True):
    """A finish in ``simgl/data/finishes.toml``: a material with where its numbers come from."""

    source: str


class PlateTable(Table, frozen=True, kw_only=True):
    """A thin plate facing +z of its body frame, centred on the origin."""

    width_m: Positive
    height_m: Positive
    material: str | MaterialTable


class SphereTable(Table, frozen=True, kw_only=True):
    """A sphere about the body origin."""

    radius_m: Positive
    material: str | MaterialTable


class BoxTable(Table, frozen=True, kw_only=True):
    """A box about the body origin; edges along x, y, z."""

    size_m: tuple[Positive, Positive, Positive]
    material: str | MaterialTable


class CylinderTable(Table, frozen=True, kw_only=True):
    """A closed cylinder along z about the body origin."""

    radius_m: Positive
    length_m: Positive
    material: str | MaterialTable


class PrimitiveTable(Table, frozen=True, kw_only=True):
    """Exactly one calibration shape."""

    plate: PlateTable | None = None
    sphere: SphereTable | None = None
    box: BoxTable | None = None
    cylinder: CylinderTable | None = None
