"""A scenario that depends on one file of each kind, and an edit of each of them."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image

from simgl.camera.presets import preset_path
from tests.model_files.gltf import square
from tests.motion.motion_files import AEM, oem

SCENE = """\
[epoch]
utc = "2026-03-20T12:00:00"
[earth]
land_picture = "land.png"
water_picture = "water.png"
night_picture = "night.png"
clouds = { picture = "clouds.png" }
[spacecraft.ship]
model = "ship.toml"
trajectory = "ship.oem"
attitude_file = "ship.aem"
[spacecraft.rock]
model = "rock.obj"
relative_to = "ship"
trajectory = { file = "rock.csv", longest_gap_s = 100.0 }
[camera.nav]
preset = "mine.toml"
position_icrf_m = [7.0e6, 0, 0]
boresight = [-1, 0, 0]
optics.psf_image = "psf.npy"
calibration = "lens.yaml"
"""
CALIBRATION = """\
%YAML:1.0
---
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 3500., 0., 640.5, 0., 3500., 480.5, 0., 0., 1. ]
"""
CARD = """\
name = "ship"
file = "ship.gltf"
unit_m = 1.0
axes = { x = "+x", y = "+y", z = "+z" }
keypoints = { nose = [1.0, 0.0, 0.0] }
"""


def write_scene(folder: Path) -> Path:
    """The scenario with all its files; returns its path."""
    head, _, _ = preset_path("mt9m034").read_text().partition("[qe]")
    (folder / "mine.toml").write_text(f'{head}[qe]\ncsv = "qe.csv"\n')
    (folder / "lens.yaml").write_text(CALIBRATION)
    (folder / "qe.csv").write_text("400, 0.5\n1000, 0.2\n")
    np.save(folder / "psf.npy", np.array([[1.0, 2.0, 1.0]]))
    for name in ("land", "water", "night", "clouds"):
        _write_image(folder / f"{name}.png", size=(16, 8), value=100)
    (folder / "ship.oem").write_text(oem())
    (folder / "ship.aem").write_text(AEM)
    rows = "".join(f"{t},{t - 200},3,4\n" for t in range(9))
    (folder / "rock.csv").write_text(f"time_s,x_lvlh_m,y_lvlh_m,z_lvlh_m\n{rows}")
    (folder / "rock.obj").write_text(trimesh.creation.box().export(file_type="obj"))
    (folder / "ship.toml").write_text(CARD)
    _write_image(folder / "skin.png", size=(2, 2), value=100)
    document = square()
    document.json["images"].append({"uri": "skin.png"})
    document.json["textures"].append({"source": 0})
    base = {"baseColorTexture": {"index": 0}}
    document.json["materials"].append({"name": "skin", "pbrMetallicRoughness": base})
    document.write_gltf_and_bin(folder / "ship.gltf", "ship.bin", "ship.bin")
    path = folder / "scene.toml"
    path.write_text(SCENE)
    return path


def _write_image(path: Path, size: tuple[int, int], value: int) -> None:
    # Not compressed: another value gives a file of the same length.
    Image.new("L", size, value).save(path, compress_level=0)


def _replaced(old: bytes, new: bytes) -> Callable[[Path], None]:
    def edit(path: Path) -> None:
        content = path.read_bytes()
        assert content.count(old) >= 1
        assert len(old) == len(new)
        path.write_bytes(content.replace(old, new))

    return edit


def _painted(size: tuple[int, int]) -> Callable[[Path], None]:
    return lambda path: _write_image(path, size, value=101)


# Each keeps the length of its file.
EDITS: dict[str, Callable[[Path], object]] = {
    "scene.toml": _replaced(b"7.0e6", b"7.1e6"),
    "mine.toml": _replaced(b"bits = 12", b"bits = 10"),
    "lens.yaml": _replaced(b"640.5", b"640.6"),
    "qe.csv": _replaced(b"0.5", b"0.6"),
    "psf.npy": lambda path: np.save(path, np.array([[1.0, 3.0, 1.0]])),
    "land.png": _painted((16, 8)),
    "water.png": _painted((16, 8)),
    "night.png": _painted((16, 8)),
    "clouds.png": _painted((16, 8)),
    "ship.oem": lambda path: path.write_text(_moved(path.read_text())),
    "ship.aem": _replaced(b"0.0 0.0 0.5 0.8", b"0.0 0.5 0.0 0.8"),
    "rock.csv": _replaced(b"-200,3,4", b"-200,3,5"),
    "rock.obj": _replaced(b"v 0.5", b"v 0.6"),
    "ship.toml": _replaced(b"nose = [1.0", b"nose = [1.1"),
    "ship.gltf": _replaced(b'"skin"', b'"hull"'),
    "ship.bin": _replaced(np.float32(1.0).tobytes(), np.float32(1.5).tobytes()),
    "skin.png": _painted((2, 2)),
}


def edit(path: Path) -> None:
    """Edit a file of the scenario without a change of its length or of its date."""
    before = path.stat()
    EDITS[path.name](path)
    assert path.stat().st_size == before.st_size
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))


def _moved(text: str) -> str:
    """The last digit of the last position along x of an OEM."""
    head, _, last = text.rstrip().rpartition("\n")
    words = last.split(" ")
    words[1] = words[1][:-1] + str((int(words[1][-1]) + 1) % 10)
    return f"{head}\n{' '.join(words)}\n"
