"""Strict conversion of parsed TOML into schema tables, with errors that finish the sentence."""

from __future__ import annotations

import math
import re
import tomllib
from pathlib import Path
from typing import Any, TypeVar

import msgspec
from msgspec import inspect

from simgl.errors import AssetError, ConfigError, did_you_mean

T = TypeVar("T", bound=msgspec.Struct)

_PATH = re.compile(r"^(.*?)(?: - at `\$(.*)`)?$", re.DOTALL)
_STEP = re.compile(r"\.(\w+)|\[(\d+|\.\.\.)\]")
_WORDS = {
    "float": "a number",
    "int": "a whole number",
    "str": "a text",
    "bool": "true or false",
    "array": "a list",
    "object": "a table",
}


def read_toml(path: Path) -> dict[str, Any]:
    """The parsed file; unreadable or malformed is an error that names file and line."""
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise AssetError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError as error:
        raise ConfigError(str(path), "", f"is not UTF-8 text (byte {error.start})") from None
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(str(path), "", f"is not valid TOML: {error}") from None


def _shown(value: Any) -> str:
    return f'"{value}"' if isinstance(value, str) else str(value)


def _check_finite(value: Any, where: str, key: str) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise ConfigError(where, key, f"must be finite, got {value}")
    if isinstance(value, dict):
        for name, inner in value.items():
            _check_finite(inner, where, f"{key}.{name}" if key else name)
    if isinstance(value, list):
        for index, inner in enumerate(value):
            _check_finite(inner, where, f"{key}[{index}]")


def _field_names(table: type[msgspec.Struct], keys: list[str]) -> list[str]:
    """Names allowed in the table reached from ``table`` by a path of keys."""
    node: inspect.Type = inspect.type_info(table)
    for key in keys:
        assert isinstance(node, inspect.StructType)
        node = next(field.type for field in node.fields if field.encode_name == key)
        if isinstance(node, inspect.UnionType):
            node = next(t for t in node.types if isinstance(t, inspect.StructType))
    assert isinstance(node, inspect.StructType)
    return [field.encode_name for field in node.fields]


def _explain(error: msgspec.ValidationError, data: Any, table: type[T], where: str) -> ConfigError:
    match = _PATH.match(str(error))
    assert match is not None
    message, path = match[1], match[2] or ""
    steps = [name or index for name, index in _STEP.findall(path)]
    keys = [name for name, _ in _STEP.findall(path) if name]
    key = path.lstrip(".")
    if unknown := re.fullmatch(r"Object contains unknown field `(.*)`", message):
        allowed = _field_names(table, keys)
        full = f"{key}.{unknown[1]}" if key else unknown[1]
        return ConfigError(where, full, f"is not a key here; {did_you_mean(unknown[1], allowed)}")
    if missing := re.fullmatch(r"Object missing required field `(.*)`", message):
        full = f"{key}.{missing[1]}" if key else missing[1]
        return ConfigError(where, full, "is missing")
    value = data
    for step in steps:
        value = value[int(step)] if isinstance(value, list) else value[step]
    wanted = re.sub(r"^Expected ", "", message)
    wanted = re.sub(r", got (`[^`]*`|\d+)$", "", wanted)
    wanted = re.sub(r"`(\w+)((?: \| \w+)*)`", lambda m: _alternatives(m[1] + m[2]), wanted)
    if enum := re.fullmatch(r"Invalid enum value .*", message):
        del enum
        wanted = f"one of {_enum_values(table, keys)}"
    return ConfigError(where, key, f"must be {wanted}, got {_shown(value)}")


def _alternatives(types: str) -> str:
    words = [_WORDS.get(t, t) for t in types.split(" | ") if t != "null"]
    return " or ".join(words)


def _enum_values(table: type[msgspec.Struct], keys: list[str]) -> str:
    node: inspect.Type = inspect.type_info(table)
    for key in keys:
        if isinstance(node, inspect.UnionType):
            node = next(t for t in node.types if isinstance(t, inspect.StructType))
        assert isinstance(node, inspect.StructType)
        node = next(field.type for field in node.fields if field.encode_name == key)
    options = node.types if isinstance(node, inspect.UnionType) else (node,)
    values = [v for t in options if isinstance(t, inspect.LiteralType) for v in t.values]
    return ", ".join(_shown(v) for v in values)


def convert(data: Any, table: type[T], where: str) -> T:
    """Data as a schema table; ``where`` opens the error message, e.g. ``a.toml [camera.nav]``."""
    if not isinstance(data, dict):
        raise ConfigError(where, "", f"must be a table, got {_shown(data)}")
    _check_finite(data, where, "")
    try:
        return msgspec.convert(data, table)
    except msgspec.ValidationError as error:
        raise _explain(error, data, table, where) from None
