"""Materials and calibration shapes as tables, and the finishes that come with simgl."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Annotated, Any

from msgspec import Meta, structs

from simgl import assets
from simgl.config.curve_files import read_fractions
from simgl.config.path_sandbox import Base
from simgl.config.validation import convert, exactly_one, read_toml
from simgl.config.value_types import (
    BandValues,
    Fraction,
    NonNegative,
    Positive,
    Table,
    amounts,
    fractions,
)
from simgl.errors import AssetError, ConfigError, did_you_mean
from simgl.file_cache import FileCache
from simgl.physics.spectrum import BANDS
from simgl.scene import mesh as shapes
from simgl.scene.materials import Material
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.surface_layers import SMOOTHEST, Cells, Coat, Crinkle
from simgl.scene.thermal_surface import ThermalSurface

Roughness = Annotated[float, Meta(ge=SMOOTHEST, le=1.0)]


class CoatTable(Table, frozen=True, kw_only=True):
    """A clear layer of index 1.5: cover glass, varnish.

    strength : fraction of the surface under the layer
    roughness : as that of the base
    """

    strength: Fraction = 1.0
    roughness: Roughness = SMOOTHEST


class CellsTable(Table, frozen=True, kw_only=True):
    """Solar cells side by side, projected along the body axis nearest to the normal.

    Columns and fingers repeat along the first of the other two axes, rows and busbars along the
    second, starting at the origin.

    width_m, height_m : of a cell along these two axes, without the gap
    gap_m : between two cells
    finger_pitch_m, finger_width_m : thin lines of metal on a cell
    busbar_pitch_m, busbar_width_m : wide lines of metal across them
    gap_reflectance, metal_reflectance : one number or four bands
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
    """Facets of a crumpled foil.

    facet_size_m : mean spacing
    slope : width of the distribution of slopes, GGX's alpha over the square root of 2
    """

    facet_size_m: Positive
    slope: Fraction


class ThermalSurfaceTable(Table, frozen=True, kw_only=True):
    """Thermal properties of a surface and of the skin below it.

    solar_absorptance : fraction of sunlight that is absorbed
    infrared_emissivity : fraction of a black body's radiation that is emitted
    heat_capacity_j_m2_k : of the skin
    conductance_w_m2_k : from the skin to the structure below
    """

    solar_absorptance: Fraction
    infrared_emissivity: Fraction
    heat_capacity_j_m2_k: Positive = 2000.0
    conductance_w_m2_k: NonNegative = 5.0

    def surface(self) -> ThermalSurface:
        """The same in SI units."""
        return ThermalSurface(
            solar_absorptance=self.solar_absorptance,
            infrared_emissivity=self.infrared_emissivity,
            heat_capacity=self.heat_capacity_j_m2_k,
            conductance=self.conductance_w_m2_k,
        )


class MaterialTable(Table, frozen=True, kw_only=True):
    """A material; Lambertian if it has no roughness.

    reflectance : base colour: one number, four for R, G, B and N, or a CSV file of nm and values
    metallic : 0 for paint and glass, 1 for metal, whose reflection has the base colour
    roughness : width of the reflection: its square is GGX's alpha
    coat : a clear layer on top
    cells : solar cells
    crinkle : facets of a crumpled foil
    conserving : adds multiple scattering between microfacets, which glTF's model lacks
    emission_w_m2_sr : emitted radiance, one number or four bands, 0 or more
    thermal : absorptance and emissivity, and the skin below
    """

    reflectance: BandValues | str
    metallic: Fraction = 0.0
    roughness: Roughness | None = None
    conserving: bool = False
    coat: CoatTable | None = None
    cells: CellsTable | None = None
    crinkle: CrinkleTable | None = None
    emission_w_m2_sr: BandValues = 0.0
    thermal: ThermalSurfaceTable | None = None


class SpectrumTable(Table, frozen=True, kw_only=True):
    """A spectrum, of which only the shape is used, and its source."""

    source: str
    wavelength_nm: list[float]
    reflectance: list[float]


class FinishTable(MaterialTable, frozen=True, kw_only=True):
    """A finish in ``simgl/data/finishes.toml``: a material and the source of its numbers.

    spectrum : in other bands than R, G, B and N, scaled to the reflectance in each of these
    """

    source: str
    spectrum: SpectrumTable | None = None


class PlateTable(Table, frozen=True, kw_only=True):
    """A thin plate facing +z of its body frame, centred on the origin.

    width_m : along x
    height_m : along y
    material : name of a finish, or a table
    """

    width_m: Positive
    height_m: Positive
    material: str | MaterialTable

    def mesh(self) -> shapes.Mesh:
        """Its triangles."""
        return shapes.plate(self.width_m, self.height_m)


class SphereTable(Table, frozen=True, kw_only=True):
    """A sphere about the body origin.

    radius_m : of the sphere
    material : name of a finish, or a table
    """

    radius_m: Positive
    material: str | MaterialTable

    def mesh(self) -> shapes.Mesh:
        """Its triangles."""
        return shapes.sphere(self.radius_m)


class BoxTable(Table, frozen=True, kw_only=True):
    """A box about the body origin; edges along x, y, z.

    size_m : length of the edges along x, y, z
    material : name of a finish, or a table
    """

    size_m: tuple[Positive, Positive, Positive]
    material: str | MaterialTable

    def mesh(self) -> shapes.Mesh:
        """Its triangles."""
        return shapes.box(self.size_m)


class CylinderTable(Table, frozen=True, kw_only=True):
    """A closed cylinder along z about the body origin.

    radius_m, length_m : of the cylinder
    material : name of a finish, or a table
    """

    radius_m: Positive
    length_m: Positive
    material: str | MaterialTable

    def mesh(self) -> shapes.Mesh:
        """Its triangles."""
        return shapes.cylinder(self.radius_m, self.length_m)


class PrimitiveTable(Table, frozen=True, kw_only=True):
    """Exactly one calibration shape.

    plate : thin plate facing +z, centred on the origin
    sphere : sphere about the origin
    box : box about the origin, edges along x, y, z
    cylinder : closed cylinder along z about the origin
    """

    plate: PlateTable | None = None
    sphere: SphereTable | None = None
    box: BoxTable | None = None
    cylinder: CylinderTable | None = None


def read_primitive(table: PrimitiveTable, name: str, where: str, base: Base) -> SpacecraftModel:
    """The model of a calibration shape; its only part and its material get ``name``.

    base : folder of relative paths
    """
    kind = exactly_one(structs.asdict(table), where, "model")
    shape: PlateTable | SphereTable | BoxTable | CylinderTable = getattr(table, kind)
    material = material_of(shape.material, name, where, f"model.{kind}.material", base)
    return SpacecraftModel(name=name, mesh=shape.mesh(), parts=(name,), materials=(material,))


_cached_finishes = FileCache[Path, dict[str, Material]](1)


def _finishes() -> dict[str, Material]:
    path = assets.data() / "finishes.toml"
    return _cached_finishes.get(path, lambda: _read_finishes(path))


def _read_finishes(path: Path) -> dict[str, Material]:
    finishes = {}
    for name, data in read_toml(path).items():
        where = f"{path} [{name}]"
        table = convert(data, FinishTable, where)
        finish = _material(table, name, where, "", path.parent)
        if table.spectrum is not None:
            form = tuple(table.spectrum.wavelength_nm), tuple(table.spectrum.reflectance)
            finish = replace(finish, form=form)
        finishes[name] = finish
    return finishes


def shipped_finishes() -> list[str]:
    """Names of the surface finishes that come with simgl, sorted.

    >>> "mli_gold" in simgl.shipped_finishes()
    True
    """
    return sorted(_finishes())


def load_finish(name: str) -> Material:
    """A shipped surface finish; docs/materials.md lists them.

    name : of the finish

    Raises AssetError with a suggestion for an unknown name.

    >>> simgl.load_finish("white_paint").reflectance
    (0.88, 0.88, 0.84, 0.87)
    """
    if name not in _finishes():
        raise AssetError(f'no finish "{name}"; {did_you_mean(name, shipped_finishes())}')
    return _finishes()[name]


def material_of(
    given: str | MaterialTable, name: str, where: str, key: str, base: Base
) -> Material:
    """The material that a table describes, or the finish of that name.

    name : what a material from a table is called
    where, key : the place in the file, for errors
    base : folder of relative paths
    """
    if isinstance(given, MaterialTable):
        return _material(given, name, where, f"{key}.", base)
    try:
        return load_finish(given)
    except AssetError as error:
        raise ConfigError(where, key, f"names {error}") from None


def _material(table: MaterialTable, name: str, where: str, prefix: str, base: Base) -> Material:
    """prefix : precedes the table's keys in error messages"""
    for key in ("metallic", "conserving"):
        if getattr(table, key) and table.roughness is None:
            problem = "requires roughness; without it the material is Lambertian"
            raise ConfigError(where, f"{prefix}{key}", problem)
    coat, crinkle, spectrum = table.coat, table.crinkle, None
    if isinstance(table.reflectance, str):
        spectrum = read_fractions(table.reflectance, base, where, f"{prefix}reflectance")
        reflectance = BANDS.photon_mean_of(spectrum)
    else:
        reflectance = fractions(table.reflectance, where, f"{prefix}reflectance")
    return Material(
        name=name,
        reflectance=reflectance,
        spectrum=spectrum,
        metallic=table.metallic,
        roughness=table.roughness,
        conserving=table.conserving,
        coat=None if coat is None else Coat(strength=coat.strength, roughness=coat.roughness),
        cells=None if table.cells is None else _cells(table.cells, where, f"{prefix}cells"),
        crinkle=None
        if crinkle is None
        else Crinkle(facet_size=crinkle.facet_size_m, slope=crinkle.slope),
        emission=amounts(table.emission_w_m2_sr, where, f"{prefix}emission_w_m2_sr"),
        thermal=None if table.thermal is None else table.thermal.surface(),
    )


def _cells(table: CellsTable, where: str, key: str) -> Cells:
    values: dict[str, Any] = {}
    for field in fields(Cells):
        if field.name.endswith("_reflectance"):
            given = getattr(table, field.name)
            values[field.name] = fractions(given, where, f"{key}.{field.name}")
        else:
            values[field.name] = getattr(table, f"{field.name}_m")
    lines = table.finger_width_m > 0.0 or table.busbar_width_m > 0.0
    for key_of, drawn, width in (
        ("gap_reflectance", table.gap_m > 0.0, "gap_m"),
        ("metal_reflectance", lines, "finger_width_m or busbar_width_m"),
    ):
        if getattr(table, key_of) != 0.0 and not drawn:
            raise ConfigError(where, f"{key}.{key_of}", f"requires {width} above 0")
    for line in ("finger", "busbar"):
        width, pitch = values[f"{line}_width"], values[f"{line}_pitch"]
        if width >= pitch:
            problem = f"must be less than {line}_pitch_m = {pitch:g}, got {width:g}"
            raise ConfigError(where, f"{key}.{line}_width_m", problem)
    return Cells(**values)
