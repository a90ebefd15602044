"""A file that a user names is a regular one of bounded size, or it is refused at once."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from simgl.errors import AssetError
from simgl.input_files import read_file
from tests.input_files.special_files import COMPLAINTS, place


@pytest.mark.parametrize("kind", COMPLAINTS)
def test_what_is_no_regular_file_is_refused_without_waiting(kind: str, tmp_path: Path) -> None:
    place(kind, tmp_path / "input")
    with pytest.raises(AssetError, match="^" + re.escape(f"{tmp_path}/input: {COMPLAINTS[kind]}")):
        read_file(tmp_path / "input")


def test_a_link_to_a_regular_file_is_followed(tmp_path: Path) -> None:
    (tmp_path / "there").write_bytes(b"content")
    (tmp_path / "here").symlink_to("there")
    assert read_file(tmp_path / "here") == b"content"


def test_the_limit_is_the_largest_size_that_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(bytes(2048))
    assert len(read_file(path, 2048)) == 2048
    path.write_bytes(bytes(2049))
    with pytest.raises(AssetError, match="is too large, 2049 bytes; at most 2048 bytes are read"):
        read_file(path, 2048)


@pytest.mark.parametrize("name", ["a\0b", "\ud800", "x" * 300])
def test_a_name_that_no_file_can_have_is_refused_in_one_line(name: str) -> None:
    with pytest.raises(AssetError, match="cannot be read") as caught:
        read_file(Path(name))
    # Also a line that can be printed.
    assert "\n" not in str(caught.value)
    str(caught.value).encode()
