"""The protocol as bytes: what a client in another language relies on."""

from __future__ import annotations

import hashlib
import struct

import msgspec
import numpy as np
import pytest
from simgl_bridge.client_sessions import MAX_REPLIES_PER_CLIENT, ReplyCache
from simgl_bridge.framing import BadMessageError, pack, unpack_reply, unpack_request
from simgl_bridge.hashes import state_hash
from simgl_bridge.message_parts import SentPose, SentSun, Shot
from simgl_bridge.messages import (
    Hello,
    Images,
    Ping,
    Render,
)

from simgl.errors import BridgeError

POSE = SentPose(
    position_m=(1.0, 2.0, 3.0),
    velocity_m_s=(0.0, -0.5, 0.0),
    q_icrf_from_body_xyzw=(0.0, 0.0, 0.0, 1.0),
)


def f64(*values: float) -> bytes:
    return b"".join(b"\xcb" + struct.pack(">d", v) for v in values)


def test_the_state_hash_can_be_made_by_hand() -> None:
    content = (
        b"\x95"  # array of 5: time, bodies, Sun, cameras, seed
        + b"\xcf" + struct.pack(">Q", 1_774_008_037_000_000_000)
        + b"\x91" + b"\x95" + b"\xa6chaser"
        + b"\x93" + f64(1.0, 2.0, 3.0)
        + b"\x93" + f64(0.0, -0.5, 0.0)
        + b"\x94" + f64(0.0, 0.0, 0.0, 1.0)
        + b"\x90"  # no joints
        + b"\xc0"  # the scenario's Sun
        + b"\x91" + b"\x93" + b"\xa3nav" + f64(0.001, 0.25)
        + b"\x07"
    )  # fmt: skip
    made = state_hash(
        tai_ns=1_774_008_037_000_000_000,
        bodies={"chaser": POSE},
        sun=None,
        cameras=[("nav", 0.001, 0.25)],
        seed=7,
    )
    assert made == hashlib.blake2b(content, digest_size=16).hexdigest()
    assert len(made) == 32


def test_the_state_hash_knows_no_order_of_bodies_and_every_value() -> None:
    state = {"tai_ns": 1, "sun": None, "cameras": [("a", 1.0, 2.0)], "seed": 0}
    other = msgspec.structs.replace(POSE, velocity_m_s=(0.0, -0.5, 1e-300))
    one = state_hash(bodies={"x": POSE, "y": other}, **state)  # type: ignore[arg-type]
    assert one == state_hash(bodies={"y": other, "x": POSE}, **state)  # type: ignore[arg-type]
    assert one != state_hash(bodies={"y": POSE, "x": other}, **state)  # type: ignore[arg-type]
    changes = [("tai_ns", 2), ("seed", 1), ("sun", SentSun(position_m=(1.5e11, 0.0, 0.0)))]
    changes += [("cameras", [shot]) for shot in (("b", 1.0, 2.0), ("a", 2.0, 2.0), ("a", 1.0, 1.0))]
    for key, value in changes:
        assert one != state_hash(bodies={"x": POSE, "y": other}, **{**state, key: value})  # type: ignore[arg-type]


def test_whole_numbers_hash_like_the_reals_that_they_are() -> None:
    whole = SentPose(
        position_m=(1, 2, 3), velocity_m_s=(0, -0.5, 0), q_icrf_from_body_xyzw=(0, 0, 0, 1)
    )
    state = {"tai_ns": 1, "sun": None, "cameras": [("a", 1, 2)], "seed": 0}
    assert state_hash(bodies={"x": whole}, **state) == state_hash(bodies={"x": POSE}, **state)  # type: ignore[arg-type]


def test_a_message_is_version_header_and_a_map_with_its_type() -> None:
    version, header = pack(Ping(id=3))
    assert version == b"simgl/1"
    assert header == b"\x82\xa4type\xa4ping\xa2id\x03"


@pytest.mark.parametrize(
    "message",
    [
        Hello(client="c", versions=("simgl/1",)),
        Ping(id=1),
        Render(id=1, tai_ns=2, cameras=(Shot(camera="c"),), bodies={"b": POSE}),
    ],
)
def test_a_request_survives_the_way(message: Hello | Ping | Render) -> None:
    assert unpack_request(pack(message)) == message


def test_a_malformed_reply_is_a_bridge_error() -> None:
    for frames in ([b"simgl/1"], [b"simgl/9", b"\x80"], [b"simgl/1", b"\x81\xa4type\xa6images"]):
        with pytest.raises(BridgeError):
            unpack_reply(frames)


def test_a_request_is_no_reply() -> None:
    with pytest.raises(BadMessageError, match='type "ping" is not known here'):
        unpack_reply(pack(Ping(id=1)))


def test_every_message_is_frozen() -> None:
    with pytest.raises(AttributeError):
        Ping(id=1).id = 2  # type: ignore[misc]
    assert Images.__struct_config__.frozen


def test_the_cache_keeps_the_latest_replies_of_each_client() -> None:
    cache = ReplyCache()
    for id in range(MAX_REPLIES_PER_CLIENT + 1):
        cache.store(b"a", id, b"request", [b"reply", bytes([id])])
    assert cache.find(b"a", 0, b"request") is None
    assert cache.find(b"a", 1, b"request") == [b"reply", b"\x01"]
    assert cache.find(b"b", 1, b"request") is None
    cache.forget(b"a")
    assert cache.find(b"a", 1, b"request") is None


def test_the_cache_refuses_an_id_with_other_content() -> None:
    cache = ReplyCache()
    cache.store(b"a", 1, b"request", [b"reply"])
    with pytest.raises(BadMessageError, match="id 1 was used for another request"):
        cache.find(b"a", 1, b"another")


def test_the_cache_has_room_for_one_reply_of_any_size(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("simgl_bridge.client_sessions.MAX_REPLY_BYTES", 1000)
    cache = ReplyCache()
    big = np.zeros((50, 50), dtype=np.uint16)
    for id in (1, 2):
        cache.store(b"a", id, b"request", [b"header", big.data.cast("B")])
    assert cache.find(b"a", 1, b"request") is None
    assert cache.find(b"a", 2, b"request") is not None
