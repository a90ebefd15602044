"""YAML of calibration tools, read as texts, lists and tables alone: no tag makes anything else."""

from __future__ import annotations

import re
from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml

from simgl.config.validation import check_depth, read_text, shown, shown_key
from simgl.errors import ConfigError

# A calibration has some kB, with all its views some hundred; the parser needs 30 s for 1 MB.
_MAX_CHARACTERS = 1 << 19
_DIRECTIVE = re.compile(r"\A((?:[ \t]*(?:#.*)?\n)*)%YAML:.*")
_NEXT = re.compile(r"\n---\s*\Z")
_TAB = re.compile(r"(?<=[\[,:])[ ]*\t[ \t]*")


class _Texts(yaml.BaseLoader):  # type: ignore[misc]
    """Scalars stay texts, whatever their tags say; a key may stand once in a table."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        table = super().construct_mapping(node, deep)
        if len(table) < len(node.value):
            keys = [self.construct_object(key, deep=True) for key, _ in node.value]
            twice = next(key for key in keys if keys.count(key) > 1)
            mark = node.start_mark
            raise yaml.constructor.ConstructorError(
                problem=f"holds {shown(twice)} twice", problem_mark=mark
            )
        return table


def read_yaml(path: Path) -> dict[str, Any]:
    """The parsed file, its numbers as texts.

    Raises AssetError if it cannot be read, ConfigError with the line if it is malformed.
    """
    where, text = str(path), read_text(path)
    if len(text) > _MAX_CHARACTERS:
        problem = f"is too long, {len(text)} characters; at most {_MAX_CHARACTERS} are read"
        raise ConfigError(where, "", problem)
    # OpenCV writes its directive with a colon, which YAML does not know, and "ros2 topic echo" the
    # beginning of a next document; PyYAML takes no tab between two entries, though YAML does.
    text = _DIRECTIVE.sub(r"\1", text, count=1)
    text = _NEXT.sub("\n", text)
    text = _TAB.sub(" ", text)
    try:
        data = yaml.load(text, _Texts)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = "" if mark is None else f" (line {mark.line + 1})"
        problem = " ".join(str(error.problem or error.context).split())[:200]
        raise ConfigError(where, "", f"is not valid YAML: {problem}{line}") from None
    except yaml.YAMLError as error:
        problem = " ".join(str(error).split())[:200]
        raise ConfigError(where, "", f"is not valid YAML: {problem}") from None
    except RecursionError:
        raise ConfigError(where, "", "is nested too deeply") from None
    if not isinstance(data, dict):
        raise ConfigError(where, "", f"must be a table of keys and values, got {shown(data)}")
    check_depth(data, where)
    return data


def at_key(key: str, name: object) -> str:
    """The place of a name within the table at a key, for errors."""
    name = shown_key(str(name))
    return f"{key}.{name}" if key else name
