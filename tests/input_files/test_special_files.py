"""Wherever a user names a file: simgl reads no pipe, device, socket, folder or endless file."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.damaged_files.valid_files import READERS, gltf, write_all
from simgl.errors import SimglError
from simgl.inspection.model_check import check_model
from simgl.model_files.model_library import load_model
from tests.input_files.special_files import COMPLAINTS, no_waiting, place


@pytest.fixture(scope="module")
def valid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a valid file of every kind."""
    folder = tmp_path_factory.mktemp("valid")
    write_all(folder)
    return folder


@pytest.fixture(autouse=True)
def _no_waiting() -> Iterator[None]:
    with no_waiting():
        yield


@pytest.mark.parametrize("kind", COMPLAINTS)
@pytest.mark.parametrize("name", sorted(READERS))
def test_a_file_of_another_kind_is_refused_at_once(
    name: str, kind: str, valid: Path, tmp_path: Path
) -> None:
    shutil.copytree(valid, tmp_path, dirs_exist_ok=True)
    place(kind, tmp_path / name)
    if name == "cache.npz":
        assert READERS[name](tmp_path) is None  # what it holds is made again
        return
    with pytest.raises(SimglError) as caught:
        READERS[name](tmp_path)
    text = str(caught.value)
    assert name in text
    assert "\n" not in text
    # Within a root, what a link leads to is looked at first; a loop of links leads to no file.
    others = {
        "endless": ("leads out of",),
        "process": ("leads out of",),
        "loop": ("Symlink loop", "no image", "no such", "there is no"),
    }
    assert any(complaint in text for complaint in (COMPLAINTS[kind], *others.get(kind, ())))


@pytest.mark.parametrize("uri", ["/dev/zero", "pipe", "/proc/self/status", ".", "/dev/stdin"])
@pytest.mark.parametrize("what", ["buffer", "image"])
def test_a_uri_names_a_regular_file(what: str, uri: str, valid: Path, tmp_path: Path) -> None:
    shutil.copytree(valid, tmp_path, dirs_exist_ok=True)
    place("pipe", tmp_path / "pipe")
    document, _ = gltf(
        uri if what == "buffer" else "part.bin", uri if what == "image" else "skin.png"
    )
    path = tmp_path / "uri.gltf"
    path.write_text(json.dumps(document))
    for read in (load_model, check_model):
        with pytest.raises(SimglError, match=f'{what} "{uri}" (cannot be read|does not end)'):
            read(str(path))
