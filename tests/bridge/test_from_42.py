"""States of the simulator 42: what its messages say, and lock-step with it.

``recorded_from_42.txt`` was sent by 42 itself (github.com/ericstoneking/42, commit of 2025-03-27):
every tenth message of a run of two spacecraft that tumble 30 m apart (EULER_HILL, Orb_LEO.txt,
2026-03-20 12:00 UTC, steps of 0.1 s). Here a small server speaks the same format.
"""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from simgl_bridge import BodyPose, Client, NoAnswerError, RemoteError, Shot
from simgl_bridge.from_42.following import Followed, follow
from simgl_bridge.from_42.spacecraft_source import SpacecraftSource, sources_of
from simgl_bridge.from_42.state_message import StateMessage, parse_state
from simgl_bridge.from_42.text_socket import TextSocket

from simgl import BridgeError, ConfigError, Scenario
from simgl.physics.ephemeris import tai_ns_from_utc
from simgl.physics.frames import matrix_from_quaternion, rotation_about
from tests.bridge.harness import Gate, Proxy, Running
from tests.patience import limit

RECORDED = Path(__file__).with_name("recorded_from_42.txt").read_bytes()
NAV = [Shot(camera="nav")]
NOON = tai_ns_from_utc("2026-03-20T12:00:00")
# Of the reference orbit; 42 writes 13 digits.
ORBIT = np.array([6.369110518417e06, 1.427708321263e06, 1.827383319013e06])
SOURCES = {"target": SpacecraftSource(0), "chaser": SpacecraftSource(1)}


def recorded() -> list[StateMessage]:
    return [parse_state(text) for text in RECORDED.split(b"[ENDMSG]\n")[:-1]]


def message(step: int, distance_m: float = 40.0, end: str = "[ENDMSG]") -> bytes:
    """What 42 sends of a chaser before a target, ``step`` tenths of a second after noon."""

    def line(name: str, *numbers: float) -> str:
        return f"{name} = [{' '.join(f'{number:18.12e}' for number in numbers)}]\n"

    text = f"TIME 2026-079-12:00:{0.1 * step:012.9f}\n"
    for index, z in ((0, 0.0), (1, distance_m)):
        text += line(f"SC[{index}].qn", 0.0, 0.0, 0.0, 1.0)
        text += line(f"SC[{index}].wn", 0.0, 0.0, 0.0)
        text += line(f"SC[{index}].PosR", 0.01 * step, 0.0, z)
        text += line(f"SC[{index}].VelR", 0.0, 0.0, 0.0)
        text += line(f"SC[{index}].G[0].Ang", 0.1, 0.2, 0.3)
    text += line("Orb[0].PosN", *ORBIT) + line("Orb[0].VelN", 0.0, 7.6e3, 0.0)
    return (text + end + "\n").encode()


class Sender(threading.Thread):
    """Sends messages as 42 does: each one after the acknowledgement of the one before.

    acknowledged : of how many it came, and what the watched condition was just then
    """

    def __init__(self, messages: Sequence[bytes], watch: Callable[[], Any]) -> None:
        super().__init__()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(limit(20.0))
        self.port: int = self._listener.getsockname()[1]
        self._messages, self._watch = messages, watch
        self.acknowledged: list[Any] = []

    def run(self) -> None:
        # A peer that gives up may reset the connection.
        with self._listener, self._listener.accept()[0] as link, suppress(ConnectionError):
            link.settimeout(limit(20.0))
            for text in self._messages:
                # In two parts, as a network may deliver them.
                link.sendall(text[:100])
                link.sendall(text[100:])
                if link.recv(4) != b"Ack\0":
                    return
                self.acknowledged.append(self._watch())


@contextmanager
def sending(messages: Sequence[bytes], watch: Callable[[], Any] = bool) -> Iterator[Sender]:
    sender = Sender(messages, watch)
    sender.start()
    try:
        yield sender
    finally:
        sender.join(limit(30.0))
        assert not sender.is_alive()


def followed(client: Client, port: int, **options: Any) -> Followed:
    with TextSocket("127.0.0.1", port, limit(10.0), threading.Event()) as link:
        return follow(link, client, SOURCES, NAV, **options)


def test_attitudes_of_42_turn_body_components_into_inertial_ones() -> None:
    # 42 sends the Sun's direction in body axes: in inertial axes it must stand still, while the
    # body turns by 0.04. Of 42's own mean ephemeris it moves by 6e-6 in these four seconds.
    suns = [
        matrix_from_quaternion(np.array(m.numbers("SC[0].qn", 4))) @ m.numbers("SC[0].svb", 3)
        for m in recorded()
    ]
    np.testing.assert_allclose(suns, np.broadcast_to(suns[0], (5, 3)), atol=1e-5)


def test_rates_of_42_are_those_of_the_body_in_its_own_axes() -> None:
    first, second = (SOURCES["target"].pose(m) for m in recorded()[:2])
    rate = 0.5 * np.add(first.angular_velocity_rad_s, second.angular_velocity_rad_s)
    turned = rotation_about(rate / np.linalg.norm(rate), float(np.linalg.norm(rate)))
    before, after = (matrix_from_quaternion(p.q_icrf_from_body_xyzw) for p in (first, second))
    # One second; what the mean of two rates leaves is of the third order in the angle: 2e-6.
    np.testing.assert_allclose(before @ turned, after, atol=1e-6)


def test_positions_of_42_are_those_of_the_centre_of_mass_on_the_reference_orbit() -> None:
    source = SpacecraftSource(1, centre_of_mass_m=(0.1, -0.2, 0.3))
    messages = recorded()
    poses = [source.pose(m) for m in messages]
    for m, pose in zip(messages, poses, strict=True):
        R_icrf_from_body = matrix_from_quaternion(pose.q_icrf_from_body_xyzw)
        centre = np.add(pose.position_m, R_icrf_from_body @ source.centre_of_mass_m)
        separation = np.linalg.norm(centre - m.numbers("Orb[0].PosN", 3))
        assert abs(separation - np.linalg.norm(m.numbers("SC[1].PosR", 3))) < 1e-6
    # The velocity is that of the model's origin: its mean over the second is the step, up to
    # the jerk (R n^3 / 12 = 1 mm s-1) and the tumbling arm's (3e-6).
    step = np.subtract(poses[1].position_m, poses[0].position_m)
    mean = 0.5 * np.add(poses[0].velocity_m_s, poses[1].velocity_m_s)
    np.testing.assert_allclose(step, mean, atol=2e-3)


@pytest.mark.parametrize("end", ["[ENDMSG]", "[EOF]"])
def test_42_goes_on_when_the_images_of_its_state_are_there(
    running: Running, scenario: Scenario, end: str
) -> None:
    del scenario
    messages = [message(step, end=end) for step in range(3)]
    with (
        Client(running.address, timeout_s=limit(20.0)) as client,
        Client(running.address, timeout_s=limit(20.0)) as flight_software,
        sending(messages, lambda: flight_software.next_images()) as sender,
    ):
        assert followed(client, sender.port) == Followed(states=3, rendered=3)
        sender.join(limit(20.0))
        for step, images in enumerate(sender.acknowledged):
            assert images.tai_ns == NOON + step * 100_000_000
            # The same state, asked for by a client of one's own: the same hash and picture.
            poses = {
                name: BodyPose(
                    position_m=np.add(ORBIT, (0.01 * step, 0.0, z)),
                    velocity_m_s=(0.0, 7.6e3, 0.0),
                    q_icrf_from_body_xyzw=(0.0, 0.0, 0.0, 1.0),
                )
                for name, z in (("target", 0.0), ("chaser", 40.0))
            }
            native = flight_software.render(images.tai_ns, "nav", poses, seek=True)
            assert native.state_hash == images.state_hash
            np.testing.assert_array_equal(images["nav"].dn, native.dn)
            assert native.dn.max() > 10 * native.dn.min()


def test_42_waits_for_a_frame_that_takes_longer_than_an_answer(running: Running) -> None:
    gate = Gate()
    running.simulator.hook = gate
    with (
        Client(running.address, timeout_s=0.3) as client,
        sending([message(0)]) as sender,
    ):
        letting_go = threading.Timer(1.0, gate.open)
        letting_go.start()
        assert followed(client, sender.port) == Followed(states=1, rendered=1)
        letting_go.join()
    running.simulator.hook = None


def test_a_period_renders_the_first_state_of_each_interval(running: Running) -> None:
    steps = [0, 1, 2, 5, 6, 9, 10, 11]
    with (
        Client(running.address, timeout_s=limit(20.0)) as client,
        sending([message(step) for step in steps]) as sender,
    ):
        result = followed(client, sender.port, period_ns=500_000_000)
    assert (result.states, result.rendered) == (8, 3)


def test_a_state_without_a_server_is_not_acknowledged(running: Running) -> None:
    proxy = Proxy(running.address)
    with (
        Client(proxy.address, timeout_s=limit(1.0)) as client,
        # It dies between two states.
        sending([message(0), message(1)], proxy.close) as sender,
        pytest.raises(NoAnswerError, match=r"the connection broke|no connection within"),
    ):
        followed(client, sender.port)
    assert len(sender.acknowledged) == 1


def test_a_state_that_is_refused_is_not_acknowledged(running: Running) -> None:
    # The chaser's camera inside the target.
    messages = [message(0), message(1, distance_m=0.5), message(2)]
    with (
        Client(running.address, timeout_s=limit(20.0)) as client,
        sending(messages) as sender,
    ):
        with pytest.raises(RemoteError, match="inside the body"):
            followed(client, sender.port)
        sender.join(limit(20.0))
        assert len(sender.acknowledged) == 1


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (b"SC[0].qn = [0 0 0 1]\n", "without a TIME line"),
        (b"TIME 2026-079-12:00\n", "year-day-hour:minute:second"),
        (b"TIME 1066-079-12:00:00.0\n", "years 1972 to 2099"),
        (b"TIME 2026-079-12:00:00.0\nSC[0].qn = [0 0 zero 1]\n", r"name = \[numbers\]"),
        (b"TIME 2026-079-12:00:00.0\nHTTP/1.1 200 OK\n", r"name = \[numbers\]"),
        (b"TIME 2026-079-12:00:00.0\nSC[0].qn = [0 0 1]\n", "must have 4 numbers, got 3"),
        (b"TIME 2026-079-12:00:00.0\nSC[1].qn = [0 0 0 1]\n", r"add the prefix \"SC\[0\].qn\""),
    ],
)
def test_a_message_that_is_malformed_is_one_line(text: bytes, problem: str) -> None:
    with pytest.raises(BridgeError, match=problem):
        SOURCES["target"].pose(parse_state(text))


def test_a_stream_that_never_ends_a_message_is_refused(running: Running) -> None:
    with (
        Client(running.address, timeout_s=limit(20.0)) as client,
        sending([b"x" * 20_000]) as sender,
        pytest.raises(BridgeError, match="more than 16384 bytes; is this 42"),
    ):
        followed(client, sender.port)


def test_the_second_before_a_minute_may_be_rounded_to_60() -> None:
    rounded = parse_state(b"TIME 2026-079-11:59:60.000000000\n")
    assert rounded.tai_ns == parse_state(b"TIME 2026-079-12:00:00.000000000\n").tai_ns == NOON


def test_options_say_who_is_who(running: Running) -> None:
    with Client(running.address, timeout_s=limit(20.0)) as client:
        welcome = client.welcome
    by_order = sources_of(welcome, [], [], [])
    assert {name: s.index for name, s in by_order.items()} == {"target": 0, "chaser": 1}
    chosen = sources_of(welcome, ["chaser=3:1"], ["chaser=0.1,0,-0.5"], [])
    assert chosen == {"chaser": SpacecraftSource(3, 1, (0.1, 0.0, -0.5))}
    for options, problem in {
        (("chaser",), (), ()): "--spacecraft must be NAME=SC",
        (("moon=1",), (), ()): '--spacecraft the server has no spacecraft "moon"; it has target',
        (("chaser=1",), ("target=0,0,0",), ()): '--centre-of-mass "target" is not placed by 42',
        ((), ("target=0,0",), ()): "--centre-of-mass must be NAME=X,Y,Z",
        ((), (), ("target.wing=G0",)): "--joint must be NAME.JOINT=G0.Ang2",
        ((), (), ("target.wing=G0.Ang2",)): '--joint "target" has no joint "wing"; it has none',
    }.items():
        with pytest.raises(ConfigError, match=problem):
            sources_of(welcome, *options)
