"""What a scenario file may say: every table, key, unit and limit.

The unit is part of the key. Unknown keys are errors. Bands are in the order R, G, B, N (600-700,
500-600, 400-500, 700-1000 nm).
"""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from simgl.lattice import FEWEST
from simgl.scenario.optics_schema import LidarTable, OpticsTable
from simgl.scenario.table import Fraction, NonNegative, Positive, Table
from simgl.scene.layers import SMOOTHEST

Roughness = Annotated[float, Meta(ge=SMOOTHEST, le=1.0)]
Vector = tuple[float, float, float]
# One number for all bands, or four. The limits 0..1 are checked by the loader: msgspec 0.22 mixes
# up the limits of a number with the length of a tuple where the two form a union.
BandValues = float | tuple[float, float, float, float]
Quaternion = tuple[float, float, float, float]


class EpochTable(Table, frozen=True, kw_only=True):
    """``[epoch]``: the time of the scene; orbits start here."""

    utc: str


class SunTable(Table, frozen=True, kw_only=True):
    """``[sun]``: omitted, the ephemeris Sun with 1361 W/m2 at 1 au and 5772 K.

    irradiance_w_m2 : total, at 1 au; with a fixed direction, at the scene
    spectrum : "planck", or "astm_g173", the measured one outside the air; only its shape counts
    temperature_k : of the black body that gives the spectrum
    angular_diameter_deg : as seen from 1 au; default from the nominal solar radius
    direction_icrf : fixes the direction towards the Sun by hand
    limb_darkening : the disc is darker towards its edge; omitted, it is, unless
        ``angular_diameter_deg`` or ``direction_icrf`` is given, whose disc is uniform
    visible : draw the disc
    """

    irradiance_w_m2: NonNegative | None = None
    spectrum: Literal["planck", "astm_g173"] = "planck"
    temperature_k: Annotated[float, Meta(ge=1000.0, le=50000.0)] | None = None
    angular_diameter_deg: Annotated[float, Meta(gt=0.0, le=10.0)] | None = None
    direction_icrf: Vector | None = None
    limb_darkening: bool | None = None
    visible: bool = True


class EarthTable(Table, frozen=True, kw_only=True):
    """``[earth]``: omitted, WGS84 with the shipped day map.

    shape : "wgs84", "sphere" or "none"
    radius_km : of the sphere
    albedo : Lambert, one number or four bands, instead of the day map
    atmosphere : "standard", "source" (the lighting study's own set) or "none"; default "standard"
        with WGS84 and "none" with a sphere. Sunlight that grazes it on its way to a spacecraft is
        dimmed and reddened; the picture of the Earth does not show it yet
    """

    shape: Literal["wgs84", "sphere", "none"] = "wgs84"
    radius_km: Positive | None = None
    albedo: BandValues | None = None
    atmosphere: Literal["standard", "source", "none"] | None = None


class CoatTable(Table, frozen=True, kw_only=True):
    """A clear layer of index 1.5: cover glass, varnish."""

    strength: Fraction = 1.0
    roughness: Roughness = SMOOTHEST


class CellsTable(Table, frozen=True, kw_only=True):
    """Solar cells laid side by side, seen along the body axis nearest to the normal.

    Columns and fingers repeat along the first of the other two axes, rows and busbars along the
    second, from the origin.
    """

    width_m: Positive
    height_m: Positive
    gap_m: NonNegative = 0.0
    finger_pitch_m: Positive = 1.0
    finger_width_m: NonNegative = 0.0
    busbar_pitch_m: Positive = 1.0
    busbar_width_m: NonNegative = 0.0
    gap_reflectance: BandValues = 0.0
    metal_reflectance: BandValues = 0.0


class CrinkleTable(Table, frozen=True, kw_only=True):
    """Facets of a crumpled foil: their mean spacing, and the width of their slopes."""

    facet_size_m: Positive
    slope: Fraction


class MaterialTable(Table, frozen=True, kw_only=True):
    """A material; without roughness it is Lambertian.

    conserving : keeps the light that meets several microfacets, which the model of glTF loses
    emission_w_m2_sr : radiance of its own, one number or four bands, 0 or more
    """

    reflectance: BandValues
    metallic: Fraction = 0.0
    roughness: Roughness | None = None
    conserving: bool = False
    coat: CoatTable | None = None
    cells: CellsTable | None = None
    crinkle: CrinkleTable | None = None
    emission_w_m2_sr: BandValues = 0.0


class FinishTable(MaterialTable, frozen=True, kw_only=True):
    """A finish in ``simgl/data/finishes.toml``: a material with where its numbers come from."""

    source: str


class PlateTable(Table, frozen=True, kw_only=True):
    """A thin plate facing +z of its body frame, centred on the origin."""

    width_m: Positive
    height_m: Positive
    material: str | MaterialTable


class SphereTable(Table, frozen=True, kw_only=True):
    """A sphere about the body origin."""

    radius_m: Positive
    material: str | MaterialTable


class BoxTable(Table, frozen=True, kw_only=True):
    """A box about the body origin; edges along x, y, z."""

    size_m: tuple[Positive, Positive, Positive]
    material: str | MaterialTable


class CylinderTable(Table, frozen=True, kw_only=True):
    """A closed cylinder along z about the body origin."""

    radius_m: Positive
    length_m: Positive
    material: str | MaterialTable


class PrimitiveTable(Table, frozen=True, kw_only=True):
    """Exactly one calibration shape."""

    plate: PlateTable | None = None
    sphere: SphereTable | None = None
    box: BoxTable | None = None
    cylinder: CylinderTable | None = None


class OrbitTable(Table, frozen=True, kw_only=True):
    """A two-body orbit; size by ``altitude_km`` (circular) or ``semi_major_axis_km``.

    j2 : node, perigee and mean anomaly drift with the Earth's oblateness
    """

    altitude_km: Positive | None = None
    semi_major_axis_km: Positive | None = None
    eccentricity: Annotated[float, Meta(ge=0.0, lt=1.0)] = 0.0
    inclination_deg: Annotated[float, Meta(ge=0.0, le=180.0)] = 0.0
    raan_deg: float = 0.0
    argument_of_perigee_deg: float = 0.0
    true_anomaly_deg: float = 0.0
    j2: bool = False


class MotionFileTable(Table, frozen=True, kw_only=True):
    """A file of motion: CCSDS OEM or AEM, two-line elements, or a table (CSV).

    object : which one, where the file holds several
    longest_gap_s : a longer step between samples is a gap; default five times the median step
    interpolation_error_m : a curve through the samples that may be off by more is refused
    """

    file: str
    object: str | None = None
    longest_gap_s: Positive | None = None
    interpolation_error_m: Positive = 1.0


class PointAtTable(Table, frozen=True, kw_only=True):
    """Attitude that turns a body axis towards another spacecraft."""

    target: str
    axis_body: Vector


class SpacecraftTable(Table, frozen=True, kw_only=True):
    """``[spacecraft.NAME]``: a model, a place and an attitude.

    model : name of a shipped model, path of a glTF/OBJ/STL file, or a primitive
    unit_m : metres per unit of a model file that does not say it (OBJ, STL)
    place : exactly one of ``orbit``, ``trajectory`` (a file), ``relative_to`` with
        ``position_lvlh_m``, ``position_icrf_m``; a file in LVLH axes goes with ``relative_to``
    drift : from ``position_lvlh_m`` and ``velocity_lvlh_m_s`` at the epoch by Clohessy-Wiltshire;
        omitted, it stays at its place
    attitude : "lvlh" (default on an orbit), "icrf" (default at a fixed place), or one of the keys
        ``quaternion_icrf_from_body_xyzw``, ``quaternion_lvlh_from_body_xyzw``, ``point_at``,
        ``attitude_file``
    joints : ``joints_deg`` by name; ``joint_file``, a table with columns joint_NAME_deg;
        ``sun_tracking``, drives that follow the Sun; a joint in none of them is as stored
    """

    model: str | PrimitiveTable
    unit_m: Positive | None = None
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
    joints_deg: dict[str, float] | None = None
    joint_file: str | MotionFileTable | None = None
    sun_tracking: tuple[str, ...] = ()


class OrbitingTable(Table, frozen=True, kw_only=True):
    """A camera placed about a spacecraft by azimuth, elevation and range in its LVLH axes."""

    target: str
    azimuth_deg: float
    elevation_deg: Annotated[float, Meta(ge=-89.9, le=89.9)] = 0.0
    range_m: Positive


class CameraPresetTable(Table, frozen=True, kw_only=True):
    """A camera preset file, ``NAME.toml``: every value that a detector needs, with its source."""

    source: str
    width_px: Annotated[int, Meta(ge=1, le=16384)]
    height_px: Annotated[int, Meta(ge=1, le=16384)]
    pixel_pitch_um: Positive
    qe_wavelength_nm: tuple[float, ...]
    qe: tuple[Fraction, ...]
    full_well_e: Positive
    read_noise_e: NonNegative
    bits: Annotated[int, Meta(ge=8, le=16)]
    pedestal_dn: NonNegative
    gain_e_per_dn: Positive
    optics: OpticsTable | None = None


class CameraTable(Table, frozen=True, kw_only=True):
    """``[camera.NAME]``: a preset, changed where a key is given, on a mount.

    mount : ``on`` (a spacecraft), or ``about`` (azimuth, elevation, range), or ``position_icrf_m``
    look_at : the spacecraft kept in the centre; else ``boresight`` in body or ICRF axes
    quantum_efficiency : electrons per photon, one number or four bands
    """

    preset: str = "mt9m034"
    on: str | None = None
    position_body_m: Vector | None = None
    keypoint: str | None = None
    about: OrbitingTable | None = None
    position_icrf_m: Vector | None = None
    look_at: str | None = None
    boresight: Vector | None = None
    up: Vector | None = None
    focal_length_mm: Positive = 13.0
    # No lens in air is faster than f/0.5 (Abbe's sine condition).
    f_number: Annotated[float, Meta(ge=0.5)] = 4.0
    exposure_time_s: Annotated[float, Meta(gt=0.0, le=3600.0)] = 0.0005
    transmission: BandValues = 1.0
    optics: OpticsTable | None = None
    lidar: LidarTable | None = None
    width_px: Annotated[int, Meta(ge=1, le=16384)] | None = None
    height_px: Annotated[int, Meta(ge=1, le=16384)] | None = None
    pixel_pitch_um: Positive | None = None
    quantum_efficiency: BandValues | None = None
    full_well_e: Positive | None = None
    read_noise_e: NonNegative | None = None
    bits: Annotated[int, Meta(ge=8, le=16)] | None = None
    pedestal_dn: NonNegative | None = None
    gain_e_per_dn: Positive | None = None


class LampTable(Table, frozen=True, kw_only=True):
    """``[lamp.NAME]``: a spot light on a spacecraft, with its own shadows.

    on : the spacecraft that carries it, at ``position_body_m`` or a ``keypoint``
    look_at : the spacecraft that the beam follows; else ``boresight`` in body axes
    half_angle_deg : of the cone within which the intensity is uniform
    edge_deg : width of the smooth fall to zero around the cone
    power_w : optical, radiated in the whole beam: one number over all wavelengths, split over the
        bands by ``temperature_k`` (of a black body) or ``band_shares``; or four, one for each band
    radius_m : of the aperture. Nothing closer along the beam, and nothing within 1 cm, casts
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
    radius_m: Annotated[float, Meta(ge=0.001, le=1.0)] = 0.02


class RenderTable(Table, frozen=True, kw_only=True):
    """``[render]``: noise seed and mean geometry samples per pixel (omitted: chosen by cost).

    inter_reflection : light between the surfaces of a spacecraft, and the Earth hidden by them
    """

    seed: Annotated[int, Meta(ge=0, le=2**32 - 1)] = 0
    samples_per_pixel: Annotated[int, Meta(ge=FEWEST, le=256)] | None = None
    inter_reflection: bool = True
