"""Lenses and LIDARs from ``[camera.NAME.optics]`` and ``[camera.NAME.lidar]`` tables."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

import msgspec
import numpy as np

from simgl.camera.camera import Camera
from simgl.camera.ghosts import ghosts
from simgl.camera.lens import Blur, LensSurface, PointSpread, Vignetting, Zone
from simgl.camera.lens_schema import FieldZoneTable, LensSurfaceTable, LidarTable, OpticsTable
from simgl.camera.lidar import Lidar
from simgl.camera.pinhole_fields import pinhole_fields
from simgl.camera.projections import Distortion, DoubleSphere, Fisheye, Projection
from simgl.camera.psf_kernel import lens_reach
from simgl.config.path_sandbox import Base
from simgl.decoded_files import array_in, decoded_image
from simgl.errors import AssetError, ConfigError
from simgl.input_files import read_file
from simgl.physics.spectrum import Bands, band_of

# Cooke triplet (Taylor 1893), the usual textbook example of 50 mm, f/5 and a field of 40 deg:
# radius and gap [mm], and index behind each surface.
_TRIPLET = tuple(
    LensSurfaceTable(radius_mm=radius, gap_mm=gap, index=index)
    for radius, gap, index in (
        (22.01359, 3.258956, 1.62041),
        (-435.76044, 6.007551, 1.0),
        (-22.21328, 0.999975, 1.62004),
        (20.29192, 4.750409, 1.0),
        (79.68360, 2.952076, 1.62041),
        (-18.39533, 42.207782, 1.0),
    )
)

# Largest number of samples along an edge of a point spread's image.
_LARGEST_PSF = 512
_MAX_PSF_BYTES, _MAX_PSF_PIXELS = 64 << 20, 1 << 24


def read_optics(table: OpticsTable, where: str, base: Base) -> dict[str, Any]:
    """Arguments of a Lens.

    where : of the table, for errors
    base : folder of relative paths

    Raises ConfigError for impossible values, AssetError for missing files.
    """
    return {
        "camera_equation": table.camera_equation,
        "vignetting": _vignetting(table, where),
        "distortion": _distortion(table, where),
        "spread": _spread(table, where, base),
        "veiling_glare": table.veiling_glare,
        "surfaces": _surfaces(table, where),
    }


def read_lidar(
    table: LidarTable | None, bands: Bands, sun_temperature: float, where: str
) -> Lidar | None:
    """The LIDAR of a table; None without one.

    sun_temperature : of the black body that stands for the Sun [K]
    """
    if table is None:
        return None
    if band_of(np.array([table.wavelength_nm * 1e-9]), bands)[0] < 0:
        problem = f"must lie in a band ({bands.edges_nm}), got {table.wavelength_nm:g}"
        raise ConfigError(where, "lidar.wavelength_nm", problem)
    return Lidar(
        wavelength=table.wavelength_nm * 1e-9,
        pulse_energy=table.pulse_energy_mj * 1e-3,
        pulse_length=table.pulse_length_ns * 1e-9,
        half_angle=float(np.radians(table.beam_half_angle_deg)),
        offset=table.emitter_offset_m,
        quantum_efficiency=table.quantum_efficiency,
        filter_width=table.filter_nm * 1e-9,
        gate=table.gate_us * 1e-6,
        range_noise=table.range_noise_m,
        threshold=table.threshold_e,
        bands=bands,
        sun_temperature=sun_temperature,
    )


def check_optics(camera: Camera, where: str) -> None:
    """Raise ConfigError, with the table's place, for a lens that cannot be built."""
    try:
        ghosts(camera.lens.surfaces, camera.lens.focal_length)
        if not camera.is_pinhole:
            pinhole_fields(camera)
        if camera.lens.spread is not None and camera.lens.spread.image is None:
            for zone in camera.lens.spread.zones:
                lens_reach(camera, zone.blur)
    except ConfigError as error:
        raise ConfigError(where, error.key, error.problem) from None


def _fail(where: str, key: str, problem: str) -> NoReturn:
    raise ConfigError(where, f"optics.{key}", problem)


def _vignetting(table: OpticsTable, where: str) -> Vignetting:
    if (table.vignetting == "measured") != (table.vignetting_angle_deg is not None):
        problem = 'is required with vignetting = "measured" and allowed only with it'
        _fail(where, "vignetting_angle_deg", problem)
    angles, relative = table.vignetting_angle_deg, table.vignetting_relative
    if (angles is None) != (relative is None):
        problem = "is required with vignetting_angle_deg and allowed only with it"
        _fail(where, "vignetting_relative", problem)
    if angles is None or relative is None:
        return Vignetting(natural=table.vignetting == "cos4")
    if len(angles) != len(relative) or len(angles) < 2:
        problem = f"has {len(relative)} values for {len(angles)} angles; at least two of both"
        _fail(where, "vignetting_relative", problem)
    if not _increasing(angles) or angles[0] != 0.0:
        _fail(where, "vignetting_angle_deg", "must start at 0 and increase")
    return Vignetting(angles=tuple(np.radians(angles).tolist()), relative=relative)


# Keys of ``DistortionTable`` by model; of a double sphere all are needed.
_COEFFICIENTS = {
    "pinhole": tuple(field.name for field in dataclasses.fields(Distortion)),
    "fisheye": tuple(field.name for field in dataclasses.fields(Fisheye)),
    "double_sphere": tuple(field.name for field in dataclasses.fields(DoubleSphere)),
}


def _distortion(table: OpticsTable, where: str) -> Projection | None:
    if table.distortion is None:
        return None
    given = msgspec.structs.asdict(table.distortion)
    model = given.pop("model")
    names = _COEFFICIENTS[model]
    for key, value in given.items():
        if key not in names and value not in (None, 0.0):
            models = [f'"{other}"' for other, its in _COEFFICIENTS.items() if key in its]
            problem = f'requires model = {" or ".join(models)}, got "{model}"'
            _fail(where, f"distortion.{key}", problem)
        if key in names and value is None:
            _fail(where, f"distortion.{key}", f'is missing; model = "{model}" needs it')
    values = {name: given[name] for name in names}
    if model == "fisheye":
        return Fisheye(**values)
    if model == "double_sphere":
        return DoubleSphere(**values)
    distortion = Distortion(**values)
    return None if distortion == Distortion() else distortion


def _spread(table: OpticsTable, where: str, base: Base) -> PointSpread | None:
    if table.psf_image is not None:
        for key in ("diffraction", "aberration_um", "defocus_um", "field_zones"):
            if getattr(table, key) not in (None, False, 0.0):
                _fail(where, key, "contradicts psf_image, which holds all of the spread")
        try:
            path = base / table.psf_image
        except AssetError as error:
            raise AssetError(f"{where}: optics.psf_image: {error}") from None
        image = _psf_image(path, where)
        return PointSpread(image=image, image_scale=table.psf_samples_per_px or 1)
    if table.psf_samples_per_px is not None:
        _fail(where, "psf_samples_per_px", "requires psf_image")
    zones = [Zone(share=0.0, blur=_blur(table))]
    zones += [Zone(share=zone.at, blur=_blur(zone)) for zone in table.field_zones or ()]
    if not _increasing([zone.share for zone in zones]):
        _fail(where, "field_zones", "must have increasing values of at, from above 0")
    if not table.diffraction and any(zone.blur.defocus != 0.0 for zone in zones):
        _fail(where, "defocus_um", "requires diffraction = true")
    if not table.diffraction and all(zone.blur == Blur() for zone in zones):
        return None
    return PointSpread(diffraction=table.diffraction, zones=tuple(zones))


def _blur(table: OpticsTable | FieldZoneTable) -> Blur:
    return Blur(aberration=table.aberration_um * 1e-6, defocus=table.defocus_um * 1e-6)


def _psf_image(path: Path, where: str) -> tuple[tuple[float, ...], ...]:
    try:
        content = read_file(path, _MAX_PSF_BYTES)
        if path.suffix == ".npy":
            values = array_in(content)
        else:
            values = np.asarray(decoded_image(content, _MAX_PSF_PIXELS))
    except AssetError as error:
        raise AssetError(f"{where}: optics.psf_image: {error}") from None
    except ValueError:
        problem = f"{path} is neither an image nor a .npy array"
        raise ConfigError(where, "optics.psf_image", problem) from None
    if values.dtype.kind not in "uif":
        _fail(where, "psf_image", f"{path} must hold real numbers, got {values.dtype}")
    if values.ndim != 2 or min(values.shape) < 1 or max(values.shape) > _LARGEST_PSF:
        problem = f"must have one channel and at most {_LARGEST_PSF} samples along an edge"
        _fail(where, "psf_image", f"{path} {problem}, has the shape {values.shape}")
    values = values.astype(np.float64)
    if not np.isfinite(values).all() or values.min() < 0.0 or not values.sum() > 0.0:
        _fail(where, "psf_image", f"{path} must hold values of 0 or more, not all 0")
    return tuple(map(tuple, values.tolist()))


def _surfaces(table: OpticsTable, where: str) -> tuple[LensSurface, ...]:
    if table.surfaces is None:
        if table.coating_reflectance is not None:
            _fail(where, "coating_reflectance", "requires surfaces")
        return ()
    coating = 0.005 if table.coating_reflectance is None else table.coating_reflectance
    surfaces = _TRIPLET if isinstance(table.surfaces, str) else table.surfaces
    return tuple(
        LensSurface(
            radius=np.inf if s.radius_mm == 0.0 else s.radius_mm * 1e-3,
            gap=s.gap_mm * 1e-3,
            index=s.index,
            reflectance=coating if s.reflectance is None else s.reflectance,
        )
        for s in surfaces
    )


def _increasing(values: Sequence[float]) -> bool:
    return bool(np.all(np.diff(values) > 0.0))
