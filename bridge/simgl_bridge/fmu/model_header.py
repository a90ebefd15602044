"""The variables of an FMU as tables for its C code: ``simgl_fmu_model.h``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from simgl_bridge.fmu.variables import CameraModel, Type, Variable, structured_name
from simgl_bridge.hashes import scene_hash

# Where the C code stores the values of each type.
STORES: dict[Type, str] = {
    "Float64": "REAL",
    "Int64": "INTEGER",
    "Enumeration": "INTEGER",
    "Boolean": "FLAG",
    "String": "TEXT",
    "UInt16": "IMAGE",
    "Binary": "IMAGE_BYTES",
}
# The first of the variables of a pose, which lie one behind the other.
POSE_START = "position_icrf_m"


def model_header(model: CameraModel, variables: Sequence[Variable], token: str) -> str:
    """The text of the header.

    Each type has a store, an array; a variable lies in it at an offset. Offsets of variables with
    a symbol have names, ``AT_symbol``; those of spacecraft, joints and lamps are in tables.
    """
    offsets = _offsets(variables)
    starts: dict[str, list[str]] = {store: [] for store in ("REAL", "INTEGER", "FLAG", "TEXT")}
    for variable in variables:
        if STORES[variable.type] in starts:
            starts[STORES[variable.type]] += _starts(variable)
    detector = model.scenario.cameras[model.camera].detector
    at = {v.name: offset for v, offset in zip(variables, offsets, strict=True)}
    lines = [
        "/* Made by simgl fmu: the variables of this FMU. */",
        f"#define MODEL_TOKEN {c_string(token)}",
        f"#define MODEL_CAMERA {c_string(model.camera)}",
        f"#define MODEL_SCENE_HASH {c_string(scene_hash(model.scenario))}",
        f"#define MODEL_WIDTH {detector.width}",
        f"#define MODEL_HEIGHT {detector.height}",
        f"#define MODEL_SENDS_SUN {int(model.sends_sun)}",
        *(f"#define {store}_COUNT {len(values)}" for store, values in starts.items()),
        "",
        "enum {",
        *(
            f"    AT_{variable.symbol} = {offset},"
            for variable, offset in zip(variables, offsets, strict=True)
            if variable.symbol
        ),
        *(() if model.sends_sun else ("    AT_sun_position_icrf_m = 0,",)),
        "};",
        "",
        *_table(
            "static const fmu_variable VARIABLES[]",
            (
                f"{{{STORES[v.type]}, {v.causality.upper()}, {v.size}, {offset}, "
                f"{c_string(v.name)}}}"
                for v, offset in zip(variables, offsets, strict=True)
            ),
        ),
        *_table("static const double REAL_STARTS[]", starts["REAL"]),
        *_table("static const fmi3Int64 INTEGER_STARTS[]", starts["INTEGER"]),
        *_table("static const fmi3Boolean FLAG_STARTS[]", starts["FLAG"]),
        *_table("static const char *const TEXT_STARTS[]", starts["TEXT"]),
        *_scene_tables(model, at),
    ]
    return "\n".join(lines) + "\n"


def c_string(text: str) -> str:
    """A string literal of C, whatever the text holds."""
    plain = set(range(32, 127)) - set(b'"\\?')
    return '"' + "".join(chr(c) if c in plain else f"\\{c:03o}" for c in text.encode()) + '"'


def _offsets(variables: Iterable[Variable]) -> list[int]:
    """Each variable's offset in the store of its type."""
    sizes = dict.fromkeys(STORES.values(), 0)
    offsets = []
    for variable in variables:
        store = STORES[variable.type]
        offsets.append(sizes[store])
        sizes[store] += variable.size
    return offsets


def _starts(variable: Variable) -> list[str]:
    store = STORES[variable.type]
    values = variable.start or ("" if store == "TEXT" else 0,) * variable.size
    if store == "TEXT":
        return [c_string(str(value)) for value in values]
    if store == "INTEGER":
        return [f"INT64_C({value})" for value in values]
    return [repr(float(value)) if store == "REAL" else str(int(value)) for value in values]


def _scene_tables(model: CameraModel, at: dict[str, int]) -> list[str]:
    """Names and offsets of spacecraft, joints and lamps."""
    bodies: list[str] = []
    joints: list[str] = []
    for body in model.bodies:
        moved = model.joints(body)
        first = at[structured_name(body, POSE_START)]
        bodies.append(f"{{{c_string(body)}, {first}, {len(joints)}, {len(moved)}}}")
        joints += [
            f"{{{c_string(joint)}, {at[structured_name(body, 'joint', joint)]}}}" for joint in moved
        ]
    shares = [
        f"{{{c_string(lamp)}, {at[structured_name('lamp', lamp)]}}}"
        for lamp in model.scenario.lamps
    ]
    counts = {"BODY": bodies, "JOINT": joints, "LAMP": shares}
    return [
        *(f"#define {kind}_COUNT {len(rows)}" for kind, rows in counts.items()),
        *_table("static const fmu_body BODIES[]", bodies or ["{0}"]),
        *_table("static const fmu_setting JOINTS[]", joints or ["{0}"]),
        *_table("static const fmu_setting LAMPS[]", shares or ["{0}"]),
    ]


def _table(head: str, rows: Iterable[str]) -> list[str]:
    return [f"{head} = {{", *(f"    {row}," for row in rows), "};"]
