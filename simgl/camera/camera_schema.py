"""What files may say about a camera: its preset, its detector and its settings.

The unit is part of the key. Unknown keys are errors.
"""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from simgl.camera.lens_schema import LidarTable, OpticsTable
from simgl.config.value_types import BandValues, Fraction, NonNegative, Positive, Table


class CurveTable(Table, frozen=True, kw_only=True):
    """A curve over the wavelength, linear between its points and 0 outside.

    Either both lists, or the path of a CSV file with two columns, wavelength in nm and value.
    """

    wavelength_nm: tuple[float, ...] | None = None
    value: tuple[Fraction, ...] | None = None
    csv: str | None = None


class FiltersTable(Table, frozen=True, kw_only=True):
    """Transmission of the filters on the pixels of a colour detector."""

    red: CurveTable
    green: CurveTable
    blue: CurveTable


class ParticlesTable(Table, frozen=True, kw_only=True):
    """Charged particles through the detector.

    flux_cm2_s : through its plane, both sides; half of an isotropic, omnidirectional flux
    depth_um : of the layer whose charge is collected
    charge_e_um : set free along the path; 80 for minimum-ionising particles, 630 for 50 MeV protons
    """

    flux_cm2_s: NonNegative
    depth_um: Positive = 5.0
    charge_e_um: Positive = 80.0


Bits = Annotated[int, Meta(ge=8, le=16)]
Pixels = Annotated[int, Meta(ge=1, le=16384)]


class DetectorTable(Table, frozen=True, kw_only=True):
    """What preset files and ``[camera.NAME]`` both say about a detector.

    fill_factor : share of a pixel's light that reaches the photodiode
    gain_e_per_dn : at an analogue gain of 1
    mosaic : colours of 2 x 2 pixels row by row from the top left; "mono" leaves the filters off
    dark_current_e_s, hot_current_e_s : at 300 K
    prnu : rms share of the mean; dead_pixels, hot_pixels : share of all pixels
    row_pattern_e, column_pattern_e : fixed; row_noise_e : new in every frame
    blooming : share of the charge beyond the full well that spills along the column
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
    """A camera preset file, ``NAME.toml``; what it does not give the detector does not have.

    qe : electrons per photon of a pixel without a filter
    window, micro_lens : what every pixel has in front of it besides: cover glass and infrared
        filter, and the share of the light that the micro-lens brings to the photodiode
    filters : of a colour detector
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


class CameraSettingsTable(DetectorTable, frozen=True, kw_only=True):
    """A preset, changed where a key is given.

    quantum_efficiency : electrons per photon without filters, one number or four bands
    serial : number of this camera, which its fixed pattern follows; by default from its name
    """

    preset: str = "mt9m034"
    focal_length_mm: Positive = 13.0
    # No lens in air is faster than f/0.5 (Abbe's sine condition).
    f_number: Annotated[float, Meta(ge=0.5)] = 4.0
    exposure_time_s: Annotated[float, Meta(gt=0.0, le=3600.0)] = 0.0005
    readout_time_s: Annotated[float, Meta(ge=0.0, le=3600.0)] = 0.0
    transport_latency_s: Annotated[float, Meta(ge=0.0, le=3600.0)] = 0.0
    transmission: BandValues = 1.0
    optics: OpticsTable | None = None
    lidar: LidarTable | None = None
    quantum_efficiency: BandValues | None = None
    serial: Annotated[int, Meta(ge=0, le=2**32 - 1)] | None = None
