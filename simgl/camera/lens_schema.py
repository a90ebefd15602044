"""Schema of ``[camera.NAME.optics]`` and ``[camera.NAME.lidar]``: keys, units and limits."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from simgl.config.value_types import Fraction, NonNegative, Positive, Table

# Of a detector against the lens [rad]; a Scheimpflug camera has a tenth.
MAX_TILT = 0.8
Tilt = Annotated[float, Meta(ge=-MAX_TILT, le=MAX_TILT)]


class DistortionTable(Table, frozen=True, kw_only=True):
    """The projection of a lens; coefficients as in OpenCV.

    model : "pinhole" with Brown-Conrady's distortion; "fisheye", Kannala-Brandt; "double_sphere"
    k1, k2, k3, k4, k5, k6 : radial, of a pinhole; k1 to k4 of a fisheye
    p1, p2 : tangential, of a pinhole
    s1, s2, s3, s4 : thin prism, of a pinhole
    tau_x, tau_y : tilt of the detector in radians, of a pinhole
    xi, alpha : of a double sphere
    """

    model: Literal["pinhole", "fisheye", "double_sphere"] = "pinhole"
    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    k5: float = 0.0
    k6: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    s1: float = 0.0
    s2: float = 0.0
    s3: float = 0.0
    s4: float = 0.0
    tau_x: Tilt = 0.0
    tau_y: Tilt = 0.0
    xi: Annotated[float, Meta(gt=-1.0, le=10.0)] | None = None
    alpha: Fraction | None = None


class FieldZoneTable(Table, frozen=True, kw_only=True):
    """Blur off the axis.

    at : distance from the principal point, as a fraction of the half diagonal
    aberration_um, defocus_um : as those on the axis
    """

    at: Annotated[float, Meta(gt=0.0, le=1.0)]
    aberration_um: NonNegative = 0.0
    defocus_um: float = 0.0


class LensSurfaceTable(Table, frozen=True, kw_only=True):
    """A surface of a lens.

    radius_mm : of curvature, positive with the centre behind the surface; 0 is a plane
    gap_mm : to the next surface
    index : refractive index of the medium behind
    reflectance : default: ``coating_reflectance``
    """

    radius_mm: float
    gap_mm: NonNegative
    index: Annotated[float, Meta(ge=1.0, le=4.0)]
    reflectance: Fraction | None = None


class OpticsTable(Table, frozen=True, kw_only=True):
    """``[camera.NAME.optics]``: imperfections of a lens; without the table it is ideal.

    camera_equation : irradiance pi L T / (4 N^2), or pi L T / (1 + 4 N^2)
    vignetting : "cos4", "none", or "measured" with a profile by angle off the axis
    vignetting_angle_deg, vignetting_relative : that profile: angles, and light relative to the axis
    distortion : projection of the lens
    diffraction : by f-number and band
    aberration_um : standard deviation of a Gaussian in the image plane
    defocus_um : distance from best focus to the detector
    psf_image : replaces these three: an image or .npy array of the point spread
    psf_samples_per_px : samples of ``psf_image`` per pixel along an edge
    field_zones : blur off the axis; the keys above apply on the axis
    veiling_glare : fraction of the light that is scattered uniformly over the image
    surfaces : from front to back, or "triplet"; for ghosts of the Sun
    coating_reflectance : default of the surfaces' reflectance; 0.005 if omitted
    """

    camera_equation: Literal["4N2", "1+4N2"] = "4N2"
    vignetting: Literal["cos4", "none", "measured"] = "cos4"
    vignetting_angle_deg: (
        Annotated[tuple[Annotated[float, Meta(ge=0.0, lt=90.0)], ...], Meta(max_length=10_000)]
        | None
    ) = None
    vignetting_relative: Annotated[tuple[NonNegative, ...], Meta(max_length=10_000)] | None = None
    distortion: DistortionTable | None = None
    diffraction: bool = False
    aberration_um: NonNegative = 0.0
    defocus_um: float = 0.0
    psf_image: str | None = None
    psf_samples_per_px: Annotated[int, Meta(ge=1, le=16)] | None = None
    field_zones: Annotated[tuple[FieldZoneTable, ...], Meta(max_length=32)] | None = None
    veiling_glare: Annotated[float, Meta(ge=0.0, lt=1.0)] = 0.0
    surfaces: (
        Literal["triplet"] | Annotated[tuple[LensSurfaceTable, ...], Meta(max_length=64)] | None
    ) = None
    coating_reflectance: Fraction | None = None


class LidarTable(Table, frozen=True, kw_only=True):
    """``[camera.NAME.lidar]``: a flash LIDAR that receives through the camera's lens and pixels.

    wavelength_nm : of the laser
    pulse_energy_mj : of one pulse
    pulse_length_ns : full width at half maximum of a pulse
    emitter_offset_m : position of the emitter from the pinhole, camera axes
    beam_half_angle_deg : half angle of the cone of uniform intensity about the boresight
    quantum_efficiency : electrons per photon at the wavelength
    filter_nm : width of the optical filter about the wavelength
    gate_us : time during which sunlight is collected
    range_noise_m : standard deviation of a range with ample signal
    threshold_e : smallest signal that gives a range
    """

    wavelength_nm: Annotated[float, Meta(ge=400.0, le=1000.0)] = 905.0
    pulse_energy_mj: Positive = 1.0
    pulse_length_ns: Positive = 10.0
    beam_half_angle_deg: Annotated[float, Meta(ge=0.1, le=70.0)] = 10.0
    emitter_offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quantum_efficiency: Fraction = 0.3
    filter_nm: Positive = 2.0
    gate_us: Positive = 10.0
    range_noise_m: NonNegative = 0.01
    threshold_e: Positive = 10.0
