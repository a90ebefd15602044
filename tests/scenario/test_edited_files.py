"""Files that are edited while a process runs: the next load has their new content."""

from __future__ import annotations

import hashlib
import pickle
from pathlib import Path

import pytest
from simgl_bridge.hashes import scene_hash

from simgl.errors import AssetError
from simgl.model_files.model_library import load_model
from simgl.scenario.loader import load_scenario
from tests.scenario.edited_files import EDITS, edit, write_scene


@pytest.mark.parametrize("name", sorted(EDITS))
def test_an_edited_file_makes_another_scene(name: str, tmp_path: Path) -> None:
    path = write_scene(tmp_path)
    before = scene_hash(load_scenario(path))
    content = (tmp_path / name).read_bytes()
    edit(tmp_path / name)
    assert scene_hash(load_scenario(path)) != before
    (tmp_path / name).write_bytes(content)
    assert scene_hash(load_scenario(path)) == before


def test_a_scenario_names_every_file_that_it_was_read_from(tmp_path: Path) -> None:
    inputs = load_scenario(write_scene(tmp_path)).inputs
    local = {
        path.relative_to(tmp_path): digest
        for path, digest in inputs.items()
        if path.is_relative_to(tmp_path)
    }
    assert set(map(str, local)) == set(EDITS)
    for path, digest in local.items():
        assert hashlib.sha256((tmp_path / path).read_bytes()).hexdigest() == digest
    # Read again, now that its models and maps are in the cache.
    assert load_scenario(tmp_path / "scene.toml").inputs == inputs


def test_equal_files_give_the_same_model_and_a_missing_one_is_missed(tmp_path: Path) -> None:
    write_scene(tmp_path)
    model = load_model("ship.toml", tmp_path)
    assert load_model("ship.toml", tmp_path) is model
    (tmp_path / "skin.png").unlink()
    with pytest.raises(AssetError, match=r'image "skin.png" cannot be read \(No such file'):
        load_model("ship.toml", tmp_path)


def test_a_map_that_changes_after_it_was_loaded_is_refused_when_it_is_drawn(tmp_path: Path) -> None:
    """Its texels are read when they are drawn first, by any process that has the scenario."""
    earth = load_scenario(write_scene(tmp_path)).earth
    assert earth is not None
    assert earth.maps.land is not None
    assert earth.maps.land.read("L").getpixel((0, 0)) == 100
    edit(tmp_path / "land.png")
    with pytest.raises(AssetError, match=r"land\.png has changed since it was loaded"):
        earth.maps.land.read("L")


def test_the_folder_of_the_files_is_no_part_of_the_scene(tmp_path: Path) -> None:
    (tmp_path / "here").mkdir()
    before = scene_hash(load_scenario(write_scene(tmp_path / "here")))
    (tmp_path / "here").rename(tmp_path / "elsewhere")
    assert scene_hash(load_scenario(tmp_path / "elsewhere" / "scene.toml")) == before


def test_a_scene_on_two_line_elements_has_a_hash_and_can_be_sent_to_workers() -> None:
    path = Path(__file__).parents[2] / "examples" / "trajectories" / "tle.toml"
    scenario = load_scenario(path)
    copy = pickle.loads(pickle.dumps(scenario))
    assert scene_hash(copy) == scene_hash(scenario)
    assert copy.poses(copy.epoch_tai_ns).keys() == scenario.poses(scenario.epoch_tai_ns).keys()
