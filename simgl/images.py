"""Frames of a capture, each an array with one unit.

``info`` of a frame is its metadata.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from simgl.arrays import Array, Array32, Image8, Image16, Mask, UIntArray
from simgl.camera.camera import Camera, Detector
from simgl.camera.camera_equation import irradiance_per_radiance
from simgl.camera.distortion import sight_lines
from simgl.display_images import (
    contact_sheet,
    display_from_dn,
    display_from_linear,
    display_from_radiance,
    display_gain,
    png_bytes,
)
from simgl.errors import ConfigError
from simgl.html_table import html_image, html_table
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.physics.spectrum import Bands
from simgl.physics.thermal_radiation import band_temperature
from simgl.value_checks import LARGEST_SEED, check_integer

if TYPE_CHECKING:
    from xarray import DataArray


@dataclass(frozen=True, kw_only=True, eq=False)
class FrameInfo:
    """Metadata of a frame.

    scenario : its name
    epoch_tai_ns : mid-exposure, TAI nanoseconds since 1970-01-01T00:00:00 TAI
    camera : with its settings of this frame
    position : (3,) of the pinhole in GCRF [m]
    R_camera_from_icrf : (3, 3)
    sun_direction_icrf : (3,) unit, from the camera towards the Sun
    sun_irradiance : (4,) at the camera, without eclipse [W m-2]
    seed : of the noise
    draw : noise realisation of this epoch, 0 to 2^32 - 1
    renderer : name of the OpenGL renderer
    interreflection : "off"; "exact"; or "quick", where joints have moved parts of a spacecraft and
        light between them is worked out pair by pair
    """

    scenario: str
    camera: Camera
    epoch_tai_ns: int
    position: Array
    R_camera_from_icrf: Array
    sun_direction_icrf: Array
    sun_irradiance: Array
    seed: int
    renderer: str
    draw: int = 0
    interreflection: Literal["off", "quick", "exact"] = "exact"

    @property
    def bands(self) -> Bands:
        """Of the channels of its frames; further ones hold zeros."""
        return self.camera.detector.bands

    def __post_init__(self) -> None:
        check_integer("draw", self.draw, 0, LARGEST_SEED)
        check_integer("seed", self.seed, 0, LARGEST_SEED)


@dataclass(frozen=True, kw_only=True, eq=False)
class RadianceFrame:
    """radiance : (height, width, 4) float32, channels of ``FrameInfo.bands`` [W m-2 sr-1]."""

    info: FrameInfo
    radiance: Array32

    def to_xarray(self) -> DataArray:
        """The radiance as a labelled array (row, column, band) that shares its memory.

        Coordinates: centres of the pixels [px], names of the bands, their edges [nm].

        Raises ConfigError where xarray is not installed.
        """
        try:
            from xarray import DataArray
        except ImportError:
            raise ConfigError(
                "to_xarray", "", 'needs xarray: pip install "simgl[xarray]"'
            ) from None
        height, width = self.radiance.shape[:2]
        bands = self.info.bands
        low, high = 1e9 * np.array(bands.edges).T
        return DataArray(
            self.radiance[..., : len(bands.edges)],
            dims=("row", "column", "band"),
            coords={
                "row": ("row", np.arange(height) + 0.5, {"units": "px"}),
                "column": ("column", np.arange(width) + 0.5, {"units": "px"}),
                "band": list(bands.names),
                "band_from": ("band", low, {"units": "nm"}),
                "band_to": ("band", high, {"units": "nm"}),
            },
            name="radiance",
            attrs={
                "units": "W m-2 sr-1",
                "long_name": "radiance, integrated over the band",
                "scenario": self.info.scenario,
                "epoch_utc": utc_from_tai_ns(self.info.epoch_tai_ns),
                "epoch_tai_ns": self.info.epoch_tai_ns,
                "exposure_time_s": self.info.camera.exposure_time,
            },
        )

    def _repr_png_(self) -> bytes:
        return png_bytes(display_from_radiance(self.radiance, bands=self.info.bands))


@dataclass(frozen=True, kw_only=True, eq=False)
class LayersFrame:
    """A radiance frame in parts that sum to it.

    layers : (height, width, 4) float32 each, channels as of radiance [W m-2 sr-1]: directly
        reflected light of "sun", "earth" and "lamp"; "inter_reflected" light; "emitted" light; and
        the "background" of Earth, sky and the Sun's disc
    """

    info: FrameInfo
    layers: Mapping[str, Array32]

    @property
    def total(self) -> Array32:
        """(height, width, 4) sum of the layers [W m-2 sr-1]."""
        return np.sum(tuple(self.layers.values()), axis=0).astype(np.float32)

    def _repr_png_(self) -> bytes:
        return png_bytes(display_from_layers(self))


@dataclass(frozen=True, kw_only=True, eq=False)
class IrradianceFrame:
    """Irradiance of the image plane.

    irradiance : (height, width, 4) float32, channels as of radiance [W m-2]
    photons_per_joule : (4,) of the Sun's spectrum in each band [J-1]
    """

    info: FrameInfo
    irradiance: Array32
    photons_per_joule: Array

    @property
    def photons(self) -> Array:
        """(height, width) photons in a pixel's area and the exposure time, over all bands."""
        camera = self.info.camera
        area_time = camera.detector.pixel_pitch**2 * camera.exposure_time
        return self.irradiance @ (self.photons_per_joule * area_time)

    def _repr_png_(self) -> bytes:
        radiance = self.irradiance / np.float32(irradiance_per_radiance(self.info.camera))
        return png_bytes(display_from_radiance(radiance, bands=self.info.bands))


@dataclass(frozen=True, kw_only=True, eq=False)
class ElectronFrame:
    """electrons : (height, width) float32, mean before noise and saturation [e-]."""

    info: FrameInfo
    electrons: Array32

    def _repr_png_(self) -> bytes:
        share = self.electrons / np.float32(self.info.camera.detector.full_well)
        return png_bytes(display_from_linear(share))


@dataclass(frozen=True, kw_only=True, eq=False)
class DigitalFrame:
    """dn : (height, width) uint16, from the converter [DN]."""

    info: FrameInfo
    dn: Image16

    def _repr_png_(self) -> bytes:
        return png_bytes(display_from_dn(self.dn, self.info.camera))


@dataclass(frozen=True, kw_only=True, eq=False)
class TruthFrame:
    """Depth and identity at the centre of each pixel; for a lens with skew or distortion at the
    nearest half-size pixel of the enlarged pinhole image.

    depth : (height, width) float32 along the boresight [m], negative behind the camera (fisheye
        lenses); 0 for no spacecraft
    part_id : (height, width) uint32, instance * 65536 + part + 1; 0 for no spacecraft
    part_names : id to "spacecraft/part"
    """

    info: FrameInfo
    depth: Array32
    part_id: UIntArray
    part_names: dict[int, str]

    @property
    def range(self) -> Array:
        """(height, width) distance from the pinhole [m]; 0 for no spacecraft."""
        with np.errstate(invalid="ignore"):
            distance = self.depth / sight_lines(self.info.camera)[..., 2]
        return np.where(self.depth != 0.0, distance, 0.0)

    @property
    def instance(self) -> UIntArray:
        """(height, width) number of the spacecraft in the scene, from 1; 0 for none."""
        return self.part_id >> np.uint32(16)

    def _repr_png_(self) -> bytes:
        return png_bytes(display_from_linear(_nearness(self.depth)))


@dataclass(frozen=True, kw_only=True, eq=False)
class NormalsFrame:
    """normals : (height, width, 3) float32 unit, camera axes; 0 for no spacecraft."""

    info: FrameInfo
    normals: Array32

    def _repr_png_(self) -> bytes:
        seen = np.any(self.normals != 0.0, axis=-1, keepdims=True)
        # Right, up and towards the camera as red, green and blue.
        colours = 0.5 + 0.5 * self.normals * np.array([1.0, -1.0, -1.0])
        return png_bytes(np.round(255.0 * np.where(seen, colours, 0.0)).astype(np.uint8))


@dataclass(frozen=True, kw_only=True, eq=False)
class LidarFrame:
    """One pulse of a flash LIDAR, at the epoch and pose of the camera's image.

    range : (height, width) float32, half of the light path [m]; 0 if not detected
    electrons : (height, width) float32, counted electrons of the pulse and of sunlight
    energy : (height, width) float32, mean energy of the pulse that reaches a pixel [J]
    """

    info: FrameInfo
    range: Array32
    electrons: Array32
    energy: Array32

    def _repr_png_(self) -> bytes:
        return png_bytes(display_from_linear(_nearness(self.range)))


@dataclass(frozen=True, kw_only=True, eq=False)
class ThermalFrame:
    """The image of a thermal camera before its detector.

    radiance : (height, width) float32, integrated over the camera's band [W m-2 sr-1]
    temperature : (height, width) float32, mean of the surfaces in a pixel [K]; 0 for no spacecraft
    state : hash of the temperatures of all spacecraft
    history : origin of the temperatures: "steady" without a history
    """

    info: FrameInfo
    radiance: Array32
    temperature: Array32
    state: str
    history: str

    @property
    def brightness_temperature(self) -> Array:
        """(height, width) temperature of black bodies with the same band radiance [K]."""
        thermal = self.info.camera.thermal
        assert thermal is not None
        return band_temperature(thermal.band, self.radiance)

    def _repr_png_(self) -> bytes:
        return png_bytes(display_from_thermal(self))


def _nearness(distance: Array32) -> Array32:
    """Nearest distance over distance; 0 where the distance is 0."""
    seen = distance > 0.0
    near = float(distance[seen].min()) if np.any(seen) else 1.0
    return np.where(seen, near / np.maximum(distance, near), 0.0).astype(np.float32)


def saturation_level(detector: Detector) -> int:
    """Smallest DN that counts as saturated: full scale of the converter, or the full well.

    Offsets and read noise are added after the full well, so a full pixel may read lower. The level
    is three sigma below, which misses one full pixel in 740.

    detector : the camera's
    """
    full = (detector.full_well - 3.0 * detector.noise_of_reading) * detector.gain_dn_per_e
    return int(min(detector.largest_dn, math.floor(full + detector.pedestal)))


def saturated(dn: Image16, detector: Detector) -> Mask:
    """(height, width) mask of the saturated pixels.

    dn : (height, width) digital numbers
    detector : of the camera that gave them
    """
    return dn >= saturation_level(detector)


# Brightness temperatures that are black and white [K]: high cloud, and panels in sunlight.
_COLD, _WARM = 200.0, 350.0


def display_from_thermal(frame: ThermalFrame) -> Image8:
    """(height, width, 3) grey image of brightness temperature, black at 200 K, white at 350 K.

    frame : of a thermal camera
    """
    share = np.clip((frame.brightness_temperature - _COLD) / (_WARM - _COLD), 0.0, 1.0)
    grey = np.round(255.0 * share).astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=2)


def display_from_layers(frame: LayersFrame) -> Image8:
    """sRGB image of the total and its layers side by side, with names and gains.

    frame : the layers of a capture

    Layers that are black at 1024 times the gain of the total are omitted.
    """
    bands = frame.info.bands
    total_gain = display_gain(frame.total, bands)
    panels = {f"whole x {total_gain:g}": display_from_radiance(frame.total, total_gain, bands)}
    for name, radiance in frame.layers.items():
        gain = min(display_gain(radiance, bands), 1024.0 * total_gain)
        image = display_from_radiance(radiance, gain, bands)
        if image.any():
            panels[f"{name} x {gain:g}"] = image
    return contact_sheet(panels, columns=3)


@dataclass(frozen=True, kw_only=True, eq=False)
class Capture:
    """One image as the requested products; the other fields are None.

    In a notebook it shows the first of its frames, with a table of its settings.

    info : metadata that all frames share
    digital : digital numbers [DN]
    electrons : mean electrons before noise and saturation [e-]
    radiance : [W m-2 sr-1]
    layers : the radiance in parts that sum to it
    irradiance : of the image plane [W m-2]
    truth : depth and part ids
    normals : of the surfaces, camera axes
    lidar : None also if the camera has no LIDAR
    thermal : None also if the camera sees visible light
    """

    info: FrameInfo
    digital: DigitalFrame | None = None
    electrons: ElectronFrame | None = None
    radiance: RadianceFrame | None = None
    layers: LayersFrame | None = None
    irradiance: IrradianceFrame | None = None
    truth: TruthFrame | None = None
    normals: NormalsFrame | None = None
    lidar: LidarFrame | None = None
    thermal: ThermalFrame | None = None

    def _repr_html_(self) -> str:
        info, camera = self.info, self.info.camera
        rows = [
            ("epoch", f"{utc_from_tai_ns(info.epoch_tai_ns)} UTC"),
            ("pixels", f"{camera.detector.width} x {camera.detector.height}"),
            ("exposure time", f"{1e3 * camera.exposure_time:g} ms"),
            ("f-number", f"{camera.lens.f_number:g}"),
            ("seed, draw", f"{info.seed}, {info.draw}"),
            ("renderer", info.renderer),
        ]
        if self.digital is not None:
            dn = self.digital.dn
            rows.append(("DN", f"{dn.min()} to {dn.max()}, mean {dn.mean():.1f}"))
        if self.radiance is not None:
            names = info.bands.names
            values = self.radiance.radiance[..., : len(names)].mean(axis=(0, 1))
            mean = ", ".join(f"{value:.4g}" for value in values)
            rows.append((f"mean radiance {', '.join(names)}", f"{mean} W m-2 sr-1"))
        if self.thermal is not None:
            rows.append(("temperatures", f"{self.thermal.history}, {self.thermal.state}"))
        title = f"Capture of {info.scenario}"
        return html_table(title, (), rows) + html_image(self._repr_png_(), title)

    def _repr_png_(self) -> bytes:
        frames = (self.digital, self.radiance, self.electrons, self.truth, self.layers)
        others = (self.thermal, self.irradiance, self.normals, self.lidar)
        for frame in (*frames, *others):
            if frame is not None:
                return frame._repr_png_()
        return b""
