"""The protocol on paper: the page is that of the message types, the golden bytes are these."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest
from simgl_bridge.framing import pack, unpack_reply, unpack_request
from simgl_bridge.message_parts import (
    CameraDescription,
    CameraImage,
    Plane,
    SentPose,
    SentSun,
    ServerStatus,
    Shot,
)
from simgl_bridge.messages import (
    REPLIES,
    REQUESTS,
    Bye,
    Configure,
    Error,
    Hello,
    Images,
    Message,
    Next,
    Ping,
    Pong,
    Preview,
    Render,
    State,
    Statistics,
    Stats,
    Welcome,
)

from tools.protocol_page import page

ROOT = Path(__file__).parents[2]
GOLDEN = Path(__file__).parents[1] / "bridge" / "golden"
NOW = 1_774_008_037_000_000_000

_POSE = SentPose(
    position_m=(1.0, -2.5, 3e6),
    velocity_m_s=(0.0, 7500.0, 0.125),
    q_icrf_from_body_xyzw=(0.0, 0.6, 0.0, 0.8),
    joints={"door": 0.5},
    angular_velocity_rad_s=(0.0, -0.25, 0.0),
)
_SUN = SentSun(position_m=(1.5e11, 0.0, -1e9))
_SHOTS = (
    Shot(camera="nav", exposure_time_s=0.001, gain_dn_per_e=0.25, products=("dn", "depth")),
    Shot(camera="side"),
)
_CARD = CameraDescription(
    name="nav",
    width=64,
    height=48,
    bits=12,
    pedestal_dn=168.0,
    full_well_e=6500.0,
    gain_dn_per_e=0.625,
    focal_length_px=533.5,
    cx=32.0,
    cy=24.0,
    exposure_time_s=0.0005,
    readout_time_s=0.02,
    transport_latency_s=0.1,
)
_IMAGE = CameraImage(
    camera="nav",
    position_m=(0.0, 0.0, 59.5),
    q_camera_from_icrf_xyzw=(0.0, 0.0, 0.0, 1.0),
    intrinsics=((533.5, 0.0, 32.0), (0.0, 533.5, 24.0), (0.0, 0.0, 1.0)),
    exposure_time_s=0.001,
    gain_dn_per_e=0.25,
    exposure_start_tai_ns=NOW - 500_000,
    exposure_end_tai_ns=NOW + 500_000,
    readout_end_tai_ns=NOW + 20_500_000,
    available_tai_ns=NOW + 120_500_000,
    sun_direction_icrf=(0.6, 0.0, 0.8),
    sun_irradiance_w_m2=(154.5, 174.75, 172.0, 313.25),
    saturated_pixels=3,
    render_us=12345,
    planes=(Plane(product="part_id", dtype="<u4", shape=(48, 64), unit=""),),
    part_names={65537: "target/body"},
    interreflection="quick",
)
_BOOT, _HASH = "b" * 32, "5" * 32
_WELCOME = Welcome(
    id=None,
    server="0.1.0",
    boot=_BOOT,
    renderer="llvmpipe",
    scenario="small",
    scene_hash=_HASH,
    epoch_tai_ns=NOW,
    time_scale="TAI ns since 1970-01-01T00:00:00 TAI",
    frame="GCRF",
    seed=7,
    window=2,
    products=("dn", "radiance"),
    cameras=(_CARD,),
    bodies={"target": ("door",)},
    scenarios=("approach",),
    lamps=("flood",),
)
_STATUS = ServerStatus(
    state="starting", detail="light between surfaces of target", done=3, total=40, since_s=1.5
)
_IMAGES = Images(
    id=2**63 - 1,
    sequence=300,
    boot=_BOOT,
    scene_hash=_HASH,
    tai_ns=NOW,
    state_hash=_HASH,
    seed=7,
    bodies={"chaser": _POSE},
    images=(_IMAGE,),
    state_id=41,
    dropped=2,
)
EXAMPLES: tuple[Message, ...] = (
    Hello(client="loop", versions=("simgl/1",)),
    Render(
        id=1,
        tai_ns=NOW,
        cameras=_SHOTS,
        bodies={"chaser": _POSE},
        sun=_SUN,
        seek=True,
        deadline_ms=9800,
        lamps={"flood": 0.5},
        moving=True,
    ),
    State(
        id=2,
        tai_ns=NOW,
        cameras=_SHOTS,
        bodies={"chaser": _POSE},
        sun=_SUN,
        lamps={"flood": 0.5},
        moving=True,
    ),
    Next(id=3, after=299, deadline_ms=500),
    Configure(id=4, scenario="approach", seed=8),
    Ping(id=5),
    Stats(id=6),
    Bye(),
    _WELCOME,
    _IMAGES,
    Error(id=7, code="BUSY", field="", detail="2 requests wait", retryable=True),
    Pong(id=5, boot=_BOOT),
    Pong(id=0, boot=_BOOT, status=_STATUS),
    msgspec.structs.replace(_WELCOME, status=ServerStatus(state="drawing", since_s=0.25)),
    Statistics(
        id=6,
        boot=_BOOT,
        uptime_s=1.5,
        images=9,
        repeated=1,
        errors=3,
        busy=2,
        lost=0,
        waiting=1,
        clients=2,
    ),
    Preview(
        number=4,
        skipped=2,
        sequence=300,
        boot=_BOOT,
        camera="nav",
        tai_ns=NOW,
        shape=(48, 64, 3),
    ),
)


# What the first servers sent.
FIRST = (_WELCOME, Pong(id=5, boot=_BOOT))


def kind(message: Message) -> str:
    return str(type(message).__struct_config__.tag)


def golden_name(message: Message) -> str:
    """Name of the golden file; answers that tell a status have their own, beside the older."""
    with_status = isinstance(message, Pong | Welcome) and message.status is not None
    return f"{kind(message)}_status" if with_status else kind(message)


def test_every_message_has_a_golden_file() -> None:
    assert {type(m) for m in EXAMPLES} == {*REQUESTS, *REPLIES}
    assert {p.stem for p in GOLDEN.glob("*.msgpack")} == {golden_name(m) for m in EXAMPLES}


@pytest.mark.parametrize("message", [m for m in EXAMPLES if m not in FIRST], ids=golden_name)
def test_a_message_is_its_golden_bytes_both_ways(message: Message) -> None:
    # A change here is a change of the protocol: add fields with defaults, or make it simgl/2.
    golden = (GOLDEN / f"{golden_name(message)}.msgpack").read_bytes()
    version, header = pack(message)
    assert version == b"simgl/1"
    assert header == golden
    unpack = unpack_request if type(message) in REQUESTS else unpack_reply
    assert unpack([version, golden]) == message


@pytest.mark.parametrize("message", FIRST, ids=kind)
def test_what_the_first_servers_sent_is_read(message: Message) -> None:
    golden = (GOLDEN / f"{kind(message)}.msgpack").read_bytes()
    assert unpack_reply([b"simgl/1", golden]) == message


def test_the_page_is_that_of_the_message_types() -> None:
    current = (ROOT / "docs" / "protocol.md").read_text(encoding="utf-8")
    assert current == page(), "run: python -m tools.protocol_page > docs/protocol.md"


def test_the_page_explains_every_field_of_the_largest_messages() -> None:
    lines = page().splitlines()
    for field in ("tai_ns", "deadline_ms", "available_tai_ns", "state_hash", "window", "shape"):
        assert any(line.startswith(f"| `{field}` | ") and line.count("|") == 5 for line in lines)
    assert not [line for line in lines if "@" in line]
