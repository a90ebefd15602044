"""Runs the code blocks of a page in order, in one folder, as its reader would.

    toml, python   whose first line is "# FILE": saved as this file
    toml           whose first line is "# at the end of FILE": appended to it
    python         otherwise: run, all of a page in one session
    sh             each line is run; simgl and python without a process of their own

Other blocks are for reading, as is a block below "<!-- not run: reason -->".
"""

from __future__ import annotations

import re
import runpy
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_FENCE = re.compile(
    r"^(<!-- not run: (?P<reason>.*?) -->\n+)?```(?P<language>\w*)\n(?P<text>.*?)^```", re.M | re.S
)
_SAVED = re.compile(r"# (?P<append>at the end of )?(?P<file>[\w./-]+\.\w+)\n")


@dataclass(frozen=True, kw_only=True)
class Block:
    """A code block of a page.

    language : of the fence; "" without one
    line : of its text in the page, from 1
    not_run : why it is only for reading; None where it is run
    """

    language: str
    text: str
    line: int
    not_run: str | None


def blocks(page: Path) -> Iterator[Block]:
    """The code blocks of a page, from the top."""
    content = page.read_text(encoding="utf-8")
    for match in _FENCE.finditer(content):
        line = content.count("\n", 0, match.start("text")) + 1
        yield Block(
            language=match["language"], text=match["text"], line=line, not_run=match["reason"]
        )


def run_page(page: Path, folder: Path, after_step: Callable[[Path], None] = lambda _: None) -> None:
    """Run the blocks of a page in a folder.

    after_step : is called with the folder after each block and each line of shell

    Raises RuntimeError that names page and line where a command ends with a status other than 0.
    """
    session: dict[str, Any] = {"__name__": "__main__"}
    with chdir(folder):
        for block in blocks(page):
            if block.not_run is None:
                for _ in _steps(block, f"{page.name}:{block.line}", session):
                    after_step(folder)


def _steps(block: Block, where: str, session: dict[str, Any]) -> Iterator[None]:
    """Run a block step by step."""
    saved = _SAVED.match(block.text)
    if block.language in ("toml", "python") and saved is not None:
        path = Path(saved["file"])
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a" if saved["append"] else "w", encoding="utf-8") as file:
            file.write(block.text)
        yield
    elif block.language == "python":
        exec(compile(block.text, where, "exec"), session)
        yield
    elif block.language == "sh":
        for line in block.text.replace("\\\n", " ").splitlines():
            if line.strip() and (status := _run_line(line)):
                raise RuntimeError(f"{where}: {line} ends with status {status}")
            yield


def _run_line(line: str) -> int:
    """Exit status of a line of shell."""
    words = shlex.split(line, comments=True)
    if words[0] == "simgl":
        from simgl.commands.application import run

        return _status(words, run)
    if words[0] == "python" and words[1].endswith(".py"):
        return _status(words[1:], lambda: runpy.run_path(words[1], run_name="__main__"))
    return subprocess.run(["bash", "-ec", line], check=False).returncode


def _status(arguments: list[str], program: Callable[[], object]) -> int:
    before, sys.argv = sys.argv, arguments
    try:
        program()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    finally:
        sys.argv = before
    return 0
