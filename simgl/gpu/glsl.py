"""Assemble a GLSL stage from files: each include once, errors named by file and line."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from simgl.errors import ShaderError

GLSL_VERSION = 330

_INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$')
# How drivers point at a line: Mesa "7:12(3)", NVIDIA "7(12)".
_LOG_PLACE = re.compile(r"\b(\d+)(?::(\d+)\(\d+\)|\((\d+)\))")


@dataclass(frozen=True)
class Stage:
    """One assembled stage; ``files`` is indexed by GLSL's source-string number."""

    text: str
    files: tuple[str, ...]

    def explain(self, log: str) -> str:
        """A driver's log with its source-string numbers replaced by file names."""

        def place(match: re.Match[str]) -> str:
            index, line = int(match[1]), match[2] or match[3]
            return f"{self.files[index]}:{line}" if index < len(self.files) else match[0]

        return _LOG_PLACE.sub(place, log)


def assemble(
    root: Path,
    name: str,
    defines: Mapping[str, int | float] | None = None,
    blocks: Mapping[str, str] | None = None,
    version: int = GLSL_VERSION,
) -> Stage:
    """The stage in file ``name`` under ``root`` with everything that it includes.

    defines : written as ``#define`` lines at the head
    blocks : generated texts that files include by name, e.g. ``{"block/frame": "layout(...) ..."}``
    version : of GLSL
    """
    files: list[str] = []
    generated = dict(blocks or {})

    def emit(wanted: str, wanted_by: str) -> list[str]:
        if wanted in files:
            return []
        if wanted in generated:
            lines = generated[wanted].splitlines()
        else:
            path = root / wanted
            if not path.is_file():
                raise ShaderError(f'{wanted_by}: no include "{wanted}" under {root.name}/')
            lines = path.read_text(encoding="utf-8").splitlines()
        index = len(files)
        files.append(wanted)
        out = [f"#line 1 {index}"]
        for number, line in enumerate(lines, 1):
            if line.startswith("#version"):
                raise ShaderError(f"{wanted}:{number}: simgl writes #version itself")
            if match := _INCLUDE.match(line):
                out += emit(match[1], f"{wanted}:{number}")
                out.append(f"#line {number + 1} {index}")
            else:
                out.append(line)
        return out

    body = emit(name, "simgl")
    head = [f"#version {version} core"]
    head += [f"#define {key} {value}" for key, value in (defines or {}).items()]
    return Stage("\n".join(head + body) + "\n", tuple(files))
