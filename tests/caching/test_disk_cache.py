"""Arrays that are computed once on a machine."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simgl.arrays import AnyArray
from simgl.disk_cache import cache_folder, computed_once


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
