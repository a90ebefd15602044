"""Lines of a text file with their numbers, and errors that name them."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from simgl.errors import ConfigError
from simgl.input_files import read_file

# A month at 1 Hz; some 4 million lines, which take 4 GB while they are read.
MAX_BYTES = 256 << 20


def text_of(path: Path) -> str:
    """The file as text; AssetError if it cannot be read, ConfigError if it is not text."""
    data = read_file(path, MAX_BYTES)
    if data.startswith((b"DAF/SPK", b"DAF/CK", b"NAIF/DAF")):
        problem = "is one SPICE kernel; give a meta-kernel (KPL/MK) that names it and the others"
        raise ConfigError(str(path), "", problem)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ConfigError(str(path), "", f"is not UTF-8 text (byte {error.start})") from None
    if "\0" in text:
        raise ConfigError(str(path), "", f"is not text (byte {text.index(chr(0))} is zero)")
    return text


@dataclass(frozen=True)
class Line:
    """A line of a file, with its number from 1."""

    path: Path
    number: int
    text: str

    @property
    def where(self) -> str:
        """File and line, for error messages."""
        return f"{self.path} line {self.number}"

    def fail(self, key: str, problem: str) -> NoReturn:
        """Raise ConfigError about this line."""
        raise ConfigError(self.where, key, problem)

    def number_of(self, text: str, key: str) -> float:
        """A finite number from text; ConfigError for other texts."""
        try:
            value = float(text)
        except ValueError:
            self.fail(key, f"must be a number, got {shown(text)}")
        if not math.isfinite(value):
            self.fail(key, f"must be finite, got {shown(text)}")
        return value

    def numbers(self, words: Sequence[str], keys: Sequence[str]) -> list[float]:
        """One finite number per key; ConfigError for other texts or another count."""
        if len(words) != len(keys):
            self.fail("", f"must hold {' '.join(keys)}, got {len(words)} values")
        return [self.number_of(word, key) for word, key in zip(words, keys, strict=True)]


def lines_of(path: Path, text: str) -> list[Line]:
    """All lines of a text, including blank ones."""
    return [Line(path, number, line) for number, line in enumerate(text.splitlines(), start=1)]


def shown(text: str) -> str:
    """A piece of a file in quotes, shortened to 60 characters."""
    return json.dumps(text if len(text) <= 60 else text[:57] + "...", ensure_ascii=False)
