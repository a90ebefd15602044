"""What a client reads never says where a file lies on the server's disk."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Callable, Iterator
from pathlib import Path

import moderngl
import numpy as np
import pytest
from simgl_bridge.public_text import public_text
from simgl_bridge.render_request import bad_scene

from simgl import Scenario
from simgl.errors import AssetError, ConfigError, ContextError, OutputError, ShaderError
from tests.bridge.harness import RawLink, Running, finish, start
from tests.bridge.test_bad_messages import RENDER

BOX = "model = { box = { size_m = [2.0, 1.0, 1.0], material = { reflectance = 0.5 } } }"
PLACE = "position_icrf_m = [0.0, 0.0, 0.0]"


@pytest.mark.parametrize(
    ("text", "public"),
    [
        ("/srv/my models/x y.glb: is cut short", "x y.glb: is cut short"),
        ("[Errno 2] No such file: '/srv/a dir/b.toml'", "[Errno 2] No such file: 'b.toml'"),
        ("PosixPath('/a/b')", "PosixPath('b')"),
        ("there is no file /srv/maps/x.png", "there is no file x.png"),
        ("file:///etc/passwd is not there", "passwd is not there"),
        ("psf_image: /srv/a/b.npy: is damaged", "psf_image: b.npy: is damaged"),
        ('the link "/srv/a/b" leads out', 'the link "b" leads out'),
        ("open(/dev/dri/renderD128) failed", "open(renderD128) failed"),
        ("path=/etc/x", "path=x"),
        ("two\nlines\tof /a/b", "two lines of b"),
        (r"two\n/a/b/lines", r"two\nlines"),
        # No paths.
        ("at most 7 m/s, W m-2/sr, 1 / 2", "at most 7 m/s, W m-2/sr, 1 / 2"),
        ("tcp://127.0.0.1:5563 and/or target/body", "tcp://127.0.0.1:5563 and/or target/body"),
    ],
)
def test_of_a_path_the_name_is_left(text: str, public: str) -> None:
    assert public_text(text) == public


def test_below_the_root_a_file_is_named_relative_to_it() -> None:
    root = Path("/srv/my scenes")
    text = "/srv/my scenes/models/x.obj leads out of /srv/my scenes, not /srv/my scenes2/y"
    assert public_text(text, [root]) == "models/x.obj leads out of the root, not y"


def test_a_very_long_text_is_cut() -> None:
    assert len(public_text("x" * 1_000_000)) == 4000


@pytest.mark.parametrize(
    ("where", "field"),
    [
        ("/srv/a.toml [camera.nav]", "[camera.nav] up"),
        ("/srv/[old]/a.toml [camera.nav]", "[camera.nav] up"),
        ("/srv/[old]/a.toml", "up"),
        ("../secret/a.toml", "up"),
    ],
)
def test_a_scene_error_names_the_table_and_not_the_file(where: str, field: str) -> None:
    assert bad_scene(ConfigError(where, "up", "is wrong"), 1).field == field


@pytest.mark.parametrize(
    "error",
    [
        AssetError("/srv/secret place/model.glb: cannot be read (Permission denied)"),
        OutputError("/srv/secret place/cache: cannot be written (No space left on device)"),
        ShaderError("/srv/secret place/shaders/x.frag:3: error"),
        ConfigError("/srv/secret place/a.toml", "", "is gone"),
        ConfigError("/srv/secret place/a.toml [camera.nav]", "up", "see /srv/secret place/b.toml"),
        ContextError("cannot load /srv/secret place/libEGL.so", "install it"),
        moderngl.Error("cannot load '/srv/secret place/libEGL.so'"),
        PermissionError(13, "Permission denied", "/srv/secret place/map.npy"),
        OSError(5, "Input/output error", "/srv/secret place/a", None, "/srv/secret place/b"),
        ValueError("cannot reshape\n/srv/secret place/map.npy"),
        KeyError("/srv/secret place/map.npy"),
    ],
    ids=lambda error: type(error).__name__,
)
def test_an_error_while_drawing_names_no_folder(
    raw: RawLink, running: Running, error: Exception
) -> None:
    def fail() -> None:
        raise error

    # A context that was lost is open again.
    assert raw.ask_map({**RENDER, "id": 990_000})["type"] == "images"
    running.simulator.hook = fail
    try:
        reply = raw.ask_map({**RENDER, "id": 990_001})
    finally:
        running.simulator.hook = None
    assert reply["type"] == "error"
    assert "secret" not in str(reply)
    assert "/" not in reply["detail"].replace("Input/output", "")


def gltf(**changes: object) -> bytes:
    document = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], **changes}
    return json.dumps(document).encode()


def damaged_files(folder: Path) -> Iterator[tuple[str, str]]:
    """Scenario names with the text that takes the place of the box; writes their files."""
    files: dict[str, bytes] = {
        "empty.glb": b"",
        "cut.glb": b"glTF" + struct.pack("<II", 2, 5000) + b"\0" * 40,
        "version.glb": b"glTF" + struct.pack("<II", 1, 12),
        "noise.glb": np.random.default_rng(1).bytes(3000),
        "noise.obj": np.random.default_rng(2).bytes(3000),
        "noise.stl": np.random.default_rng(3).bytes(3000),
        "none.obj": b"# nothing\n",
        "text.gltf": b"{",
        "extension.gltf": gltf(extensionsRequired=["KHR_draco_mesh_compression"]),
        "buffer.gltf": gltf(buffers=[{"uri": "gone.bin", "byteLength": 9}], nodes=[{"mesh": 0}],
                            meshes=[{"primitives": [{"attributes": {"POSITION": 0}}]}],
                            accessors=[{"bufferView": 0, "componentType": 5126, "count": 3,
                                        "type": "VEC3"}],
                            bufferViews=[{"buffer": 0, "byteLength": 36}]),
        "card.toml": b"model = 3",
        "broken.toml.txt": b"\xff\xfe",
        "card2.toml": b'mesh = "gone.glb"\n',
    }  # fmt: skip
    models = folder / "secret models"
    models.mkdir()
    for name, content in files.items():
        (models / name).write_bytes(content)
    (models / "folder.glb").mkdir()
    (models / "loop.glb").symlink_to("loop.glb")
    (models / "out.glb").symlink_to("/etc/passwd")
    names = [*files, "folder.glb", "loop.glb", "out.glb", "gone.glb", "gone.toml", "../../up.glb"]
    for index, name in enumerate(names):
        yield f"model{index}", f'model = "secret models/{name}"'
    yield "absolute", 'model = "/etc/passwd"'
    yield "device", 'model = "/dev/null"'
    yield "null", 'model = "a\\u0000b.glb"'
    yield "nothing", 'model = ""'


DAMAGED_TABLES = {
    "preset": ("[camera.nav]", '[camera.nav]\npreset = "secret models/gone.toml"'),
    "preset2": ("[camera.nav]", '[camera.nav]\npreset = "secret models/card.toml"'),
    "preset3": ("[camera.nav]", '[camera.nav]\npreset = "/etc/passwd"'),
    "spread": ("[camera.nav]", '[camera.nav]\noptics = { psf_image = "secret models/gone.npy" }'),
    "spread2": ("[camera.nav]", '[camera.nav]\noptics = { psf_image = "secret models/none.obj" }'),
    "curve": ("[camera.nav]", '[camera.nav]\nqe = { csv = "secret models/gone.csv" }'),
    "curve2": ("[camera.nav]", '[camera.nav]\nqe = { csv = "secret models/noise.obj" }'),
    "orbit": (PLACE, 'trajectory = "secret models/gone.oem"'),
    "orbit2": (PLACE, 'trajectory = "secret models/noise.obj"'),
    "orbit3": (PLACE, 'trajectory = "../up.oem"'),
    "attitude": (PLACE, f'{PLACE}\nattitude_file = "secret models/none.obj"'),
    "joints": (PLACE, f'{PLACE}\njoint_file = "secret models/none.obj"'),
    "map": ('shape = "none"', 'land_picture = "secret models/noise.obj"'),
    "map2": ('shape = "none"', 'land_picture = "secret models/gone.png"'),
    "map3": ('shape = "none"', 'night_picture = "secret models/folder.glb"'),
}


@pytest.fixture(scope="module")
def rooted(
    scenario: Scenario, scenario_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Running, Path]]:
    """A server whose folder holds nothing but damaged scenarios."""
    root = tmp_path_factory.mktemp("very secret") / "inner root"
    root.mkdir()
    text = scenario_path.read_text()
    for name, model in damaged_files(root):
        assert BOX in text
        (root / f"{name}.toml").write_text(text.replace(BOX, model))
    for name, (old, new) in DAMAGED_TABLES.items():
        assert old in text
        (root / f"{name}.toml").write_text(text.replace(old, new, 1))
    (root / "toml.toml").write_text("= [")
    (root / "bytes.toml").write_bytes(b"\xff\xfe\x00")
    (root / "empty.toml").write_text("")
    (root / "folder.toml").mkdir()
    (root / "loop.toml").symlink_to("loop.toml")
    (root / "gone.toml").symlink_to("nowhere.toml")
    running = start(scenario, root=root)
    yield running, root
    finish(running)


def test_a_damaged_scenario_is_explained_without_the_servers_folders(
    rooted: tuple[Running, Path], connect: Callable[[Running], RawLink]
) -> None:
    running, root = rooted
    link = connect(running)
    hello = {"type": "hello", "client": "curious", "versions": ["simgl/1"]}
    names = link.ask_map(hello)["scenarios"]
    assert len(names) > 35
    for id, name in enumerate(names):
        reply = link.ask_map({"type": "configure", "id": id, "scenario": name})
        assert reply.get("code") == "BAD_SCENE", (name, reply)
        check_public(reply, root, name)


def check_public(reply: dict[str, object], root: Path, name: str) -> None:
    text = f"{reply['field']} {reply['detail']}"
    for part in ("very secret", "inner root", str(root), "/etc", "/dev", "site-packages", "/simgl"):
        assert part not in text, (name, text)
    # Nothing absolute at all.
    assert not re.search(r"(^|[\s\"'(=])/[^\s/]", text), (name, text)
    assert "\n" not in text
    assert len(str(reply["detail"])) < 4100
