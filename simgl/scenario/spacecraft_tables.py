"""The ``model`` of ``[spacecraft.NAME]``: a file, a shipped model or a calibration shape."""

from __future__ import annotations

from simgl.config.path_sandbox import Base
from simgl.errors import AssetError, ConfigError
from simgl.model_files.file_axes import UNITS
from simgl.model_files.finishes import material_of
from simgl.model_files.model_library import load_model
from simgl.model_files.surface_schema import PrimitiveTable
from simgl.scenario.schema import SpacecraftTable
from simgl.scene import mesh as shapes
from simgl.scene.spacecraft import SpacecraftModel


def read_model(where: str, name: str, table: SpacecraftTable, base: Base) -> SpacecraftModel:
    """Its shape and surface; relative paths start at ``base``."""
    source = table.model
    if isinstance(source, PrimitiveTable):
        for key in ("unit", "unit_m", "up_axis", "forward_axis"):
            if getattr(table, key) is not None:
                problem = "goes with a mesh file; a primitive is in metres and body axes"
                raise ConfigError(where, key, problem)
        return _primitive(source, where, name)
    if table.unit is not None and table.unit_m is not None:
        raise ConfigError(where, "unit_m", "contradicts unit; give one of them")
    unit_m = table.unit_m if table.unit is None else UNITS[table.unit]
    try:
        return load_model(source, base, unit_m, table.up_axis, table.forward_axis)
    except AssetError as error:
        raise AssetError(f"{where}: model: {error}") from None
    except ValueError as error:
        raise ConfigError(where, "forward_axis", str(error)) from None


def _primitive(table: PrimitiveTable, where: str, name: str) -> SpacecraftModel:
    shapes_given = [s for s in table.__struct_fields__ if getattr(table, s) is not None]
    if len(shapes_given) != 1:
        raise ConfigError(where, "model", "needs exactly one of plate, sphere, box, cylinder")
    if table.plate is not None:
        mesh = shapes.plate(table.plate.width_m, table.plate.height_m)
    elif table.sphere is not None:
        mesh = shapes.sphere(table.sphere.radius_m)
    elif table.box is not None:
        mesh = shapes.box(table.box.size_m)
    else:
        assert table.cylinder is not None
        mesh = shapes.cylinder(table.cylinder.radius_m, table.cylinder.length_m)
    given = getattr(table, shapes_given[0]).material
    material = material_of(given, name, where, f"model.{shapes_given[0]}.material")
    return SpacecraftModel(name=name, mesh=mesh, parts=(name,), materials=(material,))
