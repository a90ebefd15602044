"""``docs/scenario_reference.md``, made from the schema: ``python -m tools.scenario_page``.

Meanings come from the docstrings of the tables, ranges from their annotations, units from the
keys, examples from the shipped scenarios and presets, else from ``scenario_examples.toml``.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import msgspec
from msgspec import inspect

from simgl.camera.camera_schema import (
    CalibrationTable,
    CameraPresetTable,
    CurveTable,
    EventSensorTable,
    FiltersTable,
    ParticlesTable,
    ThermalCameraTable,
)
from simgl.camera.lens_schema import (
    DistortionTable,
    FieldZoneTable,
    LensSurfaceTable,
    LidarTable,
    OpticsTable,
)
from simgl.config.value_types import Table
from simgl.model_files.surface_tables import (
    BoxTable,
    CellsTable,
    CoatTable,
    CrinkleTable,
    CylinderTable,
    MaterialTable,
    PlateTable,
    PrimitiveTable,
    SphereTable,
    ThermalSurfaceTable,
)
from simgl.scenario import schema
from simgl.scenario.uncertainty import UncertaintyTable

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "scenario_reference.md"
_WRITTEN = Path(__file__).with_name("scenario_examples.toml")
_HEAD = """# Scenario keys

Every key of scenario and preset files, generated from the schema by
`python -m tools.scenario_page`. [Scenario files](scenario.md) and [the camera](camera.md) explain
how the keys work together and how they affect an image; [assessment](assessment.md#requirements)
lists the keys of `[requirements]`. A key without "needed" is optional; if it has no default, its
row or these pages state what applies. Bands are R, G, B, N.
"""
TABLES: Mapping[str, type[Table]] = {
    "[epoch]": schema.EpochTable,
    "[bands]": schema.BandsTable,
    "[sun]": schema.SunTable,
    "[earth]": schema.EarthTable,
    "[earth.clouds]": schema.CloudsTable,
    "[sky]": schema.SkyTable,
    "[spacecraft.NAME]": schema.SpacecraftTable,
    "[spacecraft.NAME.orbit]": schema.OrbitTable,
    "[spacecraft.NAME] trajectory, attitude_file, joint_file": schema.MotionFileTable,
    "[spacecraft.NAME.point_at]": schema.PointAtTable,
    "[spacecraft.NAME.model]": PrimitiveTable,
    "[spacecraft.NAME.model] plate": PlateTable,
    "[spacecraft.NAME.model] sphere": SphereTable,
    "[spacecraft.NAME.model] box": BoxTable,
    "[spacecraft.NAME.model] cylinder": CylinderTable,
    "[spacecraft.NAME.model] material": MaterialTable,
    "[spacecraft.NAME.model] material.coat": CoatTable,
    "[spacecraft.NAME.model] material.cells": CellsTable,
    "[spacecraft.NAME.model] material.crinkle": CrinkleTable,
    "[spacecraft.NAME.model] material.thermal": ThermalSurfaceTable,
    "[camera.NAME]": schema.CameraTable,
    "[camera.NAME] calibration": CalibrationTable,
    "[camera.NAME.about]": schema.OrbitingTable,
    "[camera.NAME.look_at]": schema.LookAtTable,
    "[camera.NAME.limb]": schema.LimbTable,
    "[camera.NAME.particles]": ParticlesTable,
    "[camera.NAME.optics]": OpticsTable,
    "[camera.NAME.optics.distortion]": DistortionTable,
    "[camera.NAME.optics] field_zones": FieldZoneTable,
    "[camera.NAME.optics] surfaces": LensSurfaceTable,
    "[camera.NAME.lidar]": LidarTable,
    "[camera.NAME.event_sensor]": EventSensorTable,
    "[camera.NAME.thermal]": ThermalCameraTable,
    "[lamp.NAME]": schema.LampTable,
    "[assess]": schema.AssessTable,
    "[uncertainty]": UncertaintyTable,
    "[render]": schema.RenderTable,
    "[thermal]": schema.ThermalTable,
    "Preset file": CameraPresetTable,
    "Preset file, [qe], [window], [micro_lens]": CurveTable,
    "Preset file, [filters]": FiltersTable,
}
# Where the meanings of keys stand, if not in the docstring of their table.
_MEANINGS_OF: Mapping[type, type] = {schema.AssessTable: schema.UsabilityCriteria}
# The longest suffix counts.
_UNITS = {
    "w_m2_sr": "W m-2 sr-1", "w_m2": "W m-2", "w": "W", "km": "km", "m": "m", "mm": "mm",
    "um": "um", "nm": "nm", "deg": "deg", "m_s": "m/s", "e_s": "e-/s", "e": "e-", "s": "s",
    "us": "us", "k": "K", "px": "px", "mag": "mag", "dn": "DN", "e_per_dn": "e-/DN",
    "cm2_s": "cm-2 s-1", "e_um": "e-/um", "xyzw": "x, y, z, w",
}  # fmt: skip
_LONGEST_EXAMPLE = 60


def page() -> str:
    """The text of the page."""
    return _HEAD + "".join(
        f"\n## `{name}`\n\n{_introduction(table)}"
        "\n| key | unit | allowed | default | example | meaning |\n|---|---|---|---|---|---|\n"
        + "".join(_row(table, field) for field in msgspec.structs.fields(table))
        for name, table in TABLES.items()
    )


def example_of(table: type[Table], field: Any) -> object:
    """A value of a key: from a shipped file, else its default, else a written one; or None."""
    examples = _examples()
    given = examples.get((table.__name__, field.encode_name))
    if given is None and field.default is not msgspec.NODEFAULT and field.default != ():
        given = field.default
    return examples.get(("", field.encode_name)) if given is None else given


def _introduction(table: type[Table]) -> str:
    first = (table.__doc__ or "").split("\n")[0]
    text = re.sub(r"^``.*?``(, |: )?", "", first).replace("``", "`")
    return text[:1].upper() + text[1:] + "\n"


def _row(table: type[Table], field: Any) -> str:
    key = field.encode_name
    example = example_of(table, field)
    default = "needed" if field.required else ""
    if field.default is not msgspec.NODEFAULT and field.default not in (None, ()):
        default = f"`{_toml(field.default)}`"
    cells = (
        f"`{key}`",
        _unit(key),
        _allowed(inspect.type_info(field.type)),
        default,
        "" if example is None else f"`{_toml(example)}`",
        meanings_of(table).get(key, ""),
    )
    return "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |\n"


def _unit(key: str) -> str:
    words = key.split("_")
    for start in range(1, len(words)):
        if (unit := _UNITS.get("_".join(words[start:]))) is not None:
            return unit
    return ""


def meanings_of(table: type[Table]) -> dict[str, str]:
    """What the docstrings of a table and its bases say of its keys."""
    meanings: dict[str, str] = {}
    for cls in reversed(_MEANINGS_OF.get(table, table).__mro__):
        entry: list[str] = []
        for line in (cls.__doc__ or "").splitlines():
            if match := re.match(r" {4}(\w+(?:, \w+)*) : (.*)", line):
                entry = match[1].split(", ")
                meanings |= dict.fromkeys(entry, match[2].replace("``", "`"))
            elif entry and line.startswith(" " * 8):
                more = line.strip().replace("``", "`")
                meanings |= {key: f"{meanings[key]} {more}" for key in entry}
            else:
                entry = []
    return meanings


def _allowed(info: Any) -> str:
    match info:
        case inspect.UnionType(types=types):
            return " or ".join(dict.fromkeys(t for one in types if (t := _allowed(one))))
        case inspect.NoneType():
            return ""
        case inspect.LiteralType(values=values):
            return ", ".join(f'`"{value}"`' for value in values)
        case inspect.BoolType():
            return "true, false"
        case inspect.StrType():
            return "text"
        case inspect.IntType() | inspect.FloatType():
            return _range(info)
        case inspect.TupleType(item_types=items):
            return f"[{len(items)} x {_allowed(items[0])}]"
        case inspect.VarTupleType(item_type=item) | inspect.ListType(item_type=item):
            return f"[{_allowed(item)}, ...]"
        case inspect.DictType(value_type=value):
            return f"NAME = {_allowed(value)}"
        case inspect.StructType():
            return "a table"
    raise TypeError(f"no words for {info}")


def _range(info: Any) -> str:
    number = "integer" if isinstance(info, inspect.IntType) else "number"
    low = (
        f">= {info.ge:g}"
        if info.ge is not None
        else f"> {info.gt:g}"
        if info.gt is not None
        else ""
    )
    high = f"<= {info.le:.10g}" if info.le is not None else ""
    high = f"< {info.lt:g}" if info.lt is not None else high
    return ", ".join(part for part in (f"{number} {low}".strip(), high) if part)


@cache
def _examples() -> dict[tuple[str, str], object]:
    """A value for table and key from the shipped files; under "" a written one, or a number that
    the same key has in another table."""
    examples: dict[tuple[str, str], object] = {}
    scenarios = [*ROOT.glob("examples/**/*.toml"), *ROOT.glob("simgl/data/bench/*.toml")]
    written = tomllib.loads(_WRITTEN.read_text(encoding="utf-8"))
    roots: list[tuple[Any, Any]] = []
    for path in sorted(scenarios):
        data = tomllib.loads(path.read_text(encoding="utf-8"))
        for name, table in TABLES.items():
            if match := re.fullmatch(r"\[(\w+)(\.NAME)?\]", name):
                values = data.get(match[1], {})
                # A campaign names a camera with the same key.
                if not isinstance(values, dict):
                    continue
                roots += [(v, table) for v in (values.values() if match[2] else [values])]
    for path in sorted(ROOT.glob("simgl/data/cameras/*.toml")):
        roots.append((tomllib.loads(path.read_text(encoding="utf-8")), CameraPresetTable))
    for value, table in roots:
        for owner, key, example in _walk(value, inspect.type_info(table)):
            if len(_toml(example)) <= _LONGEST_EXAMPLE:
                examples.setdefault((owner, key), example)
                if isinstance(example, int | float):
                    examples.setdefault(("", key), example)
    return examples | {("", key): example for key, example in written.items()}


def _walk(value: Any, info: Any) -> Iterator[tuple[str, str, Any]]:
    """Table, key and value of all tables within a value."""
    match info:
        case inspect.UnionType(types=types):
            for one in types:
                yield from _walk(value, one)
        case inspect.StructType(cls=cls, fields=fields) if isinstance(value, dict):
            for field in fields:
                if field.encode_name in value:
                    yield cls.__name__, field.encode_name, value[field.encode_name]
                    yield from _walk(value[field.encode_name], field.type)
        case inspect.VarTupleType(item_type=item) | inspect.ListType(item_type=item):
            for one in value if isinstance(value, list) else ():
                yield from _walk(one, item)


def _toml(value: Any) -> str:
    match value:
        case dict():
            return "{ " + ", ".join(f"{k} = {_toml(v)}" for k, v in value.items()) + " }"
        case list() | tuple():
            return "[" + ", ".join(_toml(v) for v in value) + "]"
    return json.dumps(value, ensure_ascii=False)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
