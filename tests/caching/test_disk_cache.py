"""Arrays that are computed once on a machine."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from simgl import disk_cache
from simgl.arrays import AnyArray
from simgl.disk_cache import cache_folder, computed_once, read_arrays, write_arrays


def test_arrays_are_computed_once_again_after_damage_and_always_without_a_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    calls = []

    def compute() -> dict[str, AnyArray]:
        calls.append(1)
        return {"codes": np.arange(6, dtype=np.uint8).reshape(2, 3)}

    first = computed_once("some-1-7", compute)["codes"]
    again = computed_once("some-1-7", compute)["codes"]
    assert len(calls) == 1
    assert again.dtype == np.uint8
    np.testing.assert_array_equal(again, first)
    computed_once("some-1-8", compute)
    assert len(calls) == 2
    (path,) = cache_folder("noise").glob("some-1-7-*.npz")
    path.write_bytes(path.read_bytes()[:-20])
    np.testing.assert_array_equal(computed_once("some-1-7", compute)["codes"], first)
    assert len(calls) == 3
    assert not caplog.records
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    np.testing.assert_array_equal(computed_once("some-1-7", compute)["codes"], first)
    assert "noise is computed again next time" in caplog.text


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
