"""Arrays that are computed once on a machine."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from simgl import disk_cache
from simgl.arrays import AnyArray
from simgl.disk_cache import cache_folder, computed_once, read_arrays, write_arrays

Arrays = dict[str, AnyArray]


class Maker:
    """Counts how often it computes."""

    calls = 0

    def __call__(self) -> Arrays:
        self.calls += 1
        return {"codes": np.arange(6, dtype=np.uint8).reshape(2, 3)}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return cache_folder("some")


def test_arrays_are_computed_once_again_after_damage_and_always_without_a_folder(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    compute = Maker()

    def once(seed: int) -> AnyArray:
        return computed_once("some", ["numpy"], ("table", seed), compute)["codes"]

    first, again = once(7), once(7)
    assert compute.calls == 1
    assert again.dtype == np.uint8
    np.testing.assert_array_equal(again, first)
    (path,) = folder.iterdir()
    once(8)
    assert compute.calls == 2
    path.write_bytes(path.read_bytes()[:-20])
    np.testing.assert_array_equal(once(7), first)
    assert compute.calls == 3
    assert not caplog.records
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    np.testing.assert_array_equal(once(7), first)
    assert compute.calls == 4
    once(9)
    (record,) = caplog.records
    message = record.getMessage()
    assert str(tmp_path / "file" / "simgl" / "some") in message
    assert "computed again next time" in message


def test_a_changed_module_or_package_computes_again(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = tmp_path / "tables.py"
    module = ModuleType("simgl.tables")
    module.__file__ = str(source)
    monkeypatch.setitem(sys.modules, "simgl.tables", module)
    compute = Maker()

    def once() -> None:
        computed_once("some", ["simgl.tables", "numpy"], None, compute)

    for calls, text in ((1, "a = 1"), (2, "a = 2"), (2, "a = 1")):
        source.write_text(text)
        once()
        assert compute.calls == calls
    monkeypatch.setattr("importlib.metadata.version", lambda name: f"other {name}")
    once()
    assert compute.calls == 3
    assert len(list(folder.iterdir())) == 3


@pytest.mark.usefixtures("folder")
def test_other_arrays_than_are_computed_are_no_use() -> None:
    compute = Maker()

    def once(fits: Callable[[Arrays], bool]) -> None:
        computed_once("some", [], None, compute, fits)

    once(lambda arrays: arrays["codes"].shape == (2, 3))
    once(lambda arrays: arrays["codes"].shape == (2, 3))
    assert compute.calls == 1
    once(lambda arrays: arrays["codes"].shape == (2, 4))
    assert compute.calls == 2
    once(lambda arrays: arrays["heights"].shape == (2, 4))
    assert compute.calls == 3


@pytest.mark.parametrize("compressed", [False, True])
def test_a_flipped_bit_anywhere_is_noticed(tmp_path: Path, compressed: bool) -> None:
    path = tmp_path / "a.npz"
    arrays: Any = {"a": np.arange(300, dtype=np.float32), "b": np.eye(3)}
    (np.savez_compressed if compressed else np.savez)(path, **arrays)
    content = path.read_bytes()
    for place in range(0, len(content), 7):
        damaged = bytearray(content)
        damaged[place] ^= 4
        path.write_bytes(damaged)
        read = read_arrays(path)
        # A bit of dates, of names' flags or of spare fields changes nothing that is read.
        if read is not None and set(read) == set(arrays):
            for name, array in arrays.items():
                np.testing.assert_array_equal(read[name], array)


def test_the_files_unused_for_longest_make_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(disk_cache, "MAX_BYTES", 11_000)
    paths = [tmp_path / f"{number}.npz" for number in range(4)]
    for age, path in enumerate(paths[:3]):
        write_arrays(path, {"a": np.zeros(400)}, "")
        os.utime(path, ns=(age, age))
    assert read_arrays(paths[0]) is not None
    write_arrays(paths[3], {"a": np.zeros(400)}, "")
    assert [path.name for path in paths if path.exists()] == ["0.npz", "2.npz", "3.npz"]
    # The newest stays, even if it is larger.
    write_arrays(paths[1], {"a": np.zeros(4000)}, "")
    assert [path.name for path in tmp_path.iterdir()] == ["1.npz"]
