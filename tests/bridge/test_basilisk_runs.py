"""Runs of Basilisk as they come and go: restarts, silence, many steps, many servers, odd states."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

import moderngl
import numpy as np
import pytest
from simgl_bridge.basilisk.camera_overrides import CameraOverrides, load_camera_file
from simgl_bridge.basilisk.endpoint import BasiliskEndpoint
from simgl_bridge.basilisk.viz_messages import read_update
from simgl_bridge.basilisk.viz_scene import scene_of

from benchmarks.bridge.scene import resident_kib
from simgl import Scenario, load_scenario
from tests.bridge import basilisk_wire as wire
from tests.bridge.basilisk_wire import pixels, scene
from tests.bridge.harness import WatchedSimulator, basilisk_source, free_address
from tests.bridge.zmtp import Wire
from tests.patience import limit


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> Scenario:
    path = tmp_path_factory.mktemp("runs") / "base.toml"
    path.write_text(wire.SCENARIO)
    return load_scenario(path)


@pytest.fixture(scope="module")
def sheets(tmp_path_factory: pytest.TempPathFactory) -> dict[int, CameraOverrides]:
    path = tmp_path_factory.mktemp("runs") / "navcam.toml"
    path.write_text(wire.SHEET)
    return dict.fromkeys((1, 0, -3), load_camera_file(path))


@pytest.fixture(scope="module")
def source(
    base: Scenario, sheets: dict[int, CameraOverrides]
) -> Iterator[tuple[BasiliskEndpoint, WatchedSimulator]]:
    with basilisk_source(base, sheets) as running:
        yield running


@pytest.fixture
def peer(source: tuple[BasiliskEndpoint, WatchedSimulator]) -> Iterator[wire.Peer]:
    link = wire.Peer(source[0].address)
    yield link
    link.close()


def test_basilisk_may_start_before_the_server(
    base: Scenario, sheets: dict[int, CameraOverrides]
) -> None:
    address = free_address()
    early = wire.Peer(address)
    # What Reset sends while nobody listens.
    early.socket.send(b"PING")
    assert not early.socket.poll(300)
    with basilisk_source(base, sheets, address):
        assert early.socket.poll(round(limit(20_000)))
        assert early.socket.recv() == b"PONG"
        assert early.update(scene()) == [b"OK"]
        assert pixels(early.image()).max() > 100
    early.close()


def test_hours_of_silence_are_no_end(peer: wire.Peer, monkeypatch: pytest.MonkeyPatch) -> None:
    # noDisplay is silent while its camera is off; the state sent before still counts.
    peer.update(scene(seconds=3.0))
    honest = time.monotonic
    monkeypatch.setattr(time, "monotonic", lambda: honest() + 36_000.0)
    assert pixels(peer.image()).max() > 100


def test_a_second_reset_in_one_process_is_a_run_like_the_first(peer: wire.Peer) -> None:
    peer.update(scene(seconds=5.0))
    first = peer.image()
    # Reset greets again, and time begins anew.
    assert peer.ask(b"PING") == [b"PONG"]
    assert peer.update(scene(seconds=1.0)) == [b"OK"]
    assert peer.image() != first
    peer.update(scene(seconds=5.0))
    assert peer.image() == first


def test_runs_on_ports_of_their_own_get_the_same_pictures(
    base: Scenario, sheets: dict[int, CameraOverrides]
) -> None:
    with ExitStack() as stack:
        fronts = [stack.enter_context(basilisk_source(base, sheets))[0] for _ in range(3)]
        assert len({front.address for front in fronts}) == 3
        peers = [wire.Peer(front.address) for front in fronts]
        for seconds in (1.0, 2.0):
            # Each run is at another step when it is asked for the other's.
            for link in peers:
                link.update(scene(seconds=seconds))
            assert len({link.image() for link in peers}) == 1
        for link in peers:
            link.close()


@pytest.mark.parametrize("id", [0, -3])
def test_a_camera_may_have_the_number_0_or_a_negative_one(peer: wire.Peer, id: int) -> None:
    peer.update(scene(id=id))
    assert pixels(peer.image(id)).max() > 100
    assert peer.image(1) == b""


def test_without_bodies_there_is_black_space(peer: wire.Peer) -> None:
    peer.update(scene(central=b""))
    assert pixels(peer.image()).max() < 20


def test_without_a_sun_the_earth_is_lit_from_where_the_ephemeris_has_it(peer: wire.Peer) -> None:
    # On 1 June the Sun stands at 4 h 36 min of right ascension and 22 deg north, 1.014 au away.
    towards = np.array([0.33, 0.87, 0.37]) / np.linalg.norm([0.33, 0.87, 0.37])
    place = tuple((9.0e6 * towards).tolist())
    peer.update(scene(sun=(1.014 * wire.AU * towards).tolist(), place=place))
    sent = pixels(peer.image())
    peer.update(scene(sun=None, place=place))
    lit = pixels(peer.image())
    # Within a degree: cosines within 2 %, two of 256 levels for the noise.
    np.testing.assert_allclose(np.median(lit), np.median(sent), rtol=0.02, atol=2.0)
    assert np.median(lit) > 50
    peer.update(scene(sun=None, place=tuple((-9.0e6 * towards).tolist())))
    assert np.median(pixels(peer.image())) < 10


def test_a_camera_that_changes_in_the_middle_of_a_run_is_the_new_one_at_once(
    peer: wire.Peer,
) -> None:
    # The Earth from 18,000 km: 20.7 deg from its centre to its limb.
    far: dict[str, Any] = {"place": (1.8e7, 0.0, 0.0)}
    counts = []
    for fov, resolution in ((60.0, (64, 48)), (90.0, (64, 48)), (60.0, (128, 96))):
        peer.update(scene(seconds=7.0, fov_deg=fov, resolution=resolution, **far))
        picture = pixels(peer.image())
        assert picture.shape == resolution[::-1]
        counts.append(np.count_nonzero(picture > 50))
    # Its area goes with the focal length squared; pixels of the limb are a tenth of it.
    narrow, wide = (np.tan(np.radians(0.5 * f)) for f in (60.0, 90.0))
    assert counts[1] / counts[0] == pytest.approx((narrow / wide) ** 2, rel=0.12)
    assert counts[2] / counts[0] == pytest.approx(4.0, rel=0.12)


def test_ambient_light_that_was_not_asked_for_is_not_refused(
    base: Scenario, sheets: dict[int, CameraOverrides]
) -> None:
    # Basilisk sends -1 for "as the viewer likes".
    for settings in (b"", wire.block(7, wire.double(1, -1.0)), wire.block(7, b"")):
        said: list[str] = []
        scene_of(read_update(scene(more=settings)), 1, base, sheets[1], said.append)
        assert not any("ambient" in line for line in said)


def test_a_run_of_more_than_104_days_goes_on(
    base: Scenario, sheets: dict[int, CameraOverrides], peer: wire.Peer
) -> None:
    # 2^53 ns are 104 days; a year later the double steps by 4 ns.
    seconds = 366.0 * 86_400.0
    state = scene_of(read_update(scene(seconds=seconds)), 1, base, sheets[1], print)
    begin = scene_of(read_update(scene(seconds=0.0)), 1, base, sheets[1], print)
    assert abs(state.tai_ns - begin.tai_ns - 366 * 86_400 * 10**9) <= 4
    peer.update(scene(seconds=seconds))
    assert pixels(peer.image()).max() > 100


def test_a_lost_gpu_is_one_empty_image_and_the_next_is_as_ever(
    base: Scenario, sheets: dict[int, CameraOverrides]
) -> None:
    def lose() -> None:
        raise moderngl.Error("GL_CONTEXT_LOST")

    with basilisk_source(base, sheets) as (front, simulator):
        link = wire.Peer(front.address)
        link.update(scene(seconds=1.0))
        assert link.image()
        simulator.hook = lose
        link.update(scene(seconds=2.0))
        assert link.image() == b""
        # The simulator with the hook is gone, and a new one draws what was not drawn.
        image = link.image()
        link.close()
    with basilisk_source(base, sheets) as (front, _):
        link = wire.Peer(front.address)
        link.update(scene(seconds=2.0))
        assert link.image() == image != b""
        link.close()


def test_two_gigabytes_announced_by_a_peer_cost_it_its_link(
    source: tuple[BasiliskEndpoint, WatchedSimulator], peer: wire.Peer
) -> None:
    for size in (2**31, 2**63 - 1):
        greedy = Wire(source[0].address)
        greedy.announce(size, more=False)
        assert greedy.is_hung_up(), size
        greedy.close()
    peer.update(scene(seconds=9.0))
    assert peer.image()


def test_a_thousand_steps_take_no_memory(peer: wire.Peer) -> None:
    """The long form is ``benchmarks/basilisk/steps.py``."""

    def run(first: int, steps: int) -> None:
        for step in range(first, first + steps):
            assert peer.update(scene(seconds=0.1 * step, frame=step)) == [b"OK"]
            assert peer.ask(b"REQUEST_INPUT")[0] == b"VIZARD_INPUT"
            if step % 20 == 0:
                assert peer.image()

    run(1, 400)
    before = resident_kib(os.getpid())
    run(401, 1000)
    # Both ends are in this process, with an allocator between; a state has a kilobyte.
    assert resident_kib(os.getpid()) - before < 2048
