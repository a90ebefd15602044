"""Texts for clients: one line, in which no path of the server's disk is left."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

# Longer than any list of names that a scene of this size has.
_LONGEST = 4000
# An absolute path: folders, which may hold spaces, and the last name. A slash within a word, such
# as in m/s or target/body, starts none; an escaped end of line, as in an error's text, ends a word.
_PATH = re.compile(
    r"""(?:(?<=\\[nrt])|(?<![\w./:~)\]-]))(?:file://)?/(?=[^\s/])"""
    r"""(?:[^/\n"'`:;|<>]*/)*([^/\s"'`:;,|<>()]*)"""
)


def public_text(text: str, folders: Iterable[Path] = ()) -> str:
    """A text for clients: of a path only the file's name is left.

    folders : a file below one of them is named relative to it
    """
    line = " ".join(text.split())
    for folder in folders:
        below = re.escape(str(folder))
        line = re.sub(rf"{below}/", "", line)
        line = re.sub(rf"{below}(?![\w.-])", "the root", line)
    line = _PATH.sub(r"\1", line)
    return line if len(line) <= _LONGEST else f"{line[: _LONGEST - 3]}..."
