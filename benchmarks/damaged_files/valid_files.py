"""One valid file of every kind that simgl reads, and how it is read."""

from __future__ import annotations

import io
import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image
from simgl_bridge.access import make_keys
from simgl_bridge.basilisk.recording_replay import recorded

from benchmarks.damaged_files.valid_motion_files import MOTION_FILES, MOTION_READERS
from simgl import assets, load_model, load_scenario
from simgl.arrays import AnyArray
from simgl.campaign.campaign_file import load_campaign
from simgl.disk_cache import read_arrays
from simgl.errors import AssetError
from simgl.motion.files.motion_reader import read_angles, read_attitude, read_path
from simgl.physics.ephemeris import tai_ns_from_utc
from simgl.scenario.scenario import Scenario
from simgl.scene.star_catalogue import shipped_stars
from tests.motion.motion_files import AEM, TABLE, TLE

EPOCH = "2026-03-20T12:00:00"
SCENE = f"""\
[epoch]
utc = "{EPOCH}"
[sun]
irradiance_w_m2 = 1361.0
[earth]
land_picture = "land.png"
water_picture = "water.png"
night_picture = "night.png"
[earth.clouds]
picture = "clouds.png"
[spacecraft.target]
model = "card.toml"
orbit = {{ altitude_km = 400.0, inclination_deg = 51.6 }}
joint_file = "joints.csv"
[spacecraft.chaser]
model.box = {{ size_m = [0.3, 0.3, 0.3], material = {{ reflectance = 0.5, roughness = 0.4 }} }}
relative_to = "target"
position_lvlh_m = [-8.0, 0.0, 0.0]
point_at = {{ target = "target", axis_body = [1.0, 0.0, 0.0] }}
[lamp.spot]
on = "chaser"
position_body_m = [0.2, 0.0, 0.0]
boresight = [1.0, 0.0, 0.0]
half_angle_deg = 20.0
power_w = 5.0
temperature_k = 3000.0
[camera.nav]
preset = "camera.toml"
on = "chaser"
position_body_m = [0.3, 0.0, 0.0]
look_at = "target"
up = [0.0, 0.0, -1.0]
exposure_time_s = 0.0001
calibration = {{ file = "lens.yaml", camera = "cam1" }}
[camera.nav.optics]
psf_image = "psf.png"
psf_samples_per_px = 2
[render]
seed = 3
inter_reflection = false
"""
CAMPAIGN = """\
scenario = "scene.toml"
frames = 12
seed = 5
write = ["dn16"]
[draw]
epoch_offset_s = { uniform = [0.0, 900.0] }
range_m = { log_uniform = [3.0, 12.0] }
direction = "sphere"
roll_deg = { normal = [0.0, 30.0] }
exposure_time_s = { choice = [1e-5, 1e-4] }
joints_deg = { hinge = { uniform = [0.0, 30.0] } }
"""
PRESET = """\
source = "made for this test"
width_px = 48
height_px = 32
pixel_pitch_um = 5.0
full_well_e = 20000
read_noise_e = 4.0
bits = 12
pedestal_dn = 64
gain_e_per_dn = 6.0
dark_current_e_s = 100.0
prnu = 0.01
[qe]
csv = "qe.csv"
[window]
wavelength_nm = [400, 700, 1000]
value = [0.9, 1.0, 0.8]
"""
CALIBRATION = """\
cam0:
  camera_model: pinhole
  distortion_coeffs: [-0.2, 0.05, 0.001, -0.0005]
  distortion_model: radtan
  intrinsics: [58.5, 58.25, 23.75, 15.5]
  resolution: [48, 32]
cam1:
  camera_model: pinhole
  distortion_coeffs: []
  distortion_model: none
  intrinsics: [2600.5, 2600.5, 23.75, 15.5]
  resolution: [48, 32]
"""
CARD = """\
name = "target"
file = "part.glb"
unit_m = 1.0
axes = { x = "+x", y = "+y", z = "+z" }
keypoints = { tip = [1.0, 0.0, 0.0] }
[[joint]]
name = "hinge"
part = "panel"
kind = "revolute"
axis_body = [0.0, 0.0, 1.0]
origin_body_m = [0.0, 1.0, 0.0]
range_deg = [-90.0, 90.0]
"""
OEM = """\
CCSDS_OEM_VERS = 2.0
CREATION_DATE = 2026-01-01T00:00:00
ORIGINATOR = TEST
META_START
OBJECT_NAME = TARGET
OBJECT_ID = 2026-001A
CENTER_NAME = EARTH
REF_FRAME = EME2000
TIME_SYSTEM = UTC
START_TIME = 2026-03-20T12:00:00
STOP_TIME = 2026-03-20T12:03:00
META_STOP
2026-03-20T12:00:00 7000.000 0.000 0.000 0.0 7.546 0.0
2026-03-20T12:01:00 6985.364 452.454 0.000 -0.488 7.530 0.0
2026-03-20T12:02:00 6941.516 903.016 0.000 -0.973 7.483 0.0
2026-03-20T12:03:00 6868.640 1349.802 0.000 -1.455 7.404 0.0
"""
JOINTS = "time_s,joint_hinge_deg\n-10,0\n0,10\n600,30\n6000,-20\n"
CURVE = "wavelength_nm,qe\n400,0.4\n550,0.7\n700,0.5\n1000,0.05\n"

Reader = Callable[[Path], object]
_TAI_NS = tai_ns_from_utc(EPOCH)


def _scene(folder: Path) -> Scenario:
    return load_scenario(folder / "scene.toml")


def _model(name: str) -> Reader:
    return lambda folder: load_model(name, folder)


def _cache(folder: Path) -> object:
    return read_arrays(folder / "cache.npz")


def _stars(folder: Path) -> object:
    return shipped_stars(6.0, folder / "stars.npz")


def _access(folder: Path) -> object:
    from simgl_bridge.access import Access

    return Access(secret=folder / "server.key_secret", allowed=folder)


def _in_memory_root(folder: Path) -> Scenario:
    """The scenario as a server reads it: nothing may lie outside its folder."""
    return load_scenario(folder / "scene.toml", root=folder)


# File to how it is read, of a folder that holds all of them.
READERS: dict[str, Reader] = {
    "scene.toml": _scene,
    "camera.toml": _in_memory_root,
    "lens.yaml": _in_memory_root,
    "qe.csv": _in_memory_root,
    "psf.png": _scene,
    "land.png": _scene,
    "water.png": _scene,
    "night.png": _scene,
    "clouds.png": _in_memory_root,
    "card.toml": _scene,
    "part.glb": _scene,
    "joints.csv": _scene,
    "campaign.toml": lambda folder: load_campaign(folder / "campaign.toml").scenario,
    "part.gltf": _model("part.gltf"),
    "part.bin": _model("part.gltf"),
    "skin.png": _model("part.gltf"),
    "part.obj": _model("part.obj"),
    "part.stl": _model("part.stl"),
    "text.stl": _model("text.stl"),
    "orbit.oem": lambda folder: read_path(folder / "orbit.oem", _TAI_NS, allowed_error=1e9),
    "attitude.aem": lambda folder: read_attitude(folder / "attitude.aem", _TAI_NS),
    "iss.tle": lambda folder: read_path(folder / "iss.tle", _TAI_NS),
    "path.csv": lambda folder: read_path(folder / "path.csv", _TAI_NS, allowed_error=1e9),
    "angles.csv": lambda folder: read_angles(folder / "angles.csv", _TAI_NS),
    "cache.npz": _cache,
    "stars.npz": _stars,
    "server.key_secret": _access,
    "client.key": _access,
    "run.bin": lambda folder: list(recorded(folder / "run.bin")),
    **MOTION_READERS,
}


def png(pixels: AnyArray) -> bytes:
    """A PNG file of bytes."""
    file = io.BytesIO()
    Image.fromarray(pixels.astype(np.uint8)).save(file, "PNG")
    return file.getvalue()


def gltf(buffer_uri: str | None, image_uri: str | None) -> tuple[dict[str, Any], bytes]:
    """A glTF document of two parts with an image, and its buffer; None embeds the one or other."""
    box = trimesh.creation.box((2.0, 2.0, 2.0))
    corners = box.vertices[box.faces.ravel()]
    normals = np.repeat(box.face_normals, 3, axis=0)
    uv = np.random.default_rng(1).uniform(0.0, 1.0, (len(corners), 2))
    index = np.arange(len(corners))
    image = skin()
    data, views = b"", []
    arrays = [
        corners.astype("<f4").tobytes(),
        normals.astype("<f4").tobytes(),
        uv.astype("<f4").tobytes(),
        index.astype("<u2").tobytes(),
        image,
    ]
    for block in arrays:
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(block)})
        data += block + b"\0" * (-len(block) % 4)
    count = len(corners)
    kinds = ((5126, "VEC3"), (5126, "VEC3"), (5126, "VEC2"), (5123, "SCALAR"))
    attributes = {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}
    primitive = {"attributes": attributes, "indices": 3, "material": 0}
    surface = {
        "baseColorTexture": {"index": 0},
        "metallicFactor": 0.2,
        "roughnessFactor": 0.5,
    }
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"name": "hull", "mesh": 0, "children": [1], "rotation": [0.0, 0.0, 0.0, 1.0]},
            {"name": "panel", "mesh": 0, "translation": [0.0, 2.2, 0.0], "scale": [-1, 0.5, 0.1]},
        ],
        "meshes": [{"primitives": [primitive]}],
        "materials": [
            {
                "name": "foil",
                "pbrMetallicRoughness": surface,
                "normalTexture": {"index": 0, "scale": 0.5},
                "doubleSided": True,
                "extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 0.3}},
                "extras": {"nir_reflectance": 0.6},
            }
        ],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{"wrapS": 33071}],
        "images": [{"bufferView": 4} if image_uri is None else {"uri": image_uri}],
        "accessors": [
            {"bufferView": i, "componentType": c, "type": t, "count": count}
            for i, (c, t) in enumerate(kinds)
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": len(data), **({"uri": buffer_uri} if buffer_uri else {})}],
    }
    return document, data


def skin() -> bytes:
    """The image of the glTF files."""
    return png(np.random.default_rng(2).integers(0, 256, (16, 16, 3)))


def glb(document: dict[str, Any], data: bytes) -> bytes:
    """A binary glTF file."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text
    body += struct.pack("<II", len(data), 0x004E4942) + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def _recording() -> bytes:
    """Two states of Basilisk's recording: frame number and time, each with its length before it."""
    state = b"\x0a\x0b\x08\x01\x11" + struct.pack("<d", 0.0)
    return (bytes([len(state)]) + state) * 2


def write_all(folder: Path) -> None:
    """Write a valid file of every kind."""
    dice = np.random.default_rng(3)
    for name, text in {
        "scene.toml": SCENE,
        "campaign.toml": CAMPAIGN,
        "camera.toml": PRESET,
        "card.toml": CARD,
        "lens.yaml": CALIBRATION,
        "qe.csv": CURVE,
        "orbit.oem": OEM,
        "attitude.aem": AEM,
        "iss.tle": TLE,
        "path.csv": TABLE,
        "joints.csv": JOINTS,
        "angles.csv": JOINTS,
        **MOTION_FILES,
    }.items():
        (folder / name).write_text(text)
    for name in ("land", "water", "night", "clouds"):
        shape = (8, 16, 3) if name == "land" else (8, 16)
        (folder / f"{name}.png").write_bytes(png(dice.integers(0, 256, shape)))
    (folder / "psf.png").write_bytes(png(dice.integers(1, 256, (6, 6))))
    (folder / "part.glb").write_bytes(glb(*gltf(None, None)))
    document, data = gltf("part.bin", "skin.png")
    (folder / "part.gltf").write_text(json.dumps(document))
    (folder / "part.bin").write_bytes(data)
    (folder / "skin.png").write_bytes(skin())
    box = trimesh.creation.box((1.0, 1.0, 1.0))
    (folder / "part.obj").write_text(box.export(file_type="obj"))
    (folder / "part.stl").write_bytes(box.export(file_type="stl"))
    (folder / "text.stl").write_text(box.export(file_type="stl_ascii"))
    with (folder / "cache.npz").open("wb") as file:
        np.savez(file, table=dice.random((5, 4)), index=np.arange(7))
    (folder / "stars.npz").write_bytes((assets.data() / "sky" / "hipparcos.npz").read_bytes())
    make_keys("server", folder)
    make_keys("client", folder)
    (folder / "run.bin").write_bytes(_recording())


def check_valid(folder: Path) -> None:
    """Raise AssertionError unless every file is read as it is."""
    for name, read in READERS.items():
        try:
            assert read(folder) is not None, name
        except AssetError as error:
            raise AssertionError(f"{name}: {error}") from error
