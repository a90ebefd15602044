"""The tables of a scenario file: every key, unit and limit.

The unit is part of the key. Unknown keys are errors. Bands are in the order R, G, B, N (600-700,
500-600, 400-500, 700-1000 nm).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from msgspec import Meta

from simgl.camera.camera_schema import CameraSettingsTable
from simgl.config.value_types import (
    BandValues,
    Fraction,
    NonNegative,
    Positive,
    Quaternion,
    Table,
    Vector,
)
from simgl.model_files.model_library import Axis, Unit
from simgl.model_files.surface_tables import PrimitiveTable
from simgl.sample_grid import MIN_SAMPLES
from simgl.scene.star_catalogue import FAINTEST


class EpochTable(Table, frozen=True, kw_only=True):
    """``[epoch]``: the time of the scene; orbits start here.

    utc : UTC in the years 1972 to 2099
    """

    utc: str


class SunTable(Table, frozen=True, kw_only=True):
    """``[sun]``: the Sun. Default: from the ephemeris, 1361 W/m2 at 1 au, 5772 K.

    irradiance_w_m2 : total, at 1 au; with a fixed direction, at the scene
    spectrum : "planck", or "astm_g173", the measured extraterrestrial one; only its shape is used
    temperature_k : temperature of the black body that gives the spectrum
    angular_diameter_deg : as seen from 1 au; default from the nominal solar radius
    direction_icrf : fixed direction towards the Sun, in place of the ephemeris
    limb_darkening : the disc is darker towards its edge; default true, but false if
        ``angular_diameter_deg`` or ``direction_icrf`` is given
    visible : draw the disc
    """

    irradiance_w_m2: NonNegative | None = None
    spectrum: Literal["planck", "astm_g173"] = "planck"
    temperature_k: Annotated[float, Meta(ge=1000.0, le=50000.0)] | None = None
    angular_diameter_deg: Annotated[float, Meta(gt=0.0, le=10.0)] | None = None
    direction_icrf: Vector | None = None
    limb_darkening: bool | None = None
    visible: bool = True


class BandsTable(Table, frozen=True, kw_only=True):
    """``[bands]``: the wavelengths of all light. Default: R, G, B and N.

    edges_nm : one to four bands from 300 to 2500 nm, without overlap
    filter : CSV file with the transmission of a filter in front of the lens; without ``edges_nm``
        there is one band, as wide as the curve
    names : names of the channels in files; default: the edges, such as "840-860nm"
    """

    edges_nm: Annotated[list[tuple[float, float]], Meta(min_length=1, max_length=4)] | None = None
    filter: str | None = None
    names: Annotated[list[str], Meta(min_length=1, max_length=4)] | None = None


class CloudsTable(Table, frozen=True, kw_only=True):
    """``[earth.clouds]``: the weather.

    cover : mean fraction of the Earth under cloud; 0 is a clear day
    seed : seed of the weather
    height_km : height of the cloud layer
    picture : path of an image of the full Earth, white for cloud, in place of the procedural
        weather
    optical_thickness : optical thickness of white cloud in ``picture``
    """

    cover: Fraction | None = None
    seed: Annotated[int, Meta(ge=0)] | None = None
    height_km: Annotated[float, Meta(gt=0.0, le=20.0)] = 4.0
    picture: str | None = None
    optical_thickness: Annotated[float, Meta(ge=1.0, le=100.0)] | None = None


class EarthTable(Table, frozen=True, kw_only=True):
    """``[earth]``: the Earth. Default: WGS84 with the shipped maps and clouds.

    shape : "wgs84", "sphere" or "none"
    radius_km : radius of the sphere
    albedo : Lambert albedo, one number or four bands, instead of maps and clouds
    longwave_w_m2 : with ``albedo``: long-wave exitance of the ground, as a black body without
        atmosphere; default: that of a climate
    atmosphere : "standard", "source" (the lighting study's own set) or "none"; default "standard"
        with WGS84 and "none" with a sphere. It acts over the ground, at the limb, in front of
        spacecraft inside it, and on sunlight that passes the Earth
    wind_m_s : wind over the sea, the same everywhere; default: about 7, varying with the location
    ice_and_snow : sea ice and snow by season; default true with the shipped land
    moonlight, airglow : light of the Moon and of the upper atmosphere on an Earth with maps at
        night; default true, but false if ``direction_icrf`` fixes the Sun
    airglow_waves : rms of the waves in the airglow over its mean; default 0: uniform
    aurora_kp : magnetic activity Kp of the aurora over the night side; default: no aurora
    clouds : the weather; default: a procedural one
    land_picture, water_picture, night_picture : paths of images in place of the shipped maps
    """

    shape: Literal["wgs84", "sphere", "none"] = "wgs84"
    radius_km: Positive | None = None
    albedo: BandValues | None = None
    longwave_w_m2: Annotated[float, Meta(gt=0.0, le=1000.0)] | None = None
    atmosphere: Literal["standard", "source", "none"] | None = None
    wind_m_s: Annotated[float, Meta(ge=0.0, le=40.0)] | None = None
    ice_and_snow: bool | None = None
    moonlight: bool | None = None
    airglow: bool | None = None
    airglow_waves: Annotated[float, Meta(ge=0.0, le=0.5)] | None = None
    aurora_kp: Annotated[float, Meta(ge=0.0, le=9.0)] | None = None
    clouds: CloudsTable | None = None
    land_picture: str | None = None
    water_picture: str | None = None
    night_picture: str | None = None


class SkyTable(Table, frozen=True, kw_only=True):
    """``[sky]``: the sky beyond the Earth.

    stars : draw the stars of the Hipparcos catalogue; default true, but false if
        ``direction_icrf`` fixes the Sun
    faintest_star_mag : the largest visual magnitude V drawn; default: that of the catalogue
    """

    stars: bool | None = None
    faintest_star_mag: Annotated[float, Meta(ge=-2.0, le=FAINTEST)] | None = None


class OrbitTable(Table, frozen=True, kw_only=True):
    """A two-body orbit.

    altitude_km : of a circular orbit, above the equatorial radius of 6378.137 km
    semi_major_axis_km : of an eccentric one, instead
    eccentricity : above 0 only with ``semi_major_axis_km``
    inclination_deg : to the equator of ICRF
    raan_deg : right ascension of the ascending node
    argument_of_perigee_deg : from the ascending node to the perigee
    true_anomaly_deg : position on the orbit at the epoch, from the perigee
    j2 : node, perigee and mean anomaly drift with the Earth's oblateness
    """

    # The limits lie within the Earth's gravity and refuse metres of any orbit.
    altitude_km: Annotated[float, Meta(gt=0.0, le=100_000.0)] | None = None
    semi_major_axis_km: Annotated[float, Meta(gt=0.0, le=1_000_000.0)] | None = None
    eccentricity: Annotated[float, Meta(ge=0.0, lt=1.0)] = 0.0
    inclination_deg: Annotated[float, Meta(ge=0.0, le=180.0)] = 0.0
    raan_deg: float = 0.0
    argument_of_perigee_deg: float = 0.0
    true_anomaly_deg: float = 0.0
    j2: bool = False


# From the epoch [s]: no instant that simgl knows is farther.
_InCentury = Annotated[float, Meta(ge=-4.1e9, le=4.1e9)]


class MotionFileTable(Table, frozen=True, kw_only=True):
    """A file of motion: CCSDS or STK, two-line elements, or a table (CSV).

    file : path of the file, from the folder of the scenario
    object : name of the object, if the file has several
    longest_gap_s : a longer step between samples is a gap; default: five times the median step
    interpolation_error_m : a trajectory with a larger estimated interpolation error is refused;
        default 1 m
    naif_id, frame : for a SPICE meta-kernel: the body of a trajectory, the axes of an attitude
    span_s : for a meta-kernel: start and end of the sampled time span, relative to the epoch
    """

    file: str
    object: str | None = None
    longest_gap_s: Positive | None = None
    interpolation_error_m: Positive | None = None
    naif_id: int | None = None
    frame: str | None = None
    span_s: tuple[_InCentury, _InCentury] | None = None


class PointAtTable(Table, frozen=True, kw_only=True):
    """Attitude that turns a body axis towards another spacecraft.

    target : name of the spacecraft
    axis_body : axis in body axes that points at it
    """

    target: str
    axis_body: Vector


class SpacecraftTable(Table, frozen=True, kw_only=True):
    """``[spacecraft.NAME]``: a model, a position and an attitude.

    model : name of a shipped model, path of a glTF/OBJ/STL file, or a primitive
    unit, unit_m : unit of a model file that is not in metres: a name, or metres per unit
    up_axis, forward_axis : the file's axes that become body -z and body x; default: the file's axes
        are the body axes; with ``up_axis`` alone, z points forward (x if z is up)
    orbit : a two-body orbit; one of orbit, trajectory, relative_to and position_icrf_m is needed
    trajectory : a file of positions; one in LVLH axes requires ``relative_to``
    relative_to : the spacecraft in whose LVLH axes the position is given
    position_lvlh_m : in those axes: x along the velocity, y against the orbit normal, z to nadir
    position_icrf_m : from the Earth's centre
    velocity_icrf_m_s, velocity_lvlh_m_s : velocity along a straight line in these axes, from the
        epoch on; default: fixed
    drift : Clohessy-Wiltshire motion from ``position_lvlh_m`` and ``velocity_lvlh_m_s`` at the
        epoch
    attitude : body axes along "lvlh" (default on an orbit) or "icrf" (default at a fixed position)
    quaternion_icrf_from_body_xyzw, quaternion_lvlh_from_body_xyzw : instead: a fixed unit
        quaternion, Hamilton, scalar last
    point_at : instead: turns a body axis towards another spacecraft
    attitude_file : instead: a file of attitudes
    joints_deg : fixed angles of hinges by name; default: as stored
    joints_m : fixed travels of rails by name; default: as stored
    joint_file : table with columns joint_NAME_deg and joint_NAME_m
    sun_tracking : names of drives that follow the Sun
    """

    model: str | PrimitiveTable | None = None
    unit: Unit | None = None
    unit_m: Positive | None = None
    up_axis: Axis | None = None
    forward_axis: Axis | None = None
    orbit: OrbitTable | None = None
    trajectory: str | MotionFileTable | None = None
    relative_to: str | None = None
    position_lvlh_m: Vector | None = None
    velocity_lvlh_m_s: Vector | None = None
    drift: bool = False
    position_icrf_m: Vector | None = None
    velocity_icrf_m_s: Vector | None = None
    attitude: Literal["lvlh", "icrf"] | None = None
    quaternion_icrf_from_body_xyzw: Quaternion | None = None
    quaternion_lvlh_from_body_xyzw: Quaternion | None = None
    point_at: PointAtTable | None = None
    attitude_file: str | MotionFileTable | None = None
    joints_deg: Annotated[dict[str, float], Meta(max_length=255)] | None = None
    joints_m: Annotated[dict[str, float], Meta(max_length=255)] | None = None
    joint_file: str | MotionFileTable | None = None
    sun_tracking: Annotated[tuple[str, ...], Meta(max_length=255)] = ()


class OrbitingTable(Table, frozen=True, kw_only=True):
    """A camera placed about a spacecraft by azimuth, elevation and range in its LVLH axes.

    target : the spacecraft, at which the camera looks
    azimuth_deg : 0 is behind the target, 90 above it
    elevation_deg : towards the orbit normal
    range_m : from the target's origin to the pinhole
    """

    target: str
    azimuth_deg: float
    elevation_deg: Annotated[float, Meta(ge=-89.9, le=89.9)] = 0.0
    range_m: Positive


class LookAtTable(Table, frozen=True, kw_only=True):
    """A point of a spacecraft: its origin, a ``keypoint``, or the centre of a ``part``.

    Keypoint and part are at their stored position in the model, whatever the joint angles.

    target : name of the spacecraft
    keypoint : name of a keypoint of its model
    part : name of a part of its model
    """

    target: str
    keypoint: str | None = None
    part: str | None = None


class LimbTable(Table, frozen=True, kw_only=True):
    """The Earth's limb, from a camera on a spacecraft.

    azimuth_deg : angle about nadir, from ahead towards the right
    tangent_height_km : height of the lowest point of the line of sight over the ellipsoid
    """

    azimuth_deg: float = 0.0
    tangent_height_km: Annotated[float, Meta(ge=0.0, le=10000.0)] = 0.0


class CameraTable(CameraSettingsTable, frozen=True, kw_only=True):
    """``[camera.NAME]``: the settings of a camera and its mount.

    on : the spacecraft that carries it; one of on, about and position_icrf_m is needed
    position_body_m, keypoint : of the pinhole on that spacecraft
    about : azimuth, elevation and range from a target
    position_icrf_m : of the pinhole, from the Earth's centre
    look_at : the spacecraft, or a point of it, that stays in the centre; otherwise ``limb``, or
        ``boresight`` in ``axes``, like ``up``
    limb : looks at the Earth's limb
    boresight : direction of view in ``axes``
    up : direction in ``axes`` towards the top of the image; default: -z, or x for a view along z in
        LVLH axes
    axes : "body" (default), "lvlh" (default with ``limb``) or "icrf" (at ``position_icrf_m``)
    keep_from_sun_deg : minimum angle to the Sun; the boresight turns away to keep it
    """

    on: str | None = None
    position_body_m: Vector | None = None
    keypoint: str | None = None
    about: OrbitingTable | None = None
    position_icrf_m: Vector | None = None
    look_at: str | LookAtTable | None = None
    limb: LimbTable | None = None
    boresight: Vector | None = None
    up: Vector | None = None
    axes: Literal["body", "lvlh", "icrf"] | None = None
    keep_from_sun_deg: Annotated[float, Meta(gt=0.0, lt=180.0)] | None = None


class ThermalTable(Table, frozen=True, kw_only=True):
    """``[thermal]``: computation of spacecraft temperatures for thermal cameras.

    patches : approximate number of patches per spacecraft
    step_s : time between two evaluations of the light in a temperature history
    """

    patches: Annotated[int, Meta(ge=20, le=6000)] = 1500
    step_s: Annotated[float, Meta(ge=0.01, le=3600.0)] = 30.0


class LampTable(Table, frozen=True, kw_only=True):
    """``[lamp.NAME]``: a spot light on a spacecraft, with its own shadows.

    on : the spacecraft that carries it
    position_body_m, keypoint : of the lamp on that spacecraft
    look_at : the spacecraft that the beam points at; otherwise ``boresight``
    boresight : direction of the beam in body axes
    half_angle_deg : half angle of the cone of uniform intensity
    edge_deg : width of the smooth decrease to zero around the cone
    power_w : optical power of the full beam: one number over all wavelengths with a spectrum,
        ``wavelength_nm``, ``temperature_k`` (of a black body) or ``band_shares``; or four, one for
        each band
    wavelength_nm : one line, or several with ``line_weights``; or a CSV file with a curve
    temperature_k : of a black body with the lamp's spectrum
    band_shares : fraction of the power in each band
    line_weights : power in each line, in any unit; equal by default
    radius_m : radius of the aperture. Parts closer along the beam, or within 1 cm, cast no shadow
    """

    on: str
    position_body_m: Vector | None = None
    keypoint: str | None = None
    look_at: str | None = None
    boresight: Vector | None = None
    half_angle_deg: Annotated[float, Meta(ge=0.1, le=75.0)]
    edge_deg: Annotated[float, Meta(ge=0.01, le=60.0)] = 2.0
    # The limits are checked by the loader, as for BandValues.
    power_w: float | tuple[float, float, float, float]
    temperature_k: Annotated[float, Meta(ge=1000.0, le=50000.0)] | None = None
    band_shares: tuple[Fraction, Fraction, Fraction, Fraction] | None = None
    wavelength_nm: float | list[float] | str | None = None
    line_weights: list[Annotated[float, Meta(gt=0.0)]] | None = None
    radius_m: Annotated[float, Meta(ge=0.001, le=1.0)] = 0.02


@dataclass(frozen=True, kw_only=True)
class UsabilityCriteria:
    """Limits for a usable image of a target.

    target, camera : names; None for the scenario's first ones
    min_target_pixels : minimum number of target pixels
    max_saturated_share : maximum fraction of saturated target pixels
    max_dark_share : maximum fraction of target pixels below the noise
    min_snr : minimum of the median signal-to-noise ratio of the target
    min_contrast : minimum contrast to the background, abs(t - b) / (t + b) of median electrons
    """

    target: str | None = None
    camera: str | None = None
    min_target_pixels: int = 25
    max_saturated_share: float = 0.05
    max_dark_share: float = 0.5
    min_snr: float = 10.0
    min_contrast: float = 0.1


class AssessTable(Table, frozen=True, kw_only=True):
    """``[assess]``: limits for a usable image of a target; see ``UsabilityCriteria``."""

    target: str | None = None
    camera: str | None = None
    min_target_pixels: Annotated[int, Meta(ge=1)] = UsabilityCriteria.min_target_pixels
    max_saturated_share: Fraction = UsabilityCriteria.max_saturated_share
    max_dark_share: Fraction = UsabilityCriteria.max_dark_share
    min_snr: NonNegative = UsabilityCriteria.min_snr
    min_contrast: Fraction = UsabilityCriteria.min_contrast


class RenderTable(Table, frozen=True, kw_only=True):
    """``[render]``: noise, samples and interreflection.

    seed : seed of all noise
    samples_per_pixel : mean number of geometry samples per pixel; default: automatic. More than 64
        make shadow maps finer, too
    inter_reflection : light between the surfaces of a spacecraft, and their occlusion of the Earth
    between_spacecraft : light from one spacecraft to another, at vertices
    gather : interreflection at vertices, or by rays from every sample of every pixel
    glossy_reflections : glossy surfaces reflect spacecraft by rays, not a uniform mean
    joint_light : interreflection with moved joints: "quick" by pairs of parts, "exact" by a bake of
        each pose
    """

    seed: Annotated[int, Meta(ge=0, le=2**32 - 1)] = 0
    samples_per_pixel: Annotated[int, Meta(ge=MIN_SAMPLES, le=256)] | None = None
    inter_reflection: bool = True
    between_spacecraft: bool = False
    gather: Literal["vertex", "pixel"] = "vertex"
    glossy_reflections: bool = False
    joint_light: Literal["exact", "quick"] = "exact"
