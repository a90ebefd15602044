"""A bad message gets an error reply that names the field, and the server lives on."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from simgl_bridge import Client, RemoteError

from simgl import Scenario
from tests.bridge.harness import RawLink, Running
from tests.bridge.zmtp import ask_by_zmtp_2
from tests.patience import limit

POSE = {
    "position_m": [0.0, 0.0, 60.0],
    "velocity_m_s": [0.0, 0.0, 0.0],
    "q_icrf_from_body_xyzw": [0.0, 0.0, 0.0, 1.0],
}
TAI_NS = 1_774_008_037_000_000_000
SHOT = {"camera": "nav"}
RENDER = {
    "type": "render",
    "id": 1,
    "tai_ns": TAI_NS,
    "cameras": [SHOT],
    "bodies": {"chaser": POSE},
}
NUMBER_AS_KEY: dict[Any, Any] = {**RENDER, 9: 9}
HEADER = msgspec.msgpack.encode(RENDER)


def pose(**changes: Any) -> dict[str, Any]:
    """A request whose chaser pose differs in some fields."""
    return {**RENDER, "bodies": {"chaser": {**POSE, **changes}}}


def shot(**changes: Any) -> dict[str, Any]:
    """A request whose only camera differs in some fields."""
    return {**RENDER, "cameras": [{**SHOT, **changes}]}


def without(key: str) -> dict[str, Any]:
    return {k: v for k, v in RENDER.items() if k != key}


def assert_alive(raw: RawLink) -> None:
    good = {**RENDER, "id": 1000}
    assert raw.ask_map(good)["type"] == "images"


@pytest.mark.parametrize(
    ("frames", "code", "detail"),
    [
        ([b""], "BAD_FRAMING", "message must be 2 frames, version and header, got 1"),
        ([b"simgl/1"], "BAD_FRAMING", "message must be 2 frames, version and header, got 1"),
        ([b"simgl/1", HEADER, b"x"], "BAD_FRAMING", "version and header, got 3"),
        ([b"", b"simgl/1", HEADER], "BAD_FRAMING", "version and header, got 3"),
        ([b"simgl/2", HEADER], "VERSION", 'version must be "simgl/1", got "simgl/2"'),
        ([b"\xff\x00" * 40, HEADER], "VERSION", 'version must be "simgl/1", got "ÿ\\x00'),
        ([b"simgl/1", b""], "BAD_HEADER", "header is not MessagePack (Input data was truncated)"),
        ([b"simgl/1", b"\xc1\xc1garbage"], "BAD_HEADER", "header is not MessagePack"),
        ([b"simgl/1", b"\xa1\xff"], "BAD_HEADER", "header is not MessagePack ('utf-8'"),
        ([b"simgl/1", b"\x91" * 60_000 + b"\xc0"], "BAD_HEADER", "maximum recursion depth"),
        ([b"simgl/1", b"\xdd\xff\xff\xff\xff"], "BAD_HEADER", "truncated"),
        ([b"simgl/1", HEADER + b"\x00"], "BAD_HEADER", "trailing characters"),
        ([b"simgl/1", b"{}"], "BAD_HEADER", "header is not MessagePack"),
        ([b"simgl/1", b"\x05"], "BAD_HEADER", 'header must be a map with a text "type", got 5'),
        ([b"simgl/1", b"\x80"], "BAD_HEADER", 'header must be a map with a text "type", got {}'),
        ([b"simgl/1", b"\xc0" * 65_537], "TOO_LARGE", "must be at most 65536 bytes, got 65537"),
    ],
)  # fmt: skip
def test_broken_frames_are_explained(
    raw: RawLink, frames: list[bytes], code: str, detail: str
) -> None:
    reply = raw.ask(frames)
    assert (reply["type"], reply["code"]) == ("error", code)
    assert detail in reply["detail"]
    assert reply["id"] is None
    assert_alive(raw)


@pytest.mark.parametrize(
    ("request_map", "code", "field", "detail"),
    [
        ({"type": "rendr", "id": 1}, "UNKNOWN_TYPE", "type",
         'type "rendr" is not known here; did you mean "render"? (allowed: bye, configure, '),
        ({"type": "images", "id": 1}, "UNKNOWN_TYPE", "type",
         'type "images" is not known here; allowed: bye, configure, hello, '
         'next, ping, render, state, stats'),
        (without("id"), "BAD_VALUE", "id", "id is missing"),
        (without("tai_ns"), "BAD_VALUE", "tai_ns", "tai_ns is missing"),
        (without("cameras"), "BAD_VALUE", "cameras", "cameras is missing"),
        ({**RENDER, "id": -1}, "BAD_VALUE", "id", "id must lie in 0..2^63-1, got -1"),
        ({**RENDER, "id": 2**63}, "BAD_VALUE", "id",
         "id must lie in 0..2^63-1, got 9223372036854775808"),
        ({**RENDER, "id": "one"}, "BAD_VALUE", "id", 'id must be a whole number, got "one"'),
        ({**RENDER, "tai_ns": 1.5}, "BAD_VALUE", "tai_ns",
         "tai_ns must be a whole number, got 1.5"),
        ({**RENDER, "tai_ns": 0}, "BAD_VALUE", "tai_ns",
         "tai_ns must lie in the years 1972 to 2099 "
         "(63072010000000000..4102444836999999999), got 0"),
        ({**RENDER, "tai_ns": 2**64 - 1}, "BAD_VALUE", "tai_ns", "got 18446744073709551615"),
        (shot(camera="nva"), "NO_CAMERA", "cameras[0].camera",
         'cameras[0].camera "nva" does not exist here; did you mean "nav"? (allowed: nav, side)'),
        (shot(camera="a\nb\0" + "x" * 1000), "NO_CAMERA", "cameras[0].camera",
         f'cameras[0].camera "a\\nb\\x00{"x" * 53}..." does not exist here'),
        (shot(camera=3), "BAD_VALUE", "cameras[0].camera",
         "cameras[0].camera must be a text, got 3"),
        ({**RENDER, "bodies": {"chasr": POSE}}, "NO_BODY", "bodies",
         'bodies "chasr" does not exist here; did you mean "chaser"? (allowed: chaser, target)'),
        ({**RENDER, "bodies": [POSE]}, "BAD_VALUE", "bodies", "bodies must be a map, got [{"),
        ({**RENDER, "bodies": {5: POSE}}, "BAD_VALUE", "bodies", "bodies must have texts as names"),
        (NUMBER_AS_KEY, "BAD_VALUE", "header", "header must have texts as names"),
        (pose(q_icrf_from_body_xyzw=[0.0, 0.0, 0.0, 1e300]), "BAD_VALUE",
         "bodies.chaser.q_icrf_from_body_xyzw", "got norm inf"),
        ({**RENDER, "bodies": {"target": POSE, "chaser": 7}}, "BAD_VALUE", "bodies.chaser",
         "bodies.chaser must be a map, got 7"),
        ({**RENDER, "bodies": {"chaser": {"position_m": [0, 0, 60]}}}, "BAD_VALUE",
         "bodies.chaser.velocity_m_s", "bodies.chaser.velocity_m_s is missing"),
        (pose(position_m=[0.0, math.nan, 1.0]), "BAD_VALUE", "bodies.chaser.position_m",
         "bodies.chaser.position_m must be finite, got [0.0, nan, 1.0]"),
        (pose(velocity_m_s=[0.0, 0.0, -math.inf]), "BAD_VALUE", "bodies.chaser.velocity_m_s",
         "bodies.chaser.velocity_m_s must be finite, got [0.0, 0.0, -inf]"),
        (pose(position_m=[1e300, 0, 0]), "BAD_VALUE", "bodies.chaser.position_m",
         "bodies.chaser.position_m must be at most 1e+12 m along each axis, "
         "got [1e+300, 0.0, 0.0]"),
        (pose(position_m=[1.0, 2.0]), "BAD_VALUE", "bodies.chaser.position_m",
         "bodies.chaser.position_m must be a list of length 3, got [1.0, 2.0]"),
        (pose(position_m=[1.0, "two", 3.0]), "BAD_VALUE", "bodies.chaser.position_m[1]",
         'bodies.chaser.position_m[1] must be a number, got "two"'),
        (pose(q_icrf_from_body_xyzw=[0.0, 0.0, 0.0, 1.2]), "BAD_VALUE",
         "bodies.chaser.q_icrf_from_body_xyzw",
         "bodies.chaser.q_icrf_from_body_xyzw must be a unit quaternion, got norm 1.2 "
         "(off by +0.2, allowed 0.0001)"),
        (pose(q_icrf_from_body_xyzw=[0.0, 0.0, 0.0, math.nan]), "BAD_VALUE",
         "bodies.chaser.q_icrf_from_body_xyzw", "must be four finite numbers x y z w"),
        (shot(exposure_time_s=-0.001), "BAD_VALUE", "cameras[0].exposure_time_s",
         "cameras[0].exposure_time_s must lie above 0, up to 3600 s, got -0.001"),
        (shot(exposure_time_s=0), "BAD_VALUE", "cameras[0].exposure_time_s", "got 0"),
        (shot(exposure_time_s=math.nan), "BAD_VALUE", "cameras[0].exposure_time_s", "got nan"),
        (shot(exposure_time_s="1 ms"), "BAD_VALUE", "cameras[0].exposure_time_s",
         'cameras[0].exposure_time_s must be a number or nil, got "1 ms"'),
        (shot(products=[]), "BAD_VALUE", "cameras[0].products",
         "cameras[0].products must name at least one of dn, radiance, electrons, depth, part_id, "
         "range, lidar_range, lidar_electrons"),
        (shot(products=["dn", "png"]), "BAD_VALUE", "cameras[0].products[1]",
         'cameras[0].products[1] "png" does not exist here; '
         'allowed: depth, dn, electrons, lidar_electrons, lidar_range, part_id, radiance, range, '
         'temperature, thermal_radiance'),
        (shot(products=["dn", "dn"]), "BAD_VALUE", "cameras[0].products[1]",
         'cameras[0].products[1] repeats "dn"'),
        (pose(position_m=[0.0, 0.0, 0.3]), "BAD_SCENE", "[camera.nav] position",
         '[camera.nav] position is inside the body of "target" (at 0.000, 0.000, 0.100 m'),
        ({"type": "hello", "client": "old", "versions": ["simgl/0"]}, "VERSION", "versions",
         "versions must hold \"simgl/1\", got ['simgl/0']"),
        ({"type": "hello", "client": "old"}, "BAD_VALUE", "versions", "versions is missing"),
        ({"type": "ping", "id": None}, "BAD_VALUE", "id", "id must be a whole number, got nil"),
    ],
)  # fmt: skip
def test_a_wrong_value_is_named_with_its_field(
    raw: RawLink, request_map: dict[str, Any], code: str, field: str, detail: str
) -> None:
    reply = raw.ask_map(request_map)
    assert (reply["type"], reply["code"], reply["field"]) == ("error", code, field)
    assert detail in reply["detail"]
    assert "\n" not in reply["detail"]
    id = request_map.get("id")
    assert reply["id"] == (id if type(id) is int and 0 <= id < 2**63 else None)
    assert reply["retryable"] is False
    assert_alive(raw)


def test_a_camera_without_a_direction_to_look_is_named(raw: RawLink) -> None:
    there = {**POSE, "position_m": [50.0, 0.0, 10.0]}
    reply = raw.ask_map({**shot(camera="side"), "bodies": {"target": there}})
    assert reply["code"] == "BAD_SCENE"
    assert reply["field"] == "[camera.side] look_at"
    assert_alive(raw)


def test_the_client_raises_what_the_server_says(client: Client, scenario: Scenario) -> None:
    with pytest.raises(RemoteError) as caught:
        client.render(scenario.epoch_tai_ns, "nav", exposure_time_s=-1.0)
    assert caught.value.code == "BAD_VALUE"
    assert caught.value.field == "cameras[0].exposure_time_s"
    assert str(caught.value) == (
        f"{client.address}: BAD_VALUE: cameras[0].exposure_time_s must lie above 0, "
        "up to 3600 s, got -1"
    )
    assert client.render(scenario.epoch_tai_ns, "nav").dn.shape == (48, 64)


def test_a_failing_render_is_an_error_reply(
    raw: RawLink, running: Running, capfd: pytest.CaptureFixture[str]
) -> None:
    def fail() -> None:
        raise RuntimeError("the driver\nhas a bad day")

    running.simulator.hook = fail
    try:
        reply = raw.ask_map({**RENDER, "id": 77})
    finally:
        running.simulator.hook = None
    assert (reply["code"], reply["id"]) == ("INTERNAL", 77)
    assert reply["detail"] == "RuntimeError: the driver has a bad day"
    assert "bad day" in capfd.readouterr().err
    # The failure was not kept: the same id is rendered now.
    assert raw.ask_map({**RENDER, "id": 77})["type"] == "images"


def test_a_frame_beyond_the_limit_costs_its_sender_the_link_and_nobody_else(
    raw: RawLink, running: Running
) -> None:
    greedy = RawLink(running.address)
    greedy.send([b"simgl/1", bytes(2 * 1024 * 1024)])
    assert_alive(raw)


def test_a_client_that_asks_much_and_takes_late_does_not_hold_up_the_others(
    raw: RawLink, running: Running
) -> None:
    lazy = RawLink(running.address)
    for id in range(200):
        lazy.send([b"simgl/1", msgspec.msgpack.encode({**RENDER, "id": id % 3})])
    assert_alive(raw)


# Any bytes; any MessagePack; a good request with one byte changed; a good request with one field
# replaced by anything.
_TEXTS = st.text(max_size=9)
_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats() | _TEXTS,
    lambda v: st.lists(v, max_size=4) | st.dictionaries(_TEXTS, v, max_size=4),
    max_leaves=8,
)
_ONE_BYTE = st.builds(
    lambda at, byte: HEADER[:at] + bytes([byte]) + HEADER[at + 1 :],
    st.integers(0, len(HEADER) - 1),
    st.integers(0, 255),
)
_ONE_FIELD = st.builds(
    lambda key, value: msgspec.msgpack.encode({**RENDER, key: value}),
    st.sampled_from(["id", "tai_ns", "cameras", "bodies", "sun", "seek", "deadline_ms"]),
    _VALUES,
)
_POSE_FIELD = st.builds(
    lambda key, value: msgspec.msgpack.encode(pose(**{key: value})),
    st.sampled_from(list(POSE)),
    _VALUES | st.lists(st.floats(), min_size=3, max_size=4),
)


@settings(max_examples=200, deadline=round(limit(5000)), derandomize=True)
@given(
    header=st.binary(max_size=300)
    | st.builds(msgspec.msgpack.encode, _VALUES)
    | _ONE_BYTE
    | _ONE_FIELD
    | _POSE_FIELD
)
def test_no_header_ends_the_service(running: Running, header: bytes) -> None:
    link = RawLink(running.address)
    try:
        link.send([b"simgl/1", header])
        link.send([b"simgl/1", msgspec.msgpack.encode({"type": "ping", "id": 123_456_789})])
        codes = []
        while (reply := msgspec.msgpack.decode(link.receive()[1]))["type"] != "pong":
            codes.append(reply.get("code", reply["type"]))
        assert len(codes) <= 1
        assert "INTERNAL" not in codes
    finally:
        link.close()


def test_a_client_of_an_old_zeromq_library_is_served_and_ends_nothing(running: Running) -> None:
    # Its messages come without the number of their connection.
    hello = {"type": "hello", "client": "old", "versions": ["simgl/1"]}
    for _ in range(2):
        answer = ask_by_zmtp_2(running.address, msgspec.msgpack.encode(hello))
        assert b"welcome" in answer
    with Client(running.address, timeout_s=limit(20.0)) as client:
        assert client.welcome.cameras
