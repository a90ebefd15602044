"""The cache of what is read from files: it goes by their content."""

from __future__ import annotations

from pathlib import Path

import pytest

from simgl.errors import AssetError
from simgl.file_cache import FileCache
from simgl.input_files import digest_of, read_file, recorded_inputs


class Reader:
    """Reads a file that names another one, and counts how often."""

    def __init__(self, folder: Path) -> None:
        self.first, self.second = folder / "a.txt", folder / "b.txt"
        self.first.write_text("b.txt")
        self.second.write_text("one")
        self.count = 0

    def __call__(self) -> str:
        self.count += 1
        name = read_file(self.first).decode()
        return read_file(self.first.parent / name).decode()


def test_a_value_is_read_again_when_any_of_its_files_has_changed(tmp_path: Path) -> None:
    cache, read = FileCache[str, str](1), Reader(tmp_path)
    assert [cache.get("key", read) for _ in range(3)] == ["one"] * 3
    assert read.count == 1
    read.second.write_text("two")
    assert cache.get("key", read) == "two"
    (tmp_path / "c.txt").write_text("new")
    read.first.write_text("c.txt")
    assert cache.get("key", read) == "new"
    # Nothing that the value was not read from matters any more.
    read.second.unlink()
    assert cache.get("key", read) == "new"
    assert read.count == 3


def test_a_file_that_is_gone_is_an_error_and_what_cannot_be_read_is_not_cached(
    tmp_path: Path,
) -> None:
    cache, read = FileCache[str, str](1), Reader(tmp_path)
    cache.get("key", read)
    read.second.unlink()
    for _ in range(2):
        with pytest.raises(AssetError, match=r"b.txt: cannot be read"):
            cache.get("key", read)
    read.second.write_text("back")
    assert cache.get("key", read) == "back"


def test_a_record_has_the_files_of_cached_values_too(tmp_path: Path) -> None:
    cache, read = FileCache[str, str](1), Reader(tmp_path)
    cache.get("key", read)
    with recorded_inputs() as outer:
        with recorded_inputs() as inner:
            cache.get("key", read)
        read_file(read.first)
    assert read.count == 1
    assert outer == inner == {path: digest_of(path) for path in (read.first, read.second)}


def test_a_file_that_changes_between_two_readings_of_a_record_is_refused(tmp_path: Path) -> None:
    read = Reader(tmp_path)
    with recorded_inputs():
        read()
        read.first.write_text("b.txt ")
        with pytest.raises(AssetError, match=r"a.txt: has changed while"):
            read_file(read.first)
