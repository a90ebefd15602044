"""The soak in a short form: with small caches, no more OpenGL objects from some frames on."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks import soak
from simgl.gpu import render_targets
from simgl.passes import mesh_store, optics, readout, shadow, texture_store, warp
from simgl.passes.background import air, environment_probe

_FEW = 4


def test_objects_of_changing_scenarios_are_bounded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (render_targets, mesh_store, optics, readout, shadow, texture_store, warp):
        monkeypatch.setattr(module, "MANY", _FEW)
    monkeypatch.setattr(environment_probe, "CAPACITY", _FEW)
    monkeypatch.setattr(air, "_CAPACITY", _FEW)
    monkeypatch.setattr(soak, "NOTES", 4 * _FEW)
    found = soak.scenes(4 * _FEW + 1, tmp_path).opengl_objects
    # Once every cache holds its few values, a new scene costs an old one.
    half = len(found) // 2
    assert max(found[half:]) <= max(found[:half])


def test_simulators_leave_nothing_whether_they_open_or_not(tmp_path: Path) -> None:
    assert set(soak.sessions(4, tmp_path).opengl_objects) == {0}
