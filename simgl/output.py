"""Captures on disk: EXR in physical units, 16-bit PNG in DN, sRGB PNG previews.

Every file is written under a temporary name in its folder and renamed when complete, so readers
never see a partial file.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from PIL import Image

from simgl.arrays import Image8, Image16
from simgl.camera.projections import Distortion, DoubleSphere, Fisheye, Projection
from simgl.display_images import display_from_dn, display_from_radiance
from simgl.errors import OutputError
from simgl.images import (
    DigitalFrame,
    FrameInfo,
    LayersFrame,
    NormalsFrame,
    RadianceFrame,
    ThermalFrame,
    TruthFrame,
    display_from_layers,
    display_from_thermal,
)
from simgl.interruption import new_folders, unfinished_files
from simgl.mono12p import pack_mono12p
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.physics.frames import quaternion_from_matrix
from simgl.physics.spectrum import BANDS
from simgl.simulator import Capture

_LENS_MODELS = {Distortion: "pinhole", Fisheye: "fisheye", DoubleSphere: "double_sphere"}


def check_writable(folder: Path) -> None:
    """Create the folder if it is missing; raises OutputError if files cannot be written into it."""
    with _temporary_file(folder, "probe"):
        pass


def _make_folder(folder: Path) -> None:
    """Create the folder and those above it that are missing; the command line removes them where
    they stay empty."""
    # Known before they exist: a signal may come at any moment.
    new_folders.extend(above for above in reversed((folder, *folder.parents)) if not above.exists())
    folder.mkdir(parents=True, exist_ok=True)


@contextmanager
def complete_file(path: Path) -> Iterator[Path]:
    """A temporary path that is renamed to ``path`` if the block succeeds and deleted if it fails.

    Raises OutputError if the folder cannot be written.
    """
    with _temporary_file(path.parent, path.stem, path.suffix) as temporary:
        try:
            yield temporary
            temporary.chmod(0o644)
            temporary.replace(path)
        except OSError as error:
            raise OutputError(f"{path}: cannot be written ({error.strerror})") from None


@contextmanager
def _temporary_file(folder: Path, stem: str, suffix: str = "") -> Iterator[Path]:
    """A new, empty file in a folder, which is made if it is missing; deleted after the block."""
    # Known before it exists: a signal may come at any moment.
    temporary = folder / f".{stem}.{secrets.token_hex(8)}{suffix}"
    unfinished_files.add(temporary)
    try:
        try:
            _make_folder(folder)
            temporary.touch(mode=0o600, exist_ok=False)
        except OSError as error:
            raise OutputError(f"{folder}: cannot be written ({error.strerror})") from None
        yield temporary
    finally:
        # Nothing to remove where it could not be created, or has its name by now.
        with suppress(OSError):
            temporary.unlink()
        unfinished_files.discard(temporary)


def _text(values: Any) -> str:
    """Numbers in the fewest digits that read back to the same float64."""
    return " ".join(repr(float(v)) for v in np.ravel(values))


def _lens_text(lens: Projection | None) -> str:
    """Model and coefficients by the keys of a scenario: "fisheye k1=-0.01", without those of 0."""
    if lens is None:
        return "none"
    assert isinstance(lens, Distortion | Fisheye | DoubleSphere)
    given = [f"{name}={_text(value)}" for name, value in asdict(lens).items() if value]
    return " ".join([_LENS_MODELS[type(lens)], *given])


def _header(info: FrameInfo) -> dict[str, Any]:
    """Header entries, the unit in each name; numbers as text, since EXR floats have 7 digits."""
    from simgl import __version__

    camera = info.camera
    k = camera.intrinsics
    channels = "RGBN" if info.bands == BANDS else "Bands"
    return {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "simglVersion": __version__,
        "renderer": info.renderer,
        "scenario": info.scenario,
        "camera": camera.name,
        "bandsNm": info.bands.edges_nm,
        f"units{channels}": "W m-2 sr-1, integrated over the band",
        "unitsZ": "m along the boresight, 0 where no spacecraft is",
        "epochUtc": utc_from_tai_ns(info.epoch_tai_ns),
        "epochTaiNs": str(info.epoch_tai_ns),
        "epochIs": "mid-exposure; TAI nanoseconds since 1970-01-01T00:00:00 TAI",
        "exposureTimeS": _text(camera.exposure_time),
        "positionGcrfM": _text(info.position),
        "quaternionCameraFromIcrfXyzw": _text(quaternion_from_matrix(info.R_camera_from_icrf)),
        "cameraAxes": "x right, y down, z boresight",
        "intrinsicsFxFyCxCyPx": _text((k[0, 0], k[1, 1], k[0, 2], k[1, 2])),
        "skewPx": _text(k[0, 1]),
        "distortion": _lens_text(camera.lens.distortion),
        "fNumber": _text(camera.lens.f_number),
        "sunDirectionIcrf": _text(info.sun_direction_icrf),
        f"sunIrradiance{channels}WM2": _text(info.sun_irradiance[: len(info.bands.edges)]),
        "seed": str(info.seed),
        "draw": str(info.draw),
        "interreflection": info.interreflection,
    }


def write_exr(
    path: Path,
    radiance: RadianceFrame,
    truth: TruthFrame | None = None,
    normals: NormalsFrame | None = None,
) -> None:
    """Float32 channels R G B N, or those of the scenario's bands [W m-2 sr-1]; with truth also
    Z [m] and uint32 partId.

    normals : also ``normal.X``, ``normal.Y``, ``normal.Z``, unit vectors in camera axes
    """
    channels: dict[str, Any] = {
        name: np.ascontiguousarray(radiance.radiance[..., i])
        for i, name in enumerate(radiance.info.bands.names)
    }
    header, channels = _with_truth(_header(radiance.info), channels, truth)
    if normals is not None:
        for index, axis in enumerate("XYZ"):
            channels[f"normal.{axis}"] = np.ascontiguousarray(normals.normals[..., index])
    write_channels(path, header, channels)


def _with_truth(
    header: dict[str, Any], channels: dict[str, Any], truth: TruthFrame | None
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Header and channels with depth and part ids, where there are any."""
    if truth is None:
        return header, channels
    seen = np.unique(truth.part_id)
    names = {i: truth.part_names[i] for i in seen.tolist() if i}
    listed = ", ".join(f"{i}={name}" for i, name in names.items()) or "none seen"
    more = {
        "Z": np.ascontiguousarray(truth.depth),
        "partId": np.ascontiguousarray(truth.part_id),
    }
    return header | {"partNames": listed}, channels | more


def write_channels(path: Path, header: dict[str, Any], channels: dict[str, Any]) -> None:
    """An EXR file of any channels by name, (h, w) float32 or uint32."""
    with complete_file(path) as temporary:
        try:
            OpenEXR.File(header, channels).write(str(temporary))
        except RuntimeError as error:
            # What C++ throws names the temporary file, then the reason.
            reason = str(error).rpartition('". ')[2].rstrip(".")
            raise OutputError(f"{path}: cannot be written ({reason})") from None


def write_layers_exr(path: Path, frame: LayersFrame) -> None:
    """Float32 channels ``sun.R`` ... [W m-2 sr-1] of each layer; R G B N, or the scenario's bands,
    are their sum."""
    prefixed = {"": frame.total} | {f"{name}.": layer for name, layer in frame.layers.items()}
    channels = {
        f"{prefix}{band}": np.ascontiguousarray(radiance[..., i])
        for prefix, radiance in prefixed.items()
        for i, band in enumerate(frame.info.bands.names)
    }
    names = ", ".join(frame.info.bands.names)
    layers = {"layers": f"{names} of {', '.join(frame.layers)} and their sum"}
    write_channels(path, _header(frame.info) | layers, channels)


def write_thermal_exr(path: Path, frame: ThermalFrame, truth: TruthFrame | None = None) -> None:
    """Float32 channels ``radiance`` [W m-2 sr-1] and ``temperature`` [K]; with truth as
    ``write_exr``.

    The header names the state of the temperatures and their history.
    """
    camera = frame.info.camera
    assert camera.thermal is not None
    header = _header(frame.info)
    for key in ("bandsNm", *(k for k in header if k.startswith(("unitsRGBN", "unitsBands")))):
        del header[key]
    low, high = camera.thermal.table.band_um
    header |= {
        "bandUm": f"{low:g}-{high:g}",
        "unitsRadiance": "W m-2 sr-1, integrated over the band",
        "unitsTemperature": "K, mean of the surfaces in a pixel, 0 where no spacecraft is",
        "thermalState": frame.state,
        "thermalHistory": frame.history,
    }
    channels = {"radiance": frame.radiance, "temperature": frame.temperature}
    write_channels(path, *_with_truth(header, channels, truth))


def write_dn_png(path: Path, frame: DigitalFrame) -> None:
    """Digital numbers, unscaled, in a 16-bit grey PNG."""
    write_png(path, frame.dn)


def write_mono12p(path: Path, frame: DigitalFrame) -> None:
    """Digital numbers of up to 12 bits, packed as GenICam's Mono12p, rows from the top."""
    with complete_file(path) as temporary:
        temporary.write_bytes(pack_mono12p(frame.dn))


def write_view_png(path: Path, frame: RadianceFrame) -> None:
    """An sRGB preview of the radiance: a white surface that faces the Sun is white."""
    write_png(path, display_from_radiance(frame.radiance, bands=frame.info.bands))


def write_view(path: Path, capture: Capture) -> None:
    """The preview of a capture with radiance, or of a thermal camera's with its frame."""
    if capture.thermal is not None:
        write_png(path, display_from_thermal(capture.thermal))
    else:
        assert capture.radiance is not None
        write_view_png(path, capture.radiance)


def write_light(path: Path, capture: Capture) -> None:
    """The EXR file of a capture with radiance, or of a thermal camera's with its frame."""
    if capture.thermal is not None:
        write_thermal_exr(path, capture.thermal, capture.truth)
    else:
        assert capture.radiance is not None
        write_exr(path, capture.radiance, capture.truth, capture.normals)


def write_png(path: Path, pixels: Image8 | Image16) -> None:
    """A PNG of pixels as they are."""
    with complete_file(path) as temporary:
        Image.fromarray(pixels).save(temporary)


def write_capture(capture: Capture, folder: Path, name: str, *, packed: bool = False) -> list[Path]:
    """Write the frames of a capture to files; a frame that is None is not written.

    capture : the frames
    folder : of the files, made if it is missing
    name : of the files, ``NAME`` below
    packed : also ``NAME.dn.mono12p``, for detectors of up to 12 bits
    returns : the paths written

    Files by frame:

    radiance : ``NAME.radiance.exr``, float32 [W m-2 sr-1], with depth and part ids if the capture
        has truth; ``NAME.view.png``, an sRGB preview
    thermal : ``NAME.thermal.exr``, radiance in the band and temperature; ``NAME.view.png``, the
        brightness temperature from 200 to 350 K
    layers : ``NAME.layers.exr`` and ``NAME.layers.png``
    digital : ``NAME.dn.png``, 16 bits; for a colour detector also ``NAME.colour.png``

    Raises OutputError if the folder cannot be written.
    """
    writers: list[tuple[str, Callable[[Path], None]]] = []
    if (radiance := capture.radiance) is not None:
        writers.append(
            ("radiance.exr", lambda p: write_exr(p, radiance, capture.truth, capture.normals))
        )
        writers.append(("view.png", lambda p: write_view_png(p, radiance)))
    if (thermal := capture.thermal) is not None:
        writers.append(("thermal.exr", lambda p: write_thermal_exr(p, thermal, capture.truth)))
        writers.append(("view.png", lambda p: write_png(p, display_from_thermal(thermal))))
    if (layers := capture.layers) is not None:
        writers.append(("layers.exr", lambda p: write_layers_exr(p, layers)))
        writers.append(("layers.png", lambda p: write_png(p, display_from_layers(layers))))
    if (digital := capture.digital) is not None:
        writers.append(("dn.png", lambda p: write_dn_png(p, digital)))
        camera = digital.info.camera
        if camera.detector.mosaic is not None:
            colours = display_from_dn(digital.dn, camera)
            writers.append(("colour.png", lambda p: write_png(p, colours)))
        if packed:
            writers.append(("dn.mono12p", lambda p: write_mono12p(p, digital)))
    for suffix, write in writers:
        write(folder / f"{name}.{suffix}")
    return [folder / f"{name}.{suffix}" for suffix, _ in writers]
