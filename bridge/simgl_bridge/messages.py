"""What client and server say to each other: the one schema of the protocol simgl/1.

    client                                server
    Hello      who, which versions   ->
                                     <-   Welcome   cameras, bodies, window, scene hash, boot id
    Render     time, poses, cameras  ->
                                     <-   Images    what was used, state hash, then raw planes
    State      the newest state      ->             free-run: no reply unless it is refused
    Next       a picture after n     ->
                                     <-   Images    of the newest state shown, once there is one
    Configure  scenario, seed        ->
                                     <-   Welcome   of the new scene
    Ping, Stats                      ->
                                     <-   Pong, Statistics
    Bye                              ->
                                     <-   Bye       the server ends

Any request may be answered by an Error instead. Units are in the names; positions are Earth-centred
in ICRF axes, times TAI nanoseconds since 1970-01-01T00:00:00 TAI, quaternions Hamilton, scalar
last. A receiver ignores fields that it does not know, so that minor versions can add some. Types
here carry no limits; ``checks.py`` checks values and names the field. ``docs/protocol.md`` is made
from this file.
"""

from __future__ import annotations

from enum import StrEnum

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
    NO_JOINT = "NO_JOINT"
    """The spacecraft's model has no such movable joint."""
    NO_LAMP = "NO_LAMP"
    """The scenario has no such lamp."""
    NO_SCENARIO = "NO_SCENARIO"
    """There is no such scenario in the server's folder, or the server has none to choose from."""
    BAD_SCENE = "BAD_SCENE"
    """Every field is possible, the scene is not: a camera inside a body, for example."""
    TIME_BACKWARDS = "TIME_BACKWARDS"
    """Earlier than this client's last request, and ``seek`` was not set."""
    BUSY = "BUSY"
    """More requests of this client wait than its window allows; send it again later."""
    DEADLINE = "DEADLINE"
    """The request waited longer than its own deadline and was not rendered."""
    NOT_OWNER = "NOT_OWNER"
    """Another client streams states or chose the scenario, and has not left."""
    GPU_LOST = "GPU_LOST"
    """The OpenGL context failed; it is opened anew, and the same request may succeed."""
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


class CameraDescription(Struct, frozen=True, kw_only=True):
    """A camera as the server offers it.

    cx, cy : principal point; the centre of the pixel in column i, row j is (i + 0.5, j + 0.5)
    exposure_time_s, gain_dn_per_e : used where a request gives none
    readout_time_s : from the end of exposure to the last row read
    transport_latency_s : from there to where flight software has the image
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
    readout_time_s: float
    transport_latency_s: float


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
    """

    id: int | None
    server: str
    boot: str
    renderer: str
    scenario: str
    scene_hash: str
    epoch_tai_ns: int
    time_scale: str
    frame: str
    seed: int
    window: int
    products: tuple[str, ...]
    cameras: tuple[CameraDescription, ...]
    bodies: dict[str, tuple[str, ...]]
    scenarios: tuple[str, ...] = ()
    lamps: tuple[str, ...] = ()


class SentPose(Struct, frozen=True, kw_only=True):
    """Where a spacecraft is and how it is turned, ICRF axes.

    joints : movable joint to its angle [rad] or travel [m]
    angular_velocity_rad_s : against the ICRF axes, in body axes; shows where the request says
        ``moving``
    """

    position_m: Vector
    velocity_m_s: Vector
    q_icrf_from_body_xyzw: Quaternion
    joints: dict[str, float] = {}
    angular_velocity_rad_s: Vector = (0.0, 0.0, 0.0)


class SentSun(Struct, frozen=True, kw_only=True):
    """Where the Sun is, instead of where the scenario has it.

    position_m : its light falls with the distance squared. A scenario whose Sun is given by a
        direction and an irradiance takes the direction alone
    """

    position_m: Vector


class Shot(Struct, frozen=True, kw_only=True):
    """What one camera is asked for; None takes the camera's own value.

    products : of "dn", "radiance", "electrons", "depth", "part_id"
    """

    camera: str
    exposure_time_s: float | None = None
    gain_dn_per_e: float | None = None
    products: tuple[str, ...] = ("dn",)


class Render(Message, frozen=True, kw_only=True):
    """A request for the pictures of one state, all cameras at once.

    id : chosen by the client, 0 or more; the same id again brings the same reply again
    tai_ns : mid-exposure of every camera
    cameras : at least one, each once
    bodies : spacecraft left out follow the scenario's own laws
    sun : None leaves it to the scenario
    lamps : lamp to the share of its power that it burns with, 0 to 1; those left out burn fully
    moving : while the shutter is open bodies go straight on with their velocity and turn with
        their angular velocity, those left out by their laws: DN and electrons show motion blur and
        the rolling of the shutter. Send every spacecraft in view, or none; otherwise all stand
        still
    seek : allow a time before that of the client's last request
    deadline_ms : a request that has waited longer is answered with DEADLINE; None waits
    """

    id: int
    tai_ns: int
    cameras: tuple[Shot, ...]
    bodies: dict[str, SentPose] = {}
    sun: SentSun | None = None
    seek: bool = False
    deadline_ms: int | None = None
    lamps: dict[str, float] = {}
    moving: bool = False


class State(Message, frozen=True, kw_only=True):
    """The newest state of a free-running simulation; fields as in Render.

    The server shows the newest state that it has, at its own rate. The first client that sends
    one owns the stream until it says Bye, or is silent for 10 s.
    """

    id: int
    tai_ns: int
    cameras: tuple[Shot, ...]
    bodies: dict[str, SentPose] = {}
    sun: SentSun | None = None
    lamps: dict[str, float] = {}
    moving: bool = False


class Next(Message, frozen=True, kw_only=True):
    """A request for the next picture of the free-running stream; any client may ask.

    after : sequence of the last picture that the client has; the reply is a later one
    deadline_ms : DEADLINE after this; the most, and the default, is 10 s
    """

    id: int
    after: int = 0
    deadline_ms: int | None = None


class Configure(Message, frozen=True, kw_only=True):
    """Another scenario or seed, for every client of the server.

    scenario : one of Welcome's ``scenarios``; None keeps the present one
    seed : None takes the scenario's own
    """

    id: int
    scenario: str | None = None
    seed: int | None = None


class Plane(Struct, frozen=True, kw_only=True):
    """One payload frame: row-major, row 0 at the top of the picture.

    dtype : as numpy writes it, little-endian, such as ``<u2``
    shape : height, width, and bands R, G, B, N for the radiance
    """

    product: str
    dtype: str
    shape: tuple[int, ...]
    unit: str


class CameraImage(Struct, frozen=True, kw_only=True):
    """What one camera took, with the values that were used.

    position_m : of the pinhole
    q_camera_from_icrf_xyzw : camera axes are z boresight, x right, y down
    intrinsics : from camera axes to pixel coordinates
    exposure_start_tai_ns, exposure_end_tai_ns : half an exposure before and after mid-exposure
    readout_end_tai_ns : when the last row is read
    available_tai_ns : when flight software has the image
    sun_direction_icrf : unit, from the camera towards the Sun
    sun_irradiance_w_m2 : per band R, G, B, N at the camera, unobstructed
    saturated_pixels : at full scale or full well; None without digital numbers
    render_us : time taken by the picture, reading included
    planes : one payload frame each, in this order, after those of the cameras before
    part_names : part id to "spacecraft/part", where part ids were asked for
    """

    camera: str
    position_m: Vector
    q_camera_from_icrf_xyzw: Quaternion
    intrinsics: Matrix
    exposure_time_s: float
    gain_dn_per_e: float
    exposure_start_tai_ns: int
    exposure_end_tai_ns: int
    readout_end_tai_ns: int
    available_tai_ns: int
    sun_direction_icrf: Vector
    sun_irradiance_w_m2: Quaternion
    saturated_pixels: int | None
    render_us: int
    planes: tuple[Plane, ...]
    part_names: dict[int, str] = {}


class Images(Message, frozen=True, kw_only=True):
    """Pictures and what they are pictures of; the payload frames of their planes follow.

    id : of the request; in free-run that of the Next
    sequence : of replies with pictures made by this server, from 1
    state_hash : name of the state that is shown, made as under State hash
    bodies : every spacecraft's pose as it was used, those of the scenario's laws included
    state_id : free-run: id of the State that is shown; None in lock-step
    dropped : free-run: states that were replaced by newer ones, unseen, since the picture before
    """

    id: int
    sequence: int
    boot: str
    scene_hash: str
    tai_ns: int
    state_hash: str
    seed: int
    bodies: dict[str, SentPose]
    images: tuple[CameraImage, ...]
    state_id: int | None = None
    dropped: int = 0


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


class Stats(Message, frozen=True, kw_only=True):
    """How is it going?"""

    id: int


class Statistics(Message, frozen=True, kw_only=True):
    """Counts since the server started.

    images : replies with pictures that were rendered
    repeated : replies sent again from memory
    errors : Error replies; of these ``busy`` were BUSY
    lost : replies that could not be handed over: the client had left or reads nothing
    waiting : requests in the queue now
    clients : heard of in the last 10 s
    """

    id: int
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
    """The sender leaves. A server forgets the client's replies and does not answer.

    boot : of the server that leaves; empty from a client
    """

    boot: str = ""


class Preview(Message, frozen=True, kw_only=True):
    """A small picture for people on the monitor's PUB socket; one payload frame follows.

    The monitor never waits and may drop any of them: gaps in ``number`` are the ones that a
    subscriber missed, and ``skipped`` counts pictures that no preview was made of.

    number : of previews published, from 1
    skipped : pictures since the last preview that went by within the monitor's interval
    sequence : of the Images that it was made from
    shape : height, width, 3 of 8-bit sRGB
    """

    number: int
    skipped: int
    sequence: int
    boot: str
    camera: str
    tai_ns: int
    shape: tuple[int, int, int]
