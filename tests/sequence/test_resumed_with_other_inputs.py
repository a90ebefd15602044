"""A run is not resumed where any of its inputs has changed, and the refusal names the input."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from simgl import assets
from simgl.campaign.campaign_file import load_campaign
from simgl.errors import ConfigError
from simgl.model_files.model_from_mesh import model_from_mesh
from simgl.scenario.loader import load_scenario, scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.sequence.journal import Identity, Journal
from simgl.sequence.run_sequence import COLUMNS, KEYS, identity
from tests.scenario.edited_files import EDITS, edit, write_scene

CAMPAIGN = 'scenario = "scene.toml"\nframes = 3\n[draw]\nrange_m = 50.0\n'


def begin(folder: Path, plan: Identity) -> None:
    """Begin a run in a folder, or resume it."""
    folder.mkdir(exist_ok=True)
    Journal(folder, plan, COLUMNS, KEYS).close()


def sequence(scenario: Scenario) -> Identity:
    return identity(scenario, [scenario.epoch_tai_ns])


@pytest.mark.parametrize("name", sorted(EDITS))
def test_an_edited_input_of_a_sequence_is_named(name: str, tmp_path: Path) -> None:
    path = write_scene(tmp_path)
    begin(tmp_path / "out", sequence(load_scenario(path)))
    begin(tmp_path / "out", sequence(load_scenario(path)))
    edit(tmp_path / name)
    complaint = f"scenario has changed: {name} is not the same; take another folder or remove it"
    with pytest.raises(ConfigError, match=re.escape(complaint)):
        begin(tmp_path / "out", sequence(load_scenario(path)))


@pytest.mark.parametrize("name", [*sorted(EDITS), "campaign.toml"])
def test_an_edited_input_of_a_campaign_is_named(name: str, tmp_path: Path) -> None:
    write_scene(tmp_path)
    path = tmp_path / "campaign.toml"
    path.write_text(CAMPAIGN)
    begin(tmp_path / "out", {"campaign": load_campaign(path).identity})
    if name == "campaign.toml":
        path.write_text(CAMPAIGN.replace("50.0", "60.0"))
    else:
        edit(tmp_path / name)
    complaint = f"campaign has changed: {name} is not the same; take another folder"
    with pytest.raises(ConfigError, match=re.escape(complaint)):
        begin(tmp_path / "out", {"campaign": load_campaign(path).identity})


def test_a_run_may_move_with_its_files(tmp_path: Path) -> None:
    (tmp_path / "here").mkdir()
    path = write_scene(tmp_path / "here")
    begin(tmp_path / "out", sequence(load_scenario(path)))
    (tmp_path / "here").rename(tmp_path / "elsewhere")
    begin(tmp_path / "out", sequence(load_scenario(tmp_path / "elsewhere" / "scene.toml")))


def test_what_is_given_in_memory_counts_too(tmp_path: Path) -> None:
    import trimesh

    def scene(size: float) -> Scenario:
        box = model_from_mesh(trimesh.creation.box((size, 1.0, 1.0)), name="box")
        data = {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "spacecraft": {"box": {"orbit": {"altitude_km": 400.0}}},
        }
        return scenario_from_dict(data, models={"box": box})

    begin(tmp_path / "out", sequence(scene(1.0)))
    begin(tmp_path / "out", sequence(scene(1.0)))
    with pytest.raises(ConfigError, match="has changed: what it holds in memory is not the same"):
        begin(tmp_path / "out", sequence(scene(1.1)))
    with pytest.raises(ConfigError, match="has changed: what it holds in memory is not the same"):
        begin(tmp_path / "out", sequence(replace(scene(1.0), seed=1)))


def test_another_shader_is_another_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = load_scenario(write_scene(tmp_path))
    begin(tmp_path / "out", sequence(scenario))
    (tmp_path / "shaders").mkdir()
    (tmp_path / "shaders" / "a.frag").write_text("void main() {}")
    monkeypatch.setattr(assets, "shaders", lambda: tmp_path / "shaders")
    with pytest.raises(ConfigError, match="program has changed: shaders is not the same"):
        begin(tmp_path / "out", sequence(scenario))


def test_a_file_that_is_read_no_more_is_named(tmp_path: Path) -> None:
    plan = {"scenario": {"a.toml": "1", "b.obj": "2"}}
    begin(tmp_path / "out", plan)
    with pytest.raises(ConfigError, match=r"has changed: b\.obj is not part of it now"):
        begin(tmp_path / "out", {"scenario": {"a.toml": "1"}})
    with pytest.raises(ConfigError, match=r"has changed: c\.obj was not part of it"):
        begin(tmp_path / "out", {"scenario": {"a.toml": "1", "b.obj": "2", "c.obj": "3"}})
