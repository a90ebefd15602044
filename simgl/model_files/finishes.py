"""Materials from tables: inline in a scenario, or a shipped finish by its name."""

from __future__ import annotations

from dataclasses import fields
from functools import lru_cache
from typing import Any

from simgl import assets
from simgl.config.validation import convert, read_toml
from simgl.config.value_types import amounts, fractions
from simgl.errors import AssetError, ConfigError, did_you_mean
from simgl.model_files.surface_schema import CellsTable, FinishTable, MaterialTable
from simgl.scene.materials import Material
from simgl.scene.surface_layers import Cells, Coat, Crinkle


@lru_cache(maxsize=1)
def _finishes() -> dict[str, Material]:
    path = assets.data() / "finishes.toml"
    found = {}
    for name, data in read_toml(path).items():
        where = f"{path} [{name}]"
        found[name] = _material(convert(data, FinishTable, where), name, where, "")
    return found


def shipped_finishes() -> list[str]:
    """Names of the surface finishes that come with simgl."""
    return sorted(_finishes())


def load_finish(name: str) -> Material:
    """A shipped finish; raises AssetError with a suggestion for an unknown name."""
    if name not in _finishes():
        raise AssetError(f'no finish "{name}"; {did_you_mean(name, shipped_finishes())}')
    return _finishes()[name]


def material_of(given: str | MaterialTable, name: str, where: str, key: str) -> Material:
    """The material that a table of the scenario describes, or that a finish's name stands for.

    name : of the material of a table
    where, key : the place in the file, for errors
    """
    if isinstance(given, MaterialTable):
        return _material(given, name, where, f"{key}.")
    try:
        return load_finish(given)
    except AssetError as error:
        raise ConfigError(where, key, f"names {error}") from None


def _material(table: MaterialTable, name: str, where: str, prefix: str) -> Material:
    """prefix : what stands before the table's own keys in errors"""
    coat, crinkle = table.coat, table.crinkle
    return Material(
        name=name,
        reflectance=fractions(table.reflectance, where, f"{prefix}reflectance"),
        metallic=table.metallic,
        roughness=table.roughness,
        conserving=table.conserving,
        coat=None if coat is None else Coat(strength=coat.strength, roughness=coat.roughness),
        cells=None if table.cells is None else _cells(table.cells, where, f"{prefix}cells"),
        crinkle=None
        if crinkle is None
        else Crinkle(facet_size=crinkle.facet_size_m, slope=crinkle.slope),
        emission=amounts(table.emission_w_m2_sr, where, f"{prefix}emission_w_m2_sr"),
    )


def _cells(table: CellsTable, where: str, key: str) -> Cells:
    values: dict[str, Any] = {}
    for field in fields(Cells):
        if field.name.endswith("_reflectance"):
            given = getattr(table, field.name)
            values[field.name] = fractions(given, where, f"{key}.{field.name}")
        else:
            values[field.name] = getattr(table, f"{field.name}_m")
    for line in ("finger", "busbar"):
        width, pitch = values[f"{line}_width"], values[f"{line}_pitch"]
        if width >= pitch:
            problem = f"must be less than {line}_pitch_m = {pitch:g}, got {width:g}"
            raise ConfigError(where, f"{key}.{line}_width_m", problem)
    return Cells(**values)
