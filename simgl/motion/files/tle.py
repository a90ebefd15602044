"""Two-line element sets, each with or without a name line."""

from __future__ import annotations

from simgl.errors import ConfigError
from simgl.motion.files.text_lines import Line, shown
from simgl.motion.orbits import TwoLineElements

_LENGTH = 69
# Columns, from 1, that must hold a point or a space; detects shifted fields.
_FIXED = {
    "1": {9: " ", 18: " ", 24: ".", 33: " ", 35: ".", 44: " ", 53: " ", 62: " ", 64: " "},
    "2": {8: " ", 12: ".", 17: " ", 21: ".", 26: " ", 34: " ", 38: ".", 43: " ", 47: ".", 52: " "}
    | {55: "."},
}


def read_tle(lines: list[Line]) -> list[TwoLineElements]:
    """All element sets; ConfigError with the line for malformed ones."""
    result: list[TwoLineElements] = []
    name, first = "", None
    for line in lines:
        text = line.text.rstrip()
        if not text:
            continue
        if first is not None:
            if not text.startswith("2 "):
                line.fail("", f"must be line 2 of an element set, got {shown(text)}")
            _check(line, text)
            result.append(_elements(name, first, line))
            name, first = "", None
        elif text.startswith("1 "):
            _check(line, text)
            first = line
        elif text.startswith("2 "):
            line.fail("", "is line 2 of an element set without its line 1")
        else:
            name = text.removeprefix("0 ").strip()
    if first is not None:
        first.fail("", "is line 1 of an element set without its line 2")
    if not result:
        raise ConfigError(str(lines[0].path) if lines else "", "", "holds no two-line element set")
    return result


def _check(line: Line, text: str) -> None:
    if len(text) != _LENGTH:
        line.fail("", f"must have {_LENGTH} characters, got {len(text)}")
    for column, wanted in _FIXED[text[0]].items():
        if text[column - 1] != wanted:
            what = "a point" if wanted == "." else "a space"
            line.fail("", f"must have {what} in column {column}, got {shown(text[column - 1])}")
    total = sum(int(c) if c.isdigit() else c == "-" for c in text[:-1]) % 10
    if not text[-1].isdigit() or int(text[-1]) != total:
        line.fail("", f"has the checksum {shown(text[-1])}; its digits give {total}")


def _elements(name: str, first: Line, second: Line) -> TwoLineElements:
    one, two = first.text.rstrip(), second.text.rstrip()
    if one[2:7] != two[2:7]:
        second.fail("", f"is of object {two[2:7]}, the line before of {one[2:7]}")
    try:
        return TwoLineElements(name=name or one[2:7].strip(), lines=(one, two))
    except ValueError as error:
        first.fail("", f"is not an element set: {error}")
