"""Schema of preset files and ``[camera.NAME]`` tables; the unit is part of the key."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from simgl.camera.lens_schema import LidarTable, OpticsTable
from simgl.config.value_types import BandValues, Fraction, NonNegative, Positive, Table


class CurveTable(Table, frozen=True, kw_only=True):
    """A curve over wavelength, linear between its points and 0 outside.

    wavelength_nm : increasing
    value : one for each wavelength
    csv : instead of both: a CSV file of wavelength in nm and value
    """

    wavelength_nm: Annotated[tuple[float, ...], Meta(max_length=100_000)] | None = None
    value: Annotated[tuple[Fraction, ...], Meta(max_length=100_000)] | None = None
    csv: str | None = None


class FiltersTable(Table, frozen=True, kw_only=True):
    """Transmission of a colour detector's pixel filters.

    red, green, blue : transmission of the pixels of this colour
    """

    red: CurveTable
    green: CurveTable
    blue: CurveTable


class ParticlesTable(Table, frozen=True, kw_only=True):
    """Charged particles through the detector.

    flux_cm2_s : through the detector plane from both sides; half of an isotropic, omnidirectional
        flux
    depth_um : thickness of the layer whose charge is collected
    charge_e_um : charge released along the path; 80 for minimum-ionising particles, 630 for
        50 MeV protons
    """

    flux_cm2_s: NonNegative
    depth_um: Positive = 5.0
    charge_e_um: Positive = 80.0


class EventSensorTable(Table, frozen=True, kw_only=True):
    """``[camera.NAME.event_sensor]``: makes the camera an event camera.

    threshold_on, threshold_off : change of the logarithm of the photo-current that makes an event
    threshold_spread : rms relative variation of the thresholds from pixel to pixel
    refractory_us : time after an event for which a pixel is blind
    leak_hz : rate of ON events of a pixel in constant light
    shot_noise_hz : rate of events of a pixel in darkness
    """

    threshold_on: Annotated[float, Meta(ge=0.01, le=10.0)] = 0.2
    threshold_off: Annotated[float, Meta(ge=0.01, le=10.0)] = 0.2
    threshold_spread: Annotated[float, Meta(ge=0.0, le=0.5)] = 0.1
    refractory_us: Annotated[float, Meta(ge=0.0, le=1e6)] = 100.0
    leak_hz: Annotated[float, Meta(ge=0.0, le=1e4)] = 0.1
    shot_noise_hz: Annotated[float, Meta(ge=0.0, le=1e4)] = 1.0


class ThermalCameraTable(Table, frozen=True, kw_only=True):
    """``[camera.NAME.thermal]``: the camera sees thermal radiation instead of visible light.

    detector : a preset with optics, number and pitch of pixels; the keys below override it
    band_um : lowest and highest wavelength
    transmission : transmission of the optics; they emit what they absorb
    f_number : focal length over aperture
    optics_temperature_k : temperature of the optics
    netd_mk : NETD of a bolometer at 300 K
    range_k : bolometer: temperatures of black bodies at its lowest and highest DN
    integration_time_ms : integration time of a photon detector
    minutes_since_shutter : time since the last offset correction of a bolometer
    """

    detector: str
    band_um: tuple[Positive, Positive] | None = None
    f_number: Annotated[float, Meta(ge=0.5)] | None = None
    transmission: Annotated[float, Meta(gt=0.0, le=1.0)] | None = None
    optics_temperature_k: Annotated[float, Meta(ge=2.0, le=400.0)] | None = None
    netd_mk: NonNegative | None = None
    range_k: tuple[Positive, Positive] | None = None
    integration_time_ms: Annotated[float, Meta(gt=0.0, le=1000.0)] | None = None
    minutes_since_shutter: Annotated[float, Meta(ge=0.0, le=1e5)] = 0.0


Bits = Annotated[int, Meta(ge=8, le=16)]
MAX_EDGE = 16384
Pixels = Annotated[int, Meta(ge=1, le=MAX_EDGE)]


class DetectorTable(Table, frozen=True, kw_only=True):
    """Detector keys that preset files and ``[camera.NAME]`` share.

    width_px, height_px : size of the image
    pixel_pitch_um : from pixel to pixel
    fill_factor : fraction of a pixel's light that reaches the photodiode
    full_well_e : electrons at which a pixel is full
    read_noise_e : rms of the electronics, new in every frame
    bits : of the converter
    pedestal_dn : DN of a pixel without charge
    analogue_gain : factor before the converter
    gain_e_per_dn : at an analogue gain of 1
    mosaic : colours of 2 x 2 pixels row by row from the top left; "mono" for no filters
    dark_current_e_s, hot_current_e_s : at 300 K
    temperature_k : of the detector; dark current follows it
    dsnu_e : fixed rms offset of pixels
    prnu : rms variation of the pixels' response, fraction of its mean
    dead_pixels, hot_pixels : fraction of all pixels
    row_pattern_e, column_pattern_e : fixed rms offset of rows and columns
    row_noise_e : rms offset of rows, new in every frame
    blooming : fraction of the charge beyond the full well that flows along the column
    shutter : "global", or "rolling": rows one after another, each ``row_time_us`` later
    row_time_us : between the starts of two rows of a rolling shutter
    particles : charged particles through the detector
    """

    width_px: Pixels | None = None
    height_px: Pixels | None = None
    pixel_pitch_um: Positive | None = None
    fill_factor: Annotated[float, Meta(gt=0.0, le=1.0)] | None = None
    full_well_e: Positive | None = None
    read_noise_e: NonNegative | None = None
    bits: Bits | None = None
    pedestal_dn: NonNegative | None = None
    gain_e_per_dn: Positive | None = None
    analogue_gain: Positive | None = None
    mosaic: Literal["mono", "RGGB", "BGGR", "GRBG", "GBRG"] | None = None
    dark_current_e_s: NonNegative | None = None
    temperature_k: Annotated[float, Meta(ge=100.0, le=400.0)] | None = None
    prnu: Fraction | None = None
    dead_pixels: Fraction | None = None
    dsnu_e: NonNegative | None = None
    row_pattern_e: NonNegative | None = None
    column_pattern_e: NonNegative | None = None
    hot_pixels: Fraction | None = None
    hot_current_e_s: NonNegative | None = None
    row_noise_e: NonNegative | None = None
    blooming: Fraction | None = None
    shutter: Literal["global", "rolling"] | None = None
    row_time_us: Positive | None = None
    particles: ParticlesTable | None = None


class CameraPresetTable(DetectorTable, frozen=True, kw_only=True):
    """A camera preset file, ``NAME.toml``; omitted effects are absent.

    source : origin of the numbers, and which of them are assumptions
    qe : electrons per photon of a pixel without filter
    window : transmission of cover glass and infrared filter
    micro_lens : fraction of the light that reaches the photodiode through the micro-lens
    filters : filters of a colour detector
    optics : imperfections of a lens
    """

    source: str
    width_px: Pixels
    height_px: Pixels
    pixel_pitch_um: Positive
    qe: CurveTable
    window: CurveTable | None = None
    micro_lens: CurveTable | None = None
    filters: FiltersTable | None = None
    full_well_e: Positive
    read_noise_e: NonNegative
    bits: Bits
    pedestal_dn: NonNegative
    gain_e_per_dn: Positive
    optics: OpticsTable | None = None


class CalibrationTable(Table, frozen=True, kw_only=True):
    """A calibration file.

    file : path of the file, from the folder of the scenario
    camera : selects one of several cameras in it
    """

    file: str
    camera: str | None = None


class CameraSettingsTable(DetectorTable, frozen=True, kw_only=True):
    """``[camera.NAME]``: a preset, and keys that override it.

    preset : name of a shipped preset, or path of a preset file
    focal_length_mm : default 13; may be given in pixels or by a calibration instead
    focal_length_px : one number, or two along the image's rows and columns
    principal_point_px : column and row; the centre of the first pixel is (0.5, 0.5)
    skew_px : shift to the right of a point 45 deg below the boresight
    calibration : file of OpenCV, ROS or Kalibr with all of these, image size and distortion
    f_number : focal length over aperture
    exposure_time_s : its middle is the epoch of the image
    readout_time_s : from the end of the exposure, of the middle row, until the image is read
    transport_latency_s : from there until flight software has the image
    transmission : of the lens, one number or four bands
    optics : imperfections of the lens
    lidar : a flash LIDAR that receives through this camera
    event_sensor : makes it an event camera
    quantum_efficiency : electrons per photon without filters, one number or four bands
    thermal : makes it a thermal camera; keys of visible-light cameras are then refused
    serial : seed of the camera's fixed pattern; default: from its name
    """

    preset: str = "mt9m034"
    focal_length_mm: Positive | None = None
    focal_length_px: float | tuple[float, float] | None = None
    principal_point_px: tuple[float, float] | None = None
    skew_px: float | None = None
    calibration: str | CalibrationTable | None = None
    # No lens in air is faster than f/0.5 (Abbe's sine condition).
    f_number: Annotated[float, Meta(ge=0.5)] = 4.0
    exposure_time_s: Annotated[float, Meta(gt=0.0, le=3600.0)] = 0.0005
    readout_time_s: Annotated[float, Meta(ge=0.0, le=3600.0)] = 0.0
    transport_latency_s: Annotated[float, Meta(ge=0.0, le=3600.0)] = 0.0
    transmission: BandValues = 1.0
    optics: OpticsTable | None = None
    lidar: LidarTable | None = None
    event_sensor: EventSensorTable | None = None
    thermal: ThermalCameraTable | None = None
    quantum_efficiency: BandValues | None = None
    serial: Annotated[int, Meta(ge=0, le=2**32 - 1)] | None = None
