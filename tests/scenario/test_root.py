"""A scenario with a root: no file that it names may lie outside, whichever way the name leads."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from simgl import SimglError, load_scenario

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
SCENE = """
[epoch]
utc = "2026-03-20T12:00:00"
{extra}
[spacecraft.craft]
{craft}
[camera.nav]
{camera}
position_icrf_m = [0.0, 0.0, 8.0e6]
boresight = [0.0, 0.0, -1.0]
up = [0.0, 1.0, 0.0]
width_px = 16
height_px = 16
"""
CUBE = 'model = { box = { size_m = [1.0, 1.0, 1.0], material = "white_paint" } }'
PLACE = "position_icrf_m = [0.0, 0.0, 7.0e6]"

# Every key that names a file: what the scene says, and the key that an error names.
REFERENCES = {
    "model": ({"craft": f'model = "@.obj"\n{PLACE}'}, "model"),
    "trajectory": ({"craft": f'{CUBE}\ntrajectory = "@.csv"'}, "trajectory"),
    "attitude": ({"craft": f'{CUBE}\n{PLACE}\nattitude_file = "@.csv"'}, "attitude_file"),
    "preset": ({"camera": 'preset = "@.toml"'}, "preset"),
    "calibration": ({"camera": 'calibration = "@.yaml"'}, "calibration"),
    "calibrations": ({"camera": 'calibration = { file = "@.yaml" }'}, "calibration"),
    "psf": ({"camera": 'optics = { psf_image = "@.npy" }'}, "optics.psf_image"),
    "land": ({"extra": '[earth]\nland_picture = "@.png"'}, "land_picture"),
    "clouds": ({"extra": '[earth.clouds]\npicture = "@.png"'}, "picture"),
}


def scene(folder: Path, changes: dict[str, str], name: str) -> Path:
    """A scenario whose reference leads to a name."""
    fields = {"craft": f"{CUBE}\n{PLACE}", "camera": "", "extra": ""} | changes
    path = folder / "scene.toml"
    path.write_text(SCENE.format(**fields).replace("@", name))
    return path


@pytest.fixture
def folders(tmp_path: Path) -> tuple[Path, Path]:
    """The root, and a folder beside it with files that are all right in themselves."""
    root, outside = tmp_path / "root", tmp_path / "outside"
    root.mkdir()
    outside.mkdir()
    (outside / "file.obj").write_text(TRIANGLE)
    (outside / "file.yaml").write_text("camera_matrix: [9, 0, 8, 0, 9, 8, 0, 0, 1]\n")
    np.save(outside / "file.npy", np.ones((3, 3)))
    Image.fromarray(np.zeros((2, 4, 3), dtype=np.uint8)).save(outside / "file.png")
    (outside / "file.toml").write_text("width_px = 16\n")
    (outside / "file.csv").write_text("time_s\n0\n")
    return root, outside


@pytest.mark.parametrize("reference", REFERENCES)
@pytest.mark.parametrize("way", ["up", "absolute", "link", "linked folder"])
def test_a_file_outside_is_one_line_that_names_key_and_root(
    folders: tuple[Path, Path], reference: str, way: str
) -> None:
    root, outside = folders
    changes, key = REFERENCES[reference]
    name = {"up": "../outside/file", "absolute": str(outside / "file"), "link": "file",
            "linked folder": "inner/file"}[way]  # fmt: skip
    if way == "link":
        for file in outside.iterdir():
            (root / file.name).symlink_to(file)
    elif way == "linked folder":
        (root / "inner").symlink_to(outside)
    path = scene(root, changes, name)
    with pytest.raises(SimglError) as caught:
        load_scenario(path, root=root)
    text = str(caught.value)
    assert f"leads out of {root}, the folder that a scenario's files must lie in" in text
    assert key in text
    assert str(path) in text
    assert "\n" not in text


def test_without_a_root_files_may_lie_anywhere(folders: tuple[Path, Path]) -> None:
    root, _ = folders
    path = scene(root, REFERENCES["model"][0], "../outside/file")
    assert load_scenario(path).models["craft"].parts == ("file",)


def test_files_within_the_root_and_shipped_ones_are_all_right(folders: tuple[Path, Path]) -> None:
    root, _ = folders
    inner = root / "inner"
    inner.mkdir()
    (inner / "file.obj").write_text(TRIANGLE)
    (root / "link").symlink_to(inner)
    below = root / "scenes"
    below.mkdir()
    for name in ("../inner/file", "../link/file", str(inner / "file")):
        path = scene(below, REFERENCES["model"][0], name)
        assert load_scenario(path, root=root).models["craft"].parts == ("file",)
    shipped = {"craft": f'model = "wedge"\n{PLACE}', "camera": 'preset = "imx264_colour"'}
    assert load_scenario(scene(root, shipped, ""), root=root).cameras["nav"]


def test_a_model_within_the_root_may_not_name_a_buffer_outside(folders: tuple[Path, Path]) -> None:
    root, outside = folders
    (outside / "file.bin").write_bytes(bytes(36))
    gltf = {"asset": {"version": "2.0"}, "buffers": [{"uri": "file.bin", "byteLength": 36}]}
    for uri in ("../outside/file.bin", "file.bin", "..%2Foutside%2Ffile.bin"):
        gltf["buffers"] = [{"uri": uri, "byteLength": 36}]
        (root / "craft.gltf").write_text(json.dumps(gltf))
        if uri == "file.bin":
            (root / "file.bin").symlink_to(outside / "file.bin")
        path = scene(root, {"craft": f'model = "craft.gltf"\n{PLACE}'}, "")
        with pytest.raises(SimglError, match="leads out of") as caught:
            load_scenario(path, root=root)
        assert f'buffer "{uri}"' in str(caught.value)


def test_a_preset_within_the_root_may_not_name_a_curve_outside(
    folders: tuple[Path, Path],
) -> None:
    root, outside = folders
    shipped = Path(__file__).parents[2] / "simgl" / "data" / "cameras" / "ideal.toml"
    head = shipped.read_text().split("[qe]")[0]
    (root / "mine.toml").write_text(f'{head}\n[qe]\ncsv = "../outside/curve.csv"\n')
    (outside / "curve.csv").write_text("400,0.5\n1000,0.5\n")
    path = scene(root, {"camera": 'preset = "mine.toml"'}, "")
    assert load_scenario(path).cameras["nav"]
    with pytest.raises(SimglError, match=r"qe\.csv: .* leads out of"):
        load_scenario(path, root=root)
