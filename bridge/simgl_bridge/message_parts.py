"""Parts of messages of simgl/1: poses, a request to one camera, its image; see ``messages``."""

from __future__ import annotations

from msgspec import Struct

from simgl_bridge.value_ranges import (
    AngularVelocity,
    Attitude,
    ExposureTime,
    Gain,
    Position,
    SunPosition,
    Velocity,
)

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix = tuple[Vector, Vector, Vector]


class ServerStatus(Struct, frozen=True, kw_only=True):
    """What the server is doing; with the answers to Hello and Ping.

    state : ``starting``, ``ready``, ``drawing``, or ``lost`` while a renderer that died is started
        again
    detail : what is being prepared, or why the renderer was lost
    done, total : steps of that; total is 0 where they are not counted
    since_s : time in this state
    """

    state: str
    detail: str = ""
    done: int = 0
    total: int = 0
    since_s: float = 0.0


class CameraDescription(Struct, frozen=True, kw_only=True):
    """A camera of the server.

    cx, cy : principal point; the centre of the pixel in column i, row j is (i + 0.5, j + 0.5)
    exposure_time_s, gain_dn_per_e : used where a request gives none
    readout_time_s : from the end of exposure, of the middle row, to the last row read
    transport_latency_s : from there until flight software has the image
    lidar : whether it has a flash LIDAR, and with it the products of one
    thermal : whether it sees thermal radiation
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
    lidar: bool = False
    thermal: bool = False


class SentPose(Struct, frozen=True, kw_only=True):
    """Position, velocity, attitude and joints of a spacecraft, ICRF axes.

    position_m : at the request's ``tai_ns``; the server does not propagate it
    velocity_m_s : moves the spacecraft during the exposure if the request sets ``moving``; without
        ``moving`` it only affects the LVLH axes of this spacecraft and the aberration of stars in
        its cameras
    joints : movable joint to its angle [rad] or travel [m], within the limits of the model
    angular_velocity_rad_s : relative to ICRF, in body axes; used if the request sets ``moving``
    """

    position_m: Position
    velocity_m_s: Velocity
    q_icrf_from_body_xyzw: Attitude
    joints: dict[str, float] = {}
    angular_velocity_rad_s: AngularVelocity = (0.0, 0.0, 0.0)


class SentSun(Struct, frozen=True, kw_only=True):
    """Position of the Sun, in place of the scenario's.

    position_m : irradiance decreases with the distance squared. If the scenario gives the Sun by
        direction and irradiance, only the direction is used
    """

    position_m: SunPosition


class Shot(Struct, frozen=True, kw_only=True):
    """The request to one camera.

    camera : its name
    exposure_time_s, gain_dn_per_e : the camera's own values if not given
    products : "dn", "radiance", "electrons"; "depth" along the boresight and "range" from the
        pinhole, 0 without spacecraft; "part_id"; for a camera with a LIDAR "lidar_range" of one
        pulse, 0 if not detected, and its "lidar_electrons"; for a thermal camera "thermal_radiance"
        in its band and "temperature", 0 without spacecraft, but not "radiance" and "electrons"
    """

    camera: str
    exposure_time_s: ExposureTime | None = None
    gain_dn_per_e: Gain | None = None
    products: tuple[str, ...] = ("dn",)


class Plane(Struct, frozen=True, kw_only=True):
    """One payload frame: row-major, row 0 at the top of the image.

    dtype : as numpy writes it, little-endian, such as ``<u2``
    shape : height, width, and four channels of the radiance: the bands R, G, B, N, or those of the
        scenario and zeros beyond them
    compression : "zstd" where the frame is one of Zstandard (RFC 8878) that holds the pixels, with
        its content's size; empty for the pixels themselves
    """

    product: str
    dtype: str
    shape: tuple[int, ...]
    unit: str
    compression: str = ""


class CameraImage(Struct, frozen=True, kw_only=True):
    """The image of one camera, with the values that were used.

    position_m : of the pinhole
    q_camera_from_icrf_xyzw : camera axes are z boresight, x right, y down
    intrinsics : from camera axes to pixel coordinates
    exposure_start_tai_ns, exposure_end_tai_ns : half an exposure before and after mid-exposure; of
        a bolometer a time constant before it is read, and then
    readout_end_tai_ns : when the last row is read; not before its exposure ends
    available_tai_ns : when flight software receives the image
    sun_direction_icrf : unit, from the camera towards the Sun
    sun_irradiance_w_m2 : per channel at the camera, unobstructed
    saturated_pixels : at full scale or full well; nil without DN
    render_us : rendering time, read-back included
    planes : one payload frame each, in this order, after those of the cameras before
    part_names : part id to "spacecraft/part", where part ids were asked for
    interreflection : "off"; "exact"; or "quick": with joints moved and ``joint_light = "quick"``;
        empty from servers that do not tell
    thermal_state : of a thermal camera, hash of the temperatures of all spacecraft: of the steady
        state, or of the one before, the time since and the light now
    thermal_history : how these came about: "steady" for a request without ``thermal_from``
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
    interreflection: str = ""
    thermal_state: str = ""
    thermal_history: str = ""
