"""A recording read by two readers of others: what was drawn, where it was, and when."""

from __future__ import annotations

import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from simgl import cli
from simgl.commands import application
from simgl.physics.frames import matrix_from_quaternion
from simgl.ros2.mcap_recording import Recording, record
from simgl.ros2.ros_messages import ros_time_ns
from simgl.scenario.loader import load_scenario, scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.simulator import Product, Simulator

SECOND = 1_000_000_000
SCENE = {
    "epoch": {"utc": "2026-03-20T12:00:00"},
    "sun": {"direction_icrf": [0.0, 0.0, 1.0]},
    "earth": {"shape": "none"},
    "spacecraft": {
        "block": {
            "position_icrf_m": [7.0e6, 0.0, 0.0],
            "velocity_icrf_m_s": [0.5, 0.0, 0.0],
            "model": {"box": {"size_m": [2.0, 2.0, 2.0], "material": {"reflectance": 0.5}}},
        }
    },
    "camera": {
        name: {
            "position_icrf_m": [7.0e6, 0.0, 20.0],
            "look_at": "block",
            "up": [0.0, 1.0, 0.0],
            "width_px": 48,
            "height_px": 32,
            "focal_length_mm": 0.6,
        }
        for name in ("nav", "aft")
    },
    "render": {"samples_per_pixel": 5, "inter_reflection": False},
}


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return scenario_from_dict(SCENE)


@pytest.fixture(scope="module")
def epochs(scenario: Scenario) -> list[int]:
    return [scenario.epoch_tai_ns, scenario.epoch_tai_ns + 2 * SECOND]


@pytest.fixture(scope="module")
def file(
    module_gl: moderngl.Context,
    scenario: Scenario,
    epochs: list[int],
    tmp_path_factory: pytest.TempPathFactory,
) -> Path:
    path = tmp_path_factory.mktemp("recording") / "run.mcap"
    plan = Recording(scenario=scenario, cameras=("nav", "aft"), epochs=epochs, depth=True)
    with Simulator(scenario, module_gl) as simulator:
        assert record(plan, simulator, path) == 2 * (2 + 2 * 3)
    return path


def test_the_librarys_reader_gives_the_images_back(
    gl: moderngl.Context, file: Path, scenario: Scenario, epochs: list[int]
) -> None:
    """DN bit for bit, depth of the block's near face, the block where it moves to."""
    with file.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        messages: dict[str, list[Any]] = {}
        for _, channel, message, decoded in reader.iter_decoded_messages():
            messages.setdefault(channel.topic, []).append(decoded)
            assert message.log_time == ros_time_ns(epochs[message.sequence])
    with Simulator(scenario, gl) as simulator:
        state = scenario.at(epochs[1])
        during = scenario.around(epochs[1])
        products = {Product.DN, Product.TRUTH}
        capture = simulator.capture(state, "nav", products, during=during)
    assert capture.digital is not None
    assert capture.truth is not None
    pixels = messages["/nav/image_raw"][1]
    assert (pixels.encoding, pixels.step, pixels.is_bigendian) == ("mono16", 96, 0)
    dn = np.frombuffer(bytes(pixels.data), "<u2").reshape(32, 48)
    np.testing.assert_array_equal(dn, capture.digital.dn)
    depth = messages["/nav/depth/image_raw"][1]
    assert depth.encoding == "32FC1"
    metres = np.frombuffer(bytes(depth.data), "<f4").reshape(32, 48)
    # A near face 19 m ahead, 1 m to the side after 2 s: some 7 mm of obliquity.
    assert metres[16, 24] == pytest.approx(19.0, abs=0.1)
    np.testing.assert_array_equal(np.isnan(metres), capture.truth.depth == 0.0)
    block, nav, _ = messages["/tf"][1].transforms
    assert (block.header.frame_id, block.child_frame_id) == ("gcrf", "block")
    assert block.transform.translation.x == 7.0e6 + 1.0
    assert nav.child_frame_id == "nav_optical_frame" == pixels.header.frame_id
    q = nav.transform.rotation
    R = matrix_from_quaternion([q.x, q.y, q.z, q.w])
    np.testing.assert_allclose(R, capture.info.R_camera_from_icrf.T, atol=1e-12)
    # The optical axis points at the block.
    towards = np.array([1.0, 0.0, -20.0])
    np.testing.assert_allclose(R[:, 2], towards / np.linalg.norm(towards), atol=1e-9)
    stamp = messages["/clock"][1].clock
    assert stamp.sec * SECOND + stamp.nanosec == ros_time_ns(epochs[1])
    assert (pixels.header.stamp.sec, pixels.header.stamp.nanosec) == (stamp.sec, stamp.nanosec)


def test_a_thermal_camera_has_the_temperatures_of_the_trajectory(
    gl: moderngl.Context, tmp_path: Path
) -> None:
    craft = {"box": {"size_m": [1.0, 1.0, 1.0], "material": "white_paint"}}
    about = {"target": "craft", "azimuth_deg": 20.0, "range_m": 9.0}
    camera = {"about": about, "width_px": 32, "height_px": 24, "focal_length_mm": 3.0}
    scenario = scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "earth": {"shape": "none"},
            "spacecraft": {"craft": {"model": craft, "orbit": {"altitude_km": 400.0}}},
            "camera": {"ir": camera | {"thermal": {"detector": "bolometer_lwir"}}},
            "thermal": {"patches": 60, "step_s": 300.0},
        }
    )
    # A third of an orbit later the Sun shines from elsewhere, and the skin has not followed yet.
    later = scenario.epoch_tai_ns + 1800 * SECOND
    path = tmp_path / "thermal.mcap"
    plan = Recording(scenario=scenario, cameras=("ir",), epochs=[later], depth=False)
    with Simulator(scenario, gl) as simulator:
        record(plan, simulator, path)
        during = scenario.around(later)
        warm, steady = (
            simulator.capture(scenario.at(later), "ir", during=during, temperatures=t).digital
            for t in (simulator.temperatures.at(later), None)
        )
    assert warm is not None
    assert steady is not None
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        (image,) = (one for *_, one in reader.iter_decoded_messages(topics=["/ir/image_raw"]))
    dn = np.frombuffer(bytes(image.data), "<u2").reshape(24, 32)
    np.testing.assert_array_equal(dn, warm.dn)
    assert np.abs(dn.astype(int) - steady.dn).max() > 70


def test_rosbags_reads_the_same(file: Path, epochs: list[int]) -> None:
    """By the types that rosbags itself has of ROS 2, not by those in the file."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    with AnyReader([file]) as reader:
        seen: dict[str, int] = {}
        for connection, timestamp, raw in reader.messages():
            message: Any = store.deserialize_cdr(bytes(raw), connection.msgtype)
            index = seen.get(connection.topic, 0)
            seen[connection.topic] = index + 1
            assert timestamp == ros_time_ns(epochs[index])
            if connection.topic == "/nav/image_raw":
                assert message.data.size == 48 * 32 * 2
            if connection.topic == "/aft/camera_info":
                assert message.distortion_model == "plumb_bob"
                assert message.k[2] == 23.5
    per_camera = [f"/{c}/{t}" for c in ("nav", "aft") for t in
                  ("camera_info", "image_raw", "depth/image_raw")]  # fmt: skip
    assert seen == dict.fromkeys(["/clock", "/tf", *per_camera], 2)


def test_the_command_writes_the_file(
    gl: moderngl.Context,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    from tests.cli.small_scene import SCENE as TEXT

    scene, out = tmp_path / "scene.toml", tmp_path / "new" / "run.mcap"
    scene.write_text(TEXT)
    monkeypatch.setattr("simgl.simulator.Simulator", partial(Simulator, ctx=gl))
    monkeypatch.setattr(application, "entry_points", lambda group: ())  # noqa: ARG005
    words = ["simgl", "record", str(scene), "--mcap", str(out), "--duration", "1", "--step", "1"]
    monkeypatch.setattr(sys, "argv", words)
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert not ended.value.code
    assert capsys.readouterr().out == f"8 messages in {out}\n"
    with out.open("rb") as stream:
        metadata = {m.name: m.metadata for m in make_reader(stream).iter_metadata()}
    assert metadata["simgl"]["scenario"] == load_scenario(scene).name


def test_without_the_extra_one_line_says_how_to_get_it(tmp_path: Path) -> None:
    program = (
        "import sys; sys.modules['mcap_ros2'] = None\n"
        "from simgl.errors import ConfigError\n"
        "try: import simgl.ros2.mcap_recording\n"
        "except ConfigError as error: print(error)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    assert done.stdout.strip().endswith('--mcap needs MCAP: pip install "simgl[ros]"')
