"""What client and server say to each other: the message types of the protocol simgl/1.

    client                                server
    Hello      who, which versions   ->
                                     <-   Welcome   cameras, bodies, seed, boot id
    Render     time, poses, exposure ->
                                     <-   Images    what was used, state hash, then raw planes
    Ping                             ->
                                     <-   Pong
    Bye                              ->

Any request may be answered by an Error instead. Units are in the names; positions are Earth-centred
in ICRF axes, times TAI nanoseconds since 1970-01-01T00:00:00 TAI, quaternions Hamilton, scalar
last. A receiver ignores fields that it does not know, so that minor versions can add some. Types
here carry no limits; ``picture.py`` checks values and names the field.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from enum import StrEnum

import msgspec
from msgspec import Struct

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix = tuple[Vector, Vector, Vector]


class ErrorCode(StrEnum):
    """Why a request has no answer."""

    BAD_FRAMING = "BAD_FRAMING"
    """The multipart message has not exactly a version and a header."""
    VERSION = "VERSION"
    """The first frame is not a protocol version that the server speaks."""
    TOO_LARGE = "TOO_LARGE"
    """The header is longer than any request needs."""
    BAD_HEADER = "BAD_HEADER"
    """The header is not a MessagePack map with a type."""
    UNKNOWN_TYPE = "UNKNOWN_TYPE"
    """No such message, or not one that a client sends."""
    BAD_VALUE = "BAD_VALUE"
    """A field is missing, of the wrong type, or holds an impossible value."""
    NO_CAMERA = "NO_CAMERA"
    """The scenario has no such camera."""
    NO_BODY = "NO_BODY"
    """The scenario has no such spacecraft."""
    BAD_SCENE = "BAD_SCENE"
    """Every field is possible, the scene is not: a camera inside a body, for example."""
    INTERNAL = "INTERNAL"
    """The server failed where it should not."""


class Message(Struct, frozen=True, kw_only=True, tag_field="type", tag=str.lower):
    """Anything that travels in a header; its type is its class name in small letters."""


class Hello(Message, frozen=True, kw_only=True):
    """A client's first words.

    client : a name for logs
    versions : protocol versions that it speaks, such as ``simgl/1``
    """

    client: str
    versions: tuple[str, ...]


class CameraCard(Struct, frozen=True, kw_only=True):
    """A camera as the server offers it.

    cx, cy : principal point; the centre of the pixel in column i, row j is (i + 0.5, j + 0.5)
    exposure_time_s : used where a request gives none
    """

    name: str
    width: int
    height: int
    bits: int
    pedestal_dn: float
    full_well_e: float
    gain_dn_per_e: float
    focal_length_px: float
    cx: float
    cy: float
    exposure_time_s: float


class Welcome(Message, frozen=True, kw_only=True):
    """The server's answer to Hello.

    server : version of simgl
    boot : of this server process; another one means that it was restarted
    epoch_tai_ns : start of the scenario
    seed : of all noise
    bodies : names of the spacecraft that a request may place
    """

    server: str
    boot: str
    renderer: str
    scenario: str
    epoch_tai_ns: int
    seed: int
    cameras: tuple[CameraCard, ...]
    bodies: tuple[str, ...]


class SentPose(Struct, frozen=True, kw_only=True):
    """Where a spacecraft is and how it is turned, ICRF axes."""

    position_m: Vector
    velocity_m_s: Vector
    q_icrf_from_body_xyzw: Quaternion


class Render(Message, frozen=True, kw_only=True):
    """A request for one camera's picture of one state.

    id : chosen by the client, 0 or more; the same id again brings the same reply again
    tai_ns : mid-exposure
    bodies : spacecraft left out follow the scenario's own laws
    exposure_time_s : None takes the camera's own
    products : of "dn", "radiance", "electrons", "depth", "part_id"
    """

    id: int
    tai_ns: int
    camera: str
    bodies: dict[str, SentPose] = {}
    exposure_time_s: float | None = None
    products: tuple[str, ...] = ("dn",)


class Plane(Struct, frozen=True, kw_only=True):
    """One payload frame: row-major, row 0 at the top of the picture.

    dtype : as numpy writes it, little-endian, such as ``<u2``
    shape : height, width, and bands R, G, B, N for the radiance
    """

    product: str
    dtype: str
    shape: tuple[int, ...]
    unit: str


class Images(Message, frozen=True, kw_only=True):
    """A picture and what it is a picture of; one payload frame follows for each plane.

    sequence : of pictures taken by this server, from 1
    state_hash : see the function of this name
    intrinsics : from camera axes to pixel coordinates
    saturated_pixels : see ``picture.py``; None without digital numbers
    render_us : time taken by the picture, reading included
    part_names : part id to "spacecraft/part", where part ids were asked for
    """

    id: int
    sequence: int
    boot: str
    tai_ns: int
    state_hash: str
    camera: str
    camera_position_m: Vector
    q_camera_from_icrf_xyzw: Quaternion
    exposure_time_s: float
    intrinsics: Matrix
    seed: int
    saturated_pixels: int | None
    render_us: int
    planes: tuple[Plane, ...]
    part_names: dict[int, str] = {}


class Error(Message, frozen=True, kw_only=True):
    """Why a request has no other answer.

    id : of the request, None where it could not be read
    code : an ErrorCode; a client must expect new ones
    field : such as ``bodies.chaser.position_m``, or the scenario's ``[camera.nav] position``; empty
        where none is to blame
    detail : one line that names field, value and what is allowed
    retryable : whether the same request may succeed later
    """

    id: int | None
    code: str
    field: str
    detail: str
    retryable: bool = False


class Ping(Message, frozen=True, kw_only=True):
    """Are you there?"""

    id: int


class Pong(Message, frozen=True, kw_only=True):
    """Yes."""

    id: int
    boot: str


class Bye(Message, frozen=True, kw_only=True):
    """The client leaves; the server forgets its replies and does not answer."""


def state_hash(
    *,
    tai_ns: int,
    bodies: Mapping[str, SentPose],
    camera: str,
    exposure_time_s: float,
    seed: int,
) -> str:
    """Name of the state that a picture shows, the same at both ends of the link.

    BLAKE2b with 16 bytes in hexadecimal digits, over the MessagePack array
    ``[tai_ns, [[name, position_m, velocity_m_s, q_icrf_from_body_xyzw], ...], camera,
    exposure_time_s, seed]``: spacecraft as sent, sorted by name; integers in their shortest form;
    real numbers as float64. ``exposure_time_s`` is the one used.
    """
    placed = [
        [
            name,
            [float(v) for v in pose.position_m],
            [float(v) for v in pose.velocity_m_s],
            [float(v) for v in pose.q_icrf_from_body_xyzw],
        ]
        for name, pose in sorted(bodies.items())
    ]
    state = [int(tai_ns), placed, camera, float(exposure_time_s), int(seed)]
    return hashlib.blake2b(msgspec.msgpack.encode(state), digest_size=16).hexdigest()
