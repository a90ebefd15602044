"""Strict conversion of parsed TOML into schema tables; errors name file, key and value."""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Mapping
from decimal import Decimal
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np
from msgspec import inspect

from simgl.errors import ConfigError, did_you_mean
from simgl.input_files import MAX_TEXT_BYTES, read_file

T = TypeVar("T", bound=msgspec.Struct)

_PATH = re.compile(r"^(.*?)(?: - at `\$(.*)`)?$", re.DOTALL)
_BOUND = re.compile(r"(a number|a whole number) ([<>]=? .*)")
_STEP = re.compile(r"\.(\w+)|\[(\d+|\.\.\.)\]")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_HOLDERS = (
    inspect.StructType,
    inspect.DictType,
    inspect.ListType,
    inspect.TupleType,
    inspect.VarTupleType,
)
# Larger than any length, angle or flux of a scene; its square is finite in float32.
LARGEST = 1e18
# Deeper than any table, and far from the recursion limit of those who walk through it.
MAX_DEPTH = 32
# A dotted key of as many parts; its quantifiers never give back what they took.
_DOTTED = re.compile(rf"(?<![\w\"'-])(?:[\w\"'-]++[ \t]*+\.[ \t]*+){{{MAX_DEPTH}}}")
# Of all tables and lists; a text of ``MAX_TEXT_BYTES`` holds fewer.
MAX_VALUES = 4_000_000
# Longest text in an error message.
_MAX_SHOWN = 100
_WORDS = {
    "float": "a number",
    "int": "a whole number",
    "str": "a text",
    "bool": "true or false",
    "array": "a list",
    "object": "a table",
}


def read_text(path: Path) -> str:
    """A file's text; AssetError if it cannot be read, ConfigError if it is not UTF-8."""
    try:
        # Editors of Windows begin a file with the byte order mark.
        text = read_file(path, MAX_TEXT_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ConfigError(str(path), "", f"is not UTF-8 text (byte {error.start})") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_toml(path: Path) -> dict[str, Any]:
    """The parsed file; AssetError if it cannot be read, ConfigError with the line if malformed."""
    text = read_text(path)
    if _DOTTED.search(text):
        # The parser would take hours for a key of a hundred thousand parts.
        raise _too_deep(str(path))
    try:
        data = tomllib.loads(text)
    except ValueError as error:
        raise ConfigError(str(path), "", f"is not valid TOML: {_complaint(error, text)}") from None
    except RecursionError:
        raise _too_deep(str(path)) from None
    check_depth(data, str(path))
    return data


def _complaint(error: ValueError, text: str) -> str:
    """What the parser of a text says, with the line that it is about: it names no key."""
    complaint = _one_line(str(error))
    place = re.search(r"\(at line (\d+), column \d+\)$", complaint)
    line = _one_line(text.split("\n")[int(place[1]) - 1]) if place else ""
    return f"{complaint}: {line}" if line.isprintable() and line else complaint


def _one_line(text: str) -> str:
    """A text, which may hold a key of a file of any length, as one line of some hundred letters."""
    text = " ".join(text.split())
    return text if len(text) <= 3 * _MAX_SHOWN else f"{text[:_MAX_SHOWN]}...{text[-_MAX_SHOWN:]}"


def check_depth(data: Any, where: str) -> None:
    """Raise ConfigError for tables and lists within each other beyond any use, without recursion.

    Also ends for data that hold themselves, as a program can make them.
    """
    level, count = [data], 0
    for _ in range(MAX_DEPTH + 1):
        inner: list[Any] = []
        for value in level:
            if isinstance(value, dict):
                inner.extend(value.values())
            elif isinstance(value, list | tuple):
                inner.extend(value)
            if count + len(inner) > MAX_VALUES:
                problem = f"holds more than {MAX_VALUES} values in its tables and lists"
                raise ConfigError(where, "", problem)
        level, count = inner, count + len(inner)
        if not level:
            return
    raise _too_deep(where)


def _too_deep(where: str) -> ConfigError:
    problem = f"is nested too deeply; at most {MAX_DEPTH} tables and lists lie within each other"
    return ConfigError(where, "", problem)


def plain(value: Any) -> Any:
    """The value with numpy scalars and arrays as Python numbers and lists, and keys as texts."""
    if isinstance(value, dict):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [plain(inner) for inner in value]
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else value


def shown_key(key: str) -> str:
    """A key as a TOML file would write it, on one line."""
    key = _cut(key)
    return key if _BARE_KEY.fullmatch(key) else json.dumps(key, ensure_ascii=False)


def shown(value: Any) -> str:
    """A value as a TOML file would write it, on one short line."""
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list) and any(isinstance(inner, dict) for inner in value):
        return "a list of tables"
    if isinstance(value, list | tuple):
        if len(value) > 8:
            return f"{len(value)} values"
        lists = (isinstance(inner, list | tuple) and inner for inner in value)
        deep = any(isinstance(inner, list | tuple) for one in lists if one for inner in one)
        return "a list of lists" if deep else f"[{', '.join(map(shown, value))}]"
    if isinstance(value, str):
        return json.dumps(_cut(value), ensure_ascii=False)
    if isinstance(value, bool):
        return json.dumps(value)
    if isinstance(value, int) and abs(value) > LARGEST:
        return f"{Decimal(value):.6g}"  # Python writes no more than 4300 digits
    return str(value)


def _cut(text: str) -> str:
    return text if len(text) <= _MAX_SHOWN else f"{text[: _MAX_SHOWN - 3]}..."


def _check_size(value: Any, where: str, key: str) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise ConfigError(where, key, f"must be finite, got {value}")
    if isinstance(value, int | float) and abs(value) > LARGEST:
        # A whole number may be too large even for a float.
        value = Decimal(value)
        raise ConfigError(where, key, f"must lie within +-{LARGEST:g}, got {value:.6g}")
    if isinstance(value, dict):
        for name, inner in value.items():
            _check_size(inner, where, f"{key}.{shown_key(name)}" if key else shown_key(name))
    if isinstance(value, list):
        for index, inner in enumerate(value):
            _check_size(inner, where, f"{key}[{index}]")


def _reached(table: type[msgspec.Struct], steps: list[str]) -> inspect.Type:
    """The type at a path of keys and indices; of a union, the member that is a container."""
    node: inspect.Type = inspect.type_info(table)
    for step in (*steps, None):
        if isinstance(node, inspect.UnionType):
            node = next((t for t in node.types if isinstance(t, _HOLDERS)), node)
        if step is None:
            break
        if isinstance(node, inspect.StructType):
            node = next(field.type for field in node.fields if field.encode_name == step)
        elif isinstance(node, inspect.DictType):
            node = node.value_type
        elif isinstance(node, inspect.TupleType):
            node = node.item_types[int(step)]
        else:
            assert isinstance(node, inspect.VarTupleType | inspect.ListType)
            node = node.item_type
    return node


def _explain(error: msgspec.ValidationError, data: Any, table: type[T], where: str) -> ConfigError:
    match = _PATH.match(str(error))
    assert match is not None
    message, path = match[1], match[2] or ""
    steps = [name or index for name, index in _STEP.findall(path)]
    key = path.lstrip(".")
    if unknown := re.fullmatch(r"Object contains unknown field `(.*)`", message, re.DOTALL):
        node = _reached(table, steps)
        assert isinstance(node, inspect.StructType)
        allowed = [field.encode_name for field in node.fields]
        name = shown_key(unknown[1])
        full = f"{key}.{name}" if key else name
        return ConfigError(where, full, f"is not a key here; {did_you_mean(unknown[1], allowed)}")
    if missing := re.fullmatch(r"Object missing required field `(.*)`", message):
        full = f"{key}.{missing[1]}" if key else missing[1]
        return ConfigError(where, full, "is missing")
    wanted = re.sub(r"^Expected ", "", message)
    wanted = re.sub(r", got (`[^`]*`|\d+)$", "", wanted)
    wanted = re.sub(r"`(\w+)((?: \| \w+)*)`", lambda m: _alternatives(m[1] + m[2]), wanted)
    if message.startswith("Invalid enum value"):
        wanted = f"one of {_literals(_reached(table, steps))}"
    elif wanted.endswith("a table"):
        node = _reached(table, steps)
        if isinstance(node, inspect.StructType):
            wanted += f" of {', '.join(field.encode_name for field in node.fields)}"
    if "..." in steps:
        # msgspec does not say which entry of the file is wrong.
        return ConfigError(where, key.partition("[...]")[0], f"must hold {wanted} in every entry")
    if bound := _BOUND.match(wanted):
        # msgspec names the one that is crossed.
        wanted = f"{bound[1]} {_range(_reached(table, steps)) or bound[2]}"
    value = data
    for step in steps:
        value = value[int(step)] if isinstance(value, list) else value[step]
    return ConfigError(where, key, f"must be {wanted}, got {shown(value)}")


def _alternatives(types: str) -> str:
    words = [_WORDS.get(t, t) for t in types.split(" | ") if t != "null"]
    return " or ".join(words)


def _range(node: inspect.Type) -> str:
    """The bounds of a number, such as ">= 0.0, <= 180.0"; none of a type that is no number."""
    options = node.types if isinstance(node, inspect.UnionType) else (node,)
    for one in options:
        if isinstance(one, inspect.IntType | inspect.FloatType):
            bounds = {">": one.gt, ">=": one.ge, "<": one.lt, "<=": one.le}
            return ", ".join(
                f"{sign} {limit}" for sign, limit in bounds.items() if limit is not None
            )
    return ""


def _literals(node: inspect.Type) -> str:
    options = node.types if isinstance(node, inspect.UnionType) else (node,)
    values = [v for t in options if isinstance(t, inspect.LiteralType) for v in t.values]
    return ", ".join(shown(v) for v in values)


def exactly_one(given: Mapping[str, object], where: str, key: str = "") -> str:
    """The one name whose value is not None; ConfigError for none and for several."""
    names = [name for name, value in given.items() if value is not None]
    if len(names) != 1:
        got = " and ".join(names) or "none of them"
        raise ConfigError(where, key, f"needs exactly one of {', '.join(given)}; got {got}")
    return names[0]


def convert(data: Any, table: type[T], where: str) -> T:
    """Data as a schema table; ConfigError for values that do not fit or are not finite.

    where : file and table for the error, e.g. ``a.toml [camera.nav]``
    """
    _check_size(data, where, "")
    return fitted(data, table, where)


def fitted(data: Any, table: type[T], where: str) -> T:
    """Like ``convert``, for numbers of any size."""
    if not isinstance(data, dict):
        raise ConfigError(where, "", f"must be a table, got {shown(data)}")
    try:
        return msgspec.convert(data, table)
    except msgspec.ValidationError as error:
        raise _explain(error, data, table, where) from None
