"""Messages of client and server: the schema of the protocol simgl/1.

    client                                server
    Hello      name, versions        ->
                                     <-   Pong      its state, where it is not ready yet
                                     <-   Welcome   cameras, bodies, window, scene hash, boot id
    Render     time, poses, cameras  ->
                                     <-   Images    values used, state hash, then raw planes
    State      the newest state      ->             free-run: no reply unless it is refused
    Next       an image after n      ->
                                     <-   Images    of the newest state, once rendered
    Configure  scenario, seed        ->
                                     <-   Welcome   of the new scene
    Ping, Stats                      ->
                                     <-   Pong, Statistics
    Bye                              ->
                                     <-   Bye       the server ends

Any request may be answered by an Error instead. Units are in the names; positions are Earth-centred
in ICRF axes, times TAI nanoseconds since 1970-01-01T00:00:00 TAI, quaternions Hamilton, scalar
last. A receiver ignores unknown fields, so that minor versions can add some. The ranges in the
types (``value_ranges``) are those that requests are checked against. ``docs/protocol.md`` is
generated from this file and ``message_parts``.
"""

from __future__ import annotations

from enum import StrEnum

from msgspec import Struct

from simgl_bridge.message_parts import (
    CameraDescription,
    CameraImage,
    SentPose,
    SentSun,
    ServerStatus,
    Shot,
)
from simgl_bridge.value_ranges import (
    DeadlineMs,
    Draw,
    Id,
    Seed,
    Share,
    TaiNs,
)


class ErrorCode(StrEnum):
    """Why a request was refused."""

    BAD_FRAMING = "BAD_FRAMING"
    """The multipart message is not exactly a version and a header."""
    VERSION = "VERSION"
    """The first frame is not a protocol version that the server speaks."""
    TOO_LARGE = "TOO_LARGE"
    """The header is longer than any request."""
    BAD_HEADER = "BAD_HEADER"
    """The header is not a MessagePack map with a type."""
    UNKNOWN_TYPE = "UNKNOWN_TYPE"
    """There is no such message, or clients do not send it."""
    BAD_VALUE = "BAD_VALUE"
    """A field is missing, of the wrong type, or holds an impossible value."""
    NO_CAMERA = "NO_CAMERA"
    """The scenario has no such camera."""
    NO_BODY = "NO_BODY"
    """The scenario has no such spacecraft."""
    NO_JOINT = "NO_JOINT"
    """The spacecraft's model has no such movable joint."""
    NO_LAMP = "NO_LAMP"
    """The scenario has no such lamp."""
    NO_THERMAL_STATE = "NO_THERMAL_STATE"
    """The server no longer has this thermal state, after a restart or after too many others."""
    NO_SCENARIO = "NO_SCENARIO"
    """There is no such scenario in the server's folder, or the server has none to choose from."""
    BAD_SCENE = "BAD_SCENE"
    """Every field is valid, but the scene is not: for example, a camera is inside a body."""
    TIME_BACKWARDS = "TIME_BACKWARDS"
    """The time is before that of the client's last request, and ``seek`` is not set."""
    BUSY = "BUSY"
    """The client's window of queued requests is full; send the request again later."""
    DEADLINE = "DEADLINE"
    """Too late: the request's deadline was over before its images were there."""
    NOT_OWNER = "NOT_OWNER"
    """Another client streams states or chose the scenario, and has not left."""
    SHARED_IDENTITY = "SHARED_IDENTITY"
    """Another client has a socket of the same identity; both get this error."""
    NOT_READY = "NOT_READY"
    """The server is still starting and cannot take a state; send it again once it is ready."""
    NOT_RECORDED = "NOT_RECORDED"
    """The server records, and the images cannot be recorded, such as on a full disk."""
    RENDERER_LOST = "RENDERER_LOST"
    """The renderer died, or did not return; it is started again, and the request may succeed."""
    GPU_LOST = "GPU_LOST"
    """The OpenGL context failed; a new one is opened, and the same request may succeed."""
    INTERNAL = "INTERNAL"
    """The server has a fault."""


class Message(Struct, frozen=True, kw_only=True, tag_field="type", tag=str.lower):
    """The content of a header; its type is the class name in lower case."""


class Hello(Message, frozen=True, kw_only=True):
    """The first message of a client.

    client : name of the client, for logs
    versions : protocol versions that it speaks, such as ``simgl/1``
    """

    client: str
    versions: tuple[str, ...]


class Welcome(Message, frozen=True, kw_only=True):
    """The server's answer to Hello and Configure.

    id : of the Configure; None after Hello
    server : version of simgl
    boot : of this server process; another one means that it was restarted
    renderer : OpenGL renderer and version
    scene_hash : name of everything that the scenario holds except its seed
    epoch_tai_ns : start of the scenario
    time_scale, frame : what times and positions are given in
    seed : of all noise
    window : requests of one client that may wait at the server; more are BUSY
    products : what a request may ask for
    bodies : spacecraft that a request may place, each with its movable joints
    lamps : that a request may dim
    scenarios : what Configure may choose; empty where the server has no folder of them
    status : what the server is doing
    compressions : what a Render may ask for as ``compression``
    """

    id: Id | None
    server: str
    boot: str
    renderer: str
    scenario: str
    scene_hash: str
    epoch_tai_ns: TaiNs
    time_scale: str
    frame: str
    seed: Seed
    window: int
    products: tuple[str, ...]
    cameras: tuple[CameraDescription, ...]
    bodies: dict[str, tuple[str, ...]]
    scenarios: tuple[str, ...] = ()
    lamps: tuple[str, ...] = ()
    status: ServerStatus | None = None
    compressions: tuple[str, ...] = ()


class Render(Message, frozen=True, kw_only=True):
    """A request for the images of one state, all cameras at once.

    id : chosen by the client; the same id returns the same reply
    tai_ns : mid-exposure of every camera; for a bolometer the time at which it is read
    cameras : at least one, each once
    bodies : spacecraft that are not listed follow the scenario's laws
    sun : the scenario's Sun if nil
    lamps : lamp to the fraction of its power; lamps that are not listed have full power
    moving : during the exposure, bodies move with constant velocity and angular velocity, and
        bodies that are not listed by their laws: DN and electrons show motion blur and rolling
        shutter, DN of a bolometer the lag of its time constant. Send every spacecraft in view, or
        none; otherwise the scene is fixed
    draw : distinguishes images of one time, such as those of a bracket: equal draws have equal
        noise, different draws independent noise
    seek : allow a time before that of the client's last request
    deadline_ms : from its arrival; then it is answered with DEADLINE, even while it is rendered.
        nil sets no limit
    compression : of the planes in the reply, one of Welcome's ``compressions``; empty for none. An
        older server ignores it: each plane states its compression
    thermal_from : for thermal cameras, ``thermal_state`` of an earlier image of this server:
        temperatures continue from there, with the mean of the light then and now. Empty for those
        of the steady state
    """

    id: Id
    tai_ns: TaiNs
    cameras: tuple[Shot, ...]
    bodies: dict[str, SentPose] = {}
    sun: SentSun | None = None
    seek: bool = False
    deadline_ms: DeadlineMs | None = None
    lamps: dict[str, Share] = {}
    moving: bool = False
    draw: Draw = 0
    compression: str = ""
    thermal_from: str = ""


class State(Message, frozen=True, kw_only=True):
    """The newest state of a free-running simulation; fields as in Render.

    The server renders the newest state, at its own rate. The first client that sends one owns the
    stream until it sends Bye, or is silent for 10 s.
    """

    id: Id
    tai_ns: TaiNs
    cameras: tuple[Shot, ...]
    bodies: dict[str, SentPose] = {}
    sun: SentSun | None = None
    lamps: dict[str, Share] = {}
    moving: bool = False
    draw: Draw = 0


class Next(Message, frozen=True, kw_only=True):
    """A request for the next images of the free-run stream; any client may send it.

    after : sequence of the last images that the client has; the reply has later ones
    deadline_ms : DEADLINE after this; at most 10 s, which is the default
    """

    id: Id
    after: Id = 0
    deadline_ms: DeadlineMs | None = None


class Configure(Message, frozen=True, kw_only=True):
    """Choose another scenario or seed, for every client of the server.

    scenario : one of Welcome's ``scenarios``; nil keeps the present one
    seed : nil takes the scenario's own
    """

    id: Id
    scenario: str | None = None
    seed: Seed | None = None


class Images(Message, frozen=True, kw_only=True):
    """Images and the state that they show; the payload frames of their planes follow.

    id : of the request; in free-run that of the Next
    sequence : counts the replies with images of this server, from 1
    state_hash : hash of the state that is shown, see State hash
    bodies : every spacecraft's pose as it was used, including those by the scenario's laws
    state_id : free-run: id of the State that is shown; nil in lock-step
    dropped : free-run: states replaced by newer ones, unrendered, since the images before
    """

    id: Id
    sequence: int
    boot: str
    scene_hash: str
    tai_ns: TaiNs
    state_hash: str
    seed: Seed
    bodies: dict[str, SentPose]
    images: tuple[CameraImage, ...]
    state_id: Id | None = None
    dropped: int = 0


class Error(Message, frozen=True, kw_only=True):
    """Why a request was refused.

    id : of the request, nil where it could not be read
    code : an ErrorCode; a client must expect new ones
    field : such as ``bodies.chaser.position_m``, or the scenario's ``[camera.nav] position``; empty
        where no field is the cause
    detail : one line that names field, value and what is allowed
    retryable : whether the same request may succeed later
    """

    id: Id | None
    code: str
    field: str
    detail: str
    retryable: bool = False


class Ping(Message, frozen=True, kw_only=True):
    """Asks for a sign of life."""

    id: Id


class Pong(Message, frozen=True, kw_only=True):
    """The reply to Ping. With id 0 also the first reply to a Hello that has to wait.

    status : what the server is doing
    """

    id: Id
    boot: str
    status: ServerStatus | None = None


class Stats(Message, frozen=True, kw_only=True):
    """Asks for the server's counters."""

    id: Id


class Statistics(Message, frozen=True, kw_only=True):
    """Counts since the server started.

    images : replies with rendered images
    repeated : replies sent again from the cache
    errors : Error replies; of these ``busy`` were BUSY
    lost : replies that could not be sent: the client had left or reads nothing
    waiting : requests in the queue now
    clients : heard of in the last 10 s
    """

    id: Id
    boot: str
    uptime_s: float
    images: int
    repeated: int
    errors: int
    busy: int
    lost: int
    waiting: int
    clients: int


class Bye(Message, frozen=True, kw_only=True):
    """The sender leaves. The server drops the client's replies and does not answer.

    boot : of the server that leaves; empty from a client
    """

    boot: str = ""


class Preview(Message, frozen=True, kw_only=True):
    """A small preview image on the monitor's PUB socket; one payload frame follows.

    The monitor never waits and may drop previews: gaps in ``number`` are those that a subscriber
    missed, and ``skipped`` counts images without a preview.

    number : counts the previews published, from 1
    skipped : images since the last preview, within the monitor's interval
    sequence : of the Images that it shows
    shape : height, width, 3 of 8-bit sRGB
    """

    number: int
    skipped: int
    sequence: int
    boot: str
    camera: str
    tai_ns: TaiNs
    shape: tuple[int, int, int]


REQUESTS: tuple[type[Message], ...] = (Hello, Render, State, Next, Configure, Ping, Stats, Bye)
REPLIES: tuple[type[Message], ...] = (Welcome, Images, Error, Pong, Statistics, Bye, Preview)
