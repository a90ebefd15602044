"""The soak in a short form: with small caches, no more OpenGL objects from some frames on."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks import soak
from simgl.camera import distortion
from simgl.gpu import render_targets
from simgl.passes import mesh_store, optics, shadow, warp


def test_objects_of_changing_scenarios_are_bounded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module, name in (
        (mesh_store, "MAX_BYTES"),
        (render_targets, "_MAX_BYTES"),
        (shadow, "MAX_BYTES"),
        (optics, "_MAX_BYTES"),
        (warp, "_MAX_BYTES"),
        (distortion, "_MAX_BYTES"),
    ):
        # A few values each; what one frame needs stays all the same.
        monkeypatch.setattr(module, name, 4 << 20)
    monkeypatch.setattr(mesh_store, "CAPACITY", 4)
    found = soak.scenes(11, tmp_path)
    # Eight probes and tables of the air are cached, whatever their sizes.
    filled, *_, last = found.opengl_objects[8:]
    assert last <= 1.03 * filled


def test_simulators_leave_nothing_whether_they_open_or_not(tmp_path: Path) -> None:
    assert set(soak.sessions(4, tmp_path).opengl_objects) == {0}
