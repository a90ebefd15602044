"""A live node against a peer of its own, and its bytes against another implementation of ROS 2."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from simgl.commands.application import app
from simgl.errors import ConfigError
from simgl.ros2 import ros_messages
from simgl.ros2.ros_messages import WORLD, ros_time_ns, tai_ns_from_ros
from simgl.ros2.run_messages import CAMERA_INFO, CLOCK, IMAGE, TF, camera_messages, check_names
from simgl.scenario.loader import load_scenario, scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.simulator import Product, Simulator
from tests.patience import limit, wait_until

pytest.importorskip("cyclonedds", reason="Cyclone DDS is not installed")
from simgl.ros2 import dds_types
from simgl.ros2.dds_node import DdsNode
from simgl.ros2.dds_types import TYPES, sample_of
from simgl.ros2.live_run import LiveRun, open_node

SECOND = 1_000_000_000
SCENARIO = """\
[epoch]
utc = "2026-03-20T12:00:00"
[sun]
direction_icrf = [0.0, 0.0, 1.0]
[earth]
shape = "none"
[spacecraft.block]
position_icrf_m = [7.0e6, 0.0, 0.0]
velocity_icrf_m_s = [0.5, 0.0, 0.0]
model = { box = { size_m = [2.0, 2.0, 2.0], material = { reflectance = 0.5 } } }
[camera.nav]
position_icrf_m = [7.0e6, 0.0, 20.0]
look_at = "block"
up = [0.0, 1.0, 0.0]
width_px = 48
height_px = 32
focal_length_mm = 0.6
[render]
samples_per_pixel = 5
inter_reflection = false
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("live") / "block.toml"
    path.write_text(SCENARIO)
    return path


@pytest.fixture(scope="module")
def scenario(path: Path) -> Scenario:
    return load_scenario(path)


@pytest.fixture(scope="module")
def domain(request: pytest.FixtureRequest) -> int:
    """A domain of this run of the tests, so that two runs on one machine stay apart."""
    del request
    return 10 + threading.get_native_id() % 80


def frames(tai_ns: int, shift_m: float, child: str = "block") -> dict[str, Any]:
    """A message on /tf of the block, moved sideways."""
    where = np.array([7.0e6 + shift_m, 0.0, 0.0])
    return {"transforms": [ros_messages.transform(tai_ns, child, where, np.eye(3))]}


def test_the_bytes_on_the_network_are_those_of_ros(scenario: Scenario) -> None:
    """rosbags writes and reads ROS 2's encoding by itself."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    tai_ns = scenario.epoch_tai_ns + 123
    with Simulator(scenario) as simulator:
        products = {Product.DN, Product.TRUTH}
        capture = simulator.capture(scenario.at(tai_ns), "nav", products)
    messages = [(kind, message) for _, kind, message in camera_messages(capture)]
    messages += [(CLOCK, ros_messages.clock(tai_ns)), (TF, frames(tai_ns, 0.25))]
    assert {kind for kind, _ in messages} == {CLOCK, TF, IMAGE, CAMERA_INFO}
    for kind, message in messages:
        sent = sample_of(TYPES[kind], message).serialize()
        read: Any = store.deserialize_cdr(sent, kind)
        assert bytes(store.serialize_cdr(read, kind)).rstrip(b"\0") == sent.rstrip(b"\0")
        if kind == IMAGE:
            assert read.data.tobytes() == message["data"]
            assert (read.width, read.height, read.encoding) == (48, 32, message["encoding"])
        if kind == CAMERA_INFO:
            assert read.k.tolist() == message["k"]
            assert read.distortion_model == "plumb_bob"
        if kind == TF:
            assert read.transforms[0].transform.translation.x == 7.0e6 + 0.25
            assert read.transforms[0].child_frame_id == "block"


@contextmanager
def node_process(path: Path, domain: int, *options: str) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "simgl", "ros2", str(path), "--domain", str(domain), *options]
    command.append("--all-interfaces")
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.terminate()
        process.communicate(timeout=limit(30.0))


class Peer:
    """A simulation of another process: it publishes /tf and listens to images."""

    def __init__(self, domain: int, topics: Sequence[str] = ("/nav/image_raw",)) -> None:
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic

        self.node = DdsNode({"/tf": TF}, domain)
        participant = self.node._participant
        self._readers = {
            t: DataReader(participant, Topic(participant, f"rt{t}", dds_types.Image))
            for t in topics
        }

    def is_connected(self) -> bool:
        """Whether another node than this one reads /tf, and one writes the images."""
        readers = self.node._writers["/tf"].get_matched_subscriptions()
        return len(readers) > 1 and all(
            reader.get_matched_publications() for reader in self._readers.values()
        )

    def next_image(self, topic: str = "/nav/image_raw") -> Any:
        arrived: list[Any] = []

        def has_arrived() -> bool:
            arrived.extend(self._readers[topic].take(N=1))
            return bool(arrived)

        wait_until(has_arrived, "an image")
        return arrived[0]


def test_each_message_on_tf_gets_its_image_in_lock_step(
    gl: moderngl.Context, path: Path, scenario: Scenario, domain: int
) -> None:
    del gl
    with node_process(path, domain) as process:
        peer = Peer(domain)
        wait_until(lambda: peer.is_connected() or process.poll() is not None, "the node")
        assert process.poll() is None, process.communicate()
        # The node matches a moment after the peer does.
        time.sleep(limit(0.5))
        with Simulator(scenario) as simulator:
            for step, shift_m in enumerate((0.0, 1.5, -1.0)):
                tai_ns = scenario.epoch_tai_ns + step * SECOND
                peer.node.publish(("/tf", TF, frames(tai_ns, shift_m)))
                image = peer.next_image()
                stamp = image.header.stamp
                assert stamp.sec * SECOND + stamp.nanosec == ros_time_ns(tai_ns)
                known = scenario.poses(tai_ns)["block"]
                moved = type(known)(
                    position=np.array([7.0e6 + shift_m, 0.0, 0.0]),
                    velocity=known.velocity,
                    R_icrf_from_body=np.eye(3),
                )
                state = scenario.with_poses(tai_ns, {"block": moved})
                capture = simulator.capture(state, "nav", {Product.DN})
                assert capture.digital is not None
                expected = capture.digital.dn.astype("<u2").tobytes()
                assert bytes(image.data) == expected


def test_a_run_plays_at_the_pace_of_the_clock(path: Path, domain: int) -> None:
    start = time.monotonic()
    with node_process(path, domain, "--play", "--duration", "1", "--step", "0.5") as process:
        out, problem = process.communicate(timeout=limit(60.0))
    assert process.returncode == 0, problem
    assert "3 epochs played" in out
    assert time.monotonic() - start > 1.0


def test_ports_on_all_networks_are_never_opened_unasked(path: Path) -> None:
    with pytest.raises(ConfigError, match="--all-interfaces is needed"):
        app(["ros2", str(path)], standalone_mode=False)


class StubNode:
    """Nobody listens."""

    def is_heard(self, topic: str) -> bool:
        del topic
        return False

    def publish(self, message: Any) -> None:
        assert message[0] in ("/clock", "/tf")


def test_nothing_is_drawn_for_nobody(scenario: Scenario) -> None:
    class NoSimulator:
        def capture(self, *_: Any, **__: Any) -> None:
            raise AssertionError("drawn")

    run = LiveRun(
        scenario=scenario,
        simulator=NoSimulator(),  # type: ignore[arg-type]
        node=StubNode(),  # type: ignore[arg-type]
        cameras=("nav",),
    )
    assert run.play([scenario.epoch_tai_ns], threading.Event()) == 0


def test_messages_that_are_no_state_have_no_image(scenario: Scenario) -> None:
    run = LiveRun(scenario=scenario, simulator=None, node=StubNode(), cameras=("nav",))  # type: ignore[arg-type]
    tai_ns = scenario.epoch_tai_ns

    def state(message: dict[str, Any]) -> Any:
        return run._state(sample_of(TYPES[TF], message))

    assert state(frames(tai_ns, 0.0, child="somebody_else")) is None
    elsewhere = frames(tai_ns, 0.0)
    elsewhere["transforms"][0]["header"]["frame_id"] = "map"
    assert state(elsewhere) is None
    with pytest.raises(ValueError, match="is not a pose"):
        state(frames(tai_ns, float("nan")))
    two = {"transforms": [*frames(tai_ns, 0.0)["transforms"], *frames(tai_ns, 0.0)["transforms"]]}
    assert state(two).tai_ns == tai_ns
    two["transforms"][1] = frames(tai_ns + SECOND, 0.0)["transforms"][0]
    with pytest.raises(ValueError, match="different stamps"):
        state(two)


def test_times_come_back() -> None:
    for tai_ns in (1_774_008_037_000_000_001, 1_483_228_835_500_000_000):
        assert tai_ns_from_ros(ros_time_ns(tai_ns)) == tai_ns


def test_a_name_that_ros_does_not_have_is_one_line() -> None:
    box = {"box": {"size_m": [1.0, 1.0, 1.0], "material": {"reflectance": 0.5}}}
    wrong = scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "spacecraft": {"a-b": {"model": box, "position_icrf_m": [7e6, 0.0, 0.0]}},
        }
    )
    with pytest.raises(ConfigError, match=r"\[spacecraft.a-b\].*is not a name in ROS"):
        check_names(wrong, (), wrong.epoch_tai_ns)
    with pytest.raises(ConfigError, match="is not a name in ROS"):
        open_node(wrong, (), 0, depth=False)
    assert WORLD == "gcrf"
