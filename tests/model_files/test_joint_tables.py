"""Model cards: which joint sits on which, from the file's nodes or in words."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simgl.errors import AssetError, SimglError
from simgl.model_files.model_library import load_model
from simgl.scenario.loader import load_scenario
from simgl.scene.spacecraft import SpacecraftModel
from simgl.sequence.run_sequence import fingerprint
from tests.model_files.gltf import Document

CARD = """\
name = "arm"
file = "arm.glb"
unit_m = 1.0
axes = { x = "+x", y = "+y", z = "+z" }
[[joint]]
name = "shoulder"
part = "pivot"
kind = "revolute"
axis_body = [0.0, 0.0, 1.0]
origin_body_m = [1.0, 0.0, 0.0]
range_deg = [-90.0, 90.0]
[[joint]]
name = "elbow"
part = "lower"
kind = "revolute"
axis_body = [0.0, 1.0, 0.0]
origin_body_m = [2.0, 0.0, 0.0]
range_deg = [-90.0, 90.0]
keypoints = ["tip"]
[[joint]]
name = "reach"
part = "tool"
kind = "prismatic"
axis_body = [2.0, 0.0, 0.0]
range_m = [-0.5, 1.0]
parent = "elbow"
[keypoints]
tip = [3.0, 0.0, 0.0]
"""


def document() -> Document:
    """hull; pivot, a bare node, with upper, lamp and lower under it; and tool by itself."""
    made = Document()
    points = made.accessor([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    mesh = made.mesh(attributes={"POSITION": points})

    def node(name: str, x: float, children: tuple[int, ...] = (), **more: Any) -> dict[str, Any]:
        return {"name": name, "translation": [x, 0, 0], "children": list(children), **more}

    made.json["nodes"] = [
        node("hull", 0.0, (1,), mesh=mesh),
        node("pivot", 1.0, (2, 3)),
        node("upper", 0.0, (4,), mesh=mesh),
        node("lamp", 0.5, mesh=mesh),
        node("lower", 1.0, mesh=mesh),
        node("tool", 3.0, mesh=mesh),
    ]
    for one in made.json["nodes"]:
        if not one["children"]:
            del one["children"]
    made.json["scenes"] = [{"nodes": [0, 5]}]
    return made


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    document().write_glb(tmp_path / "arm.glb")
    (tmp_path / "arm.toml").write_text(CARD)
    return tmp_path


def read(folder: Path, card: str = CARD) -> SpacecraftModel:
    (folder / "arm.toml").write_text(card)
    return load_model("arm.toml", folder)


def test_nodes_say_what_a_joint_carries_and_which_joints_sit_on_it(folder: Path) -> None:
    model = read(folder)
    assert model.parts == ("hull", "upper", "lower", "lamp", "tool")
    shoulder, elbow, reach = model.joints
    held = [{model.parts[p] for p in joint.parts} for joint in model.joints]
    assert held == [{"upper", "lamp"}, {"lower"}, {"tool"}]
    assert (shoulder.parent, elbow.parent, reach.parent) == (None, 0, 1)
    assert reach.slides
    assert reach.limits == (-0.5, 1.0)


def test_a_chain_through_the_file_moves_its_end(folder: Path) -> None:
    """A quarter turn at the shoulder and 1 m along: from (3, 0, 0) to (1, 3, 0)."""
    posed = read(folder).posed({"shoulder": np.pi / 2.0, "reach": 1.0})
    baked = posed.posed_mesh.baked()
    tool = baked.positions[baked.part == posed.parts.index("tool")]
    np.testing.assert_allclose(tool[0], [1.0, 3.0, 0.0], atol=4e-7)
    np.testing.assert_allclose(posed.keypoints["tip"], [1.0, 2.0, 0.0], atol=1e-12)


def test_two_joints_of_one_part_need_a_parent_and_move_it_together(folder: Path) -> None:
    both = CARD.replace('part = "tool"', 'part = "lower"')
    model = read(folder, both)
    assert [joint.parts for joint in model.joints] == [(1, 3), (), (2,)]
    assert [joint.parent for joint in model.joints] == [None, 0, 1]


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ('parent = "elbow"', 'parent = "elbo"',
         'arm.toml: joint reach has a parent that is not a joint: did you mean "elbow"? '
         "(allowed: elbow, reach, shoulder)"),
        ('parent = "elbow"', 'parent = "reach"',
         "arm.toml: joint reach carries itself: reach on reach"),
        ('keypoints = ["tip"]', 'keypoints = ["tip"]\nparent = "reach"',
         "arm.toml: joint elbow carries itself: elbow on reach on elbow"),
        ('part = "tool"', 'part = "tol"',
         'arm.toml: joint reach names no part: did you mean "tool"? '
         "(allowed: hull, lamp, lower, pivot, tool, upper)"),
        ('name = "reach"', 'name = "elbow"', "arm.toml: joint elbow is defined twice"),
        ("range_m = [-0.5, 1.0]", "range_m = [0.5, 1.0]",
         "arm.toml: joint reach must have 0, the stored position, in its range_m"),
        ("range_m = [-0.5, 1.0]", "range_deg = [-0.5, 1.0]",
         "arm.toml: joint reach is prismatic: it must not have range_deg"),
        ("range_m = [-0.5, 1.0]\n", "",
         "arm.toml: joint reach is prismatic: it requires range_m"),
        ("origin_body_m = [2.0, 0.0, 0.0]\n", "",
         "arm.toml: joint elbow is revolute: it requires origin_body_m"),
        ('parent = "elbow"', 'parent = "elbow"\nsunward_body = [0, 0, 1]',
         "arm.toml: joint reach is prismatic: it must not have sunward_body"),
        ('parent = "elbow"', 'parent = "elbow"\nkeypoints = ["tip"]',
         'arm.toml: joint reach moves keypoint "tip", as joint "elbow" does'),
        ('keypoints = ["tip"]', 'keypoints = ["top"]',
         'arm.toml: joint elbow names no keypoint: did you mean "tip"? (allowed: tip)'),
        ('kind = "prismatic"', 'kind = "screw"',
         'arm.toml: joint[2].kind must be one of "prismatic", "revolute", got "screw"'),
    ],
)  # fmt: skip
def test_a_bad_joint_is_one_line(folder: Path, old: str, new: str, complaint: str) -> None:
    assert CARD.count(old) == 1
    with pytest.raises(SimglError, match=re.escape(complaint)) as caught:
        read(folder, CARD.replace(old, new))
    assert "\n" not in str(caught.value)


def test_a_parent_that_the_file_denies_is_one_line(folder: Path) -> None:
    """The lower arm hangs under the shoulder's node; no joint of it may sit on the tool alone."""
    free = CARD.replace('parent = "elbow"\n', "")
    card = free.replace('keypoints = ["tip"]', 'keypoints = ["tip"]\nparent = "reach"')
    complaint = (
        'joint elbow has a parent, "reach", that contradicts the file: "lower" hangs under '
        '"pivot", which joint "shoulder" moves'
    )
    with pytest.raises(SimglError, match=re.escape(complaint)):
        read(folder, card)


def test_two_joints_of_one_part_without_a_parent_are_one_line(folder: Path) -> None:
    card = CARD.replace('part = "tool"', 'part = "lower"').replace('parent = "elbow"\n', "")
    complaint = (
        'moves part "lower", as joint "elbow" does; parent must say which of them sits on the other'
    )
    with pytest.raises(SimglError, match=re.escape(complaint)):
        read(folder, card)


def test_a_name_of_two_parts_is_refused(folder: Path) -> None:
    made = document()
    made.json["nodes"][3]["name"] = "lower"
    made.write_glb(folder / "arm.glb")
    complaint = 'joint elbow names part "lower", of which the file has 2'
    with pytest.raises(SimglError, match=re.escape(complaint)):
        read(folder)


def test_a_card_knows_its_unit_and_axes(folder: Path) -> None:
    with pytest.raises(AssetError, match=re.escape('model "arm.toml" knows its unit')):
        load_model("arm.toml", folder, 0.001)
    with pytest.raises(AssetError, match=re.escape('model "arm.toml" knows its axes')):
        load_model("arm.toml", folder, None, "y")


def test_a_file_of_another_kind_is_refused_with_the_kinds_there_are(folder: Path) -> None:
    (folder / "arm.step").write_text("ISO-10303-21;")
    complaint = (
        "arm.step: neither a mesh that simgl reads (.glb, .gltf, .obj, .stl) nor a model card "
        "(.toml)"
    )
    with pytest.raises(AssetError, match=re.escape(complaint)):
        load_model("./arm.step", folder)


SCENE = """\
[epoch]
utc = "2026-03-20T12:00:00"
[spacecraft.arm]
model = "arm.toml"
position_icrf_m = [7e6, 0, 0]
joints_deg = { shoulder = 30.0 }
joints_m = { reach = 0.25 }
"""


def scenario(folder: Path, text: str) -> Any:
    (folder / "scene.toml").write_text(text)
    return load_scenario(folder / "scene.toml")


def test_a_scenario_turns_by_degrees_and_slides_by_metres(folder: Path) -> None:
    (body,) = scenario(folder, SCENE).models_at_epoch()
    np.testing.assert_allclose(body.angles, [np.radians(30.0), 0.0, 0.25])


def test_a_file_moves_hinges_and_rails(folder: Path) -> None:
    text = "time_s,joint_shoulder_deg,joint_reach_m\n-10,0,0\n10,60,0.5\n"
    (folder / "arm.csv").write_text(text)
    one = SCENE.partition("joints_deg")[0] + 'joint_file = "arm.csv"\n'
    (body,) = scenario(folder, one).models_at_epoch()
    np.testing.assert_allclose(body.angles, [np.radians(30.0), 0.0, 0.25])


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("reach = 0.25", "reach = 2.0", 'joints_m.reach must move "reach" within -0.5..1 m, got 2'),
        ("joints_m = { reach", "joints_m = { elbow", 'joints_m.elbow "elbow" turns, by degrees'),
        ("shoulder = 30.0", "reach = 3.0", 'joints_deg.reach "reach" slides, by metres'),
        ("joints_m = { reach = 0.25 }", 'sun_tracking = ["elbow"]',
         'sun_tracking cannot turn "elbow" to the Sun: its model names no sunward_body'),
    ],
)  # fmt: skip
def test_what_a_joint_cannot_do_is_one_line(
    folder: Path, old: str, new: str, complaint: str
) -> None:
    assert SCENE.count(old) == 1
    with pytest.raises(SimglError, match=re.escape(complaint)):
        scenario(folder, SCENE.replace(old, new))


def test_at_most_two_drives_on_each_other_follow_the_sun(folder: Path) -> None:
    card = CARD.replace('kind = "prismatic"', 'kind = "revolute"').replace(
        "range_m = [-0.5, 1.0]", "origin_body_m = [3, 0, 0]\nrange_deg = [-9, 9]"
    ).replace('parent = "elbow"', 'parent = "elbow"\nsunward_body = [0, 0, 1]')  # fmt: skip
    (folder / "arm.toml").write_text(card)
    three = SCENE.partition("joints_deg")[0] + 'sun_tracking = ["reach", "shoulder", "elbow"]\n'
    complaint = (
        "sun_tracking has shoulder, elbow, reach each on the one before; at most two may follow"
    )
    with pytest.raises(SimglError, match=re.escape(complaint)):
        scenario(folder, three)
    (body,) = scenario(folder, three.replace('"shoulder", ', "")).models_at_epoch()
    assert body.angles[0] == 0.0
    assert body.angles[1] != 0.0


def test_a_changed_card_makes_another_scenario(folder: Path) -> None:
    """A sequence that goes on where it stopped must not mix two."""
    one = scenario(folder, SCENE)
    (folder / "arm.toml").write_text(CARD.replace("[1.0, 0.0, 0.0]", "[1.1, 0.0, 0.0]"))
    other = scenario(folder, SCENE)
    assert fingerprint(one, one.inputs, None) != fingerprint(other, other.inputs, None)
    again = scenario(folder, SCENE)
    assert fingerprint(other, other.inputs, None) == fingerprint(again, again.inputs, None)


@pytest.mark.parametrize("minutes", [0, 13, 29, 47])
def test_the_cells_of_two_axis_arrays_face_the_sun_all_along_an_orbit(minutes: int) -> None:
    """To the rounding of their normals in float32, 1e-7 in each component."""
    servicing = load_scenario(Path(__file__).parents[2] / "examples" / "servicer.toml")
    state = servicing.at(servicing.epoch_tai_ns + minutes * 60 * 10**9)
    body = state.bodies["servicer"]
    model, stored = body.model, servicing.models["servicer"].mesh
    posed = model.posed_mesh.baked()
    cells = [m.name for m in model.materials].index("solar_cell")
    for wing in ("wing_left", "wing_right"):
        on_wing = (stored.part == model.parts.index(wing)) & (stored.material == cells)
        normals = posed.normals[on_wing & (stored.normals[:, 2] < -0.999)].astype(np.float64)
        assert len(normals) > 100
        sun = body.pose.R_icrf_from_body.T @ state.sun.seen_from(body.pose.position).direction_icrf
        assert np.abs(np.cross(normals, sun)).max() < 3e-7
        assert np.all(normals @ sun > 0.0)
