"""Where a distorting lens looks: the pinhole pictures that hold its field, and the way between."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from simgl.errors import ConfigError
from simgl.scene.camera import Camera

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

# Pixels around the field, for the neighbours that interpolation and edges ask for.
_MARGIN = 3
# A field so many times as large as the picture comes of coefficients that do not fit the lens.
_LARGEST_FIELD = 3.0
# The background and the truth are drawn on pixels so much smaller than the detector's.
FINER = 2
_FEWEST_MAPS = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class Field:
    """What a lens sees, as a pinhole would.

    pinhole : camera without distortion whose picture holds the field, of the same focal length and
        pixels
    fine : the same with smaller pixels
    centred : the same with an odd number of them, so that one lies in the middle of each pixel
    places : (height, width, 2) float32, pixel coordinates in the pinhole's picture that the middles
        of the camera's pixels see
    stretch : (height, width), area of the picture over area of the pinhole's
    """

    pinhole: Camera
    fine: Camera
    centred: Camera
    places: Floats
    stretch: Array

    @property
    def largest_pixel(self) -> tuple[float, float]:
        """Width and height that the camera's pixels have at most in the pinhole's picture."""
        steps = (np.abs(np.diff(self.places, axis=axis)).sum(axis=-1) for axis in (1, 0))
        across, down = (float(step.max(initial=1.0)) for step in steps)
        return across, down

    @property
    def smallest_pixel(self) -> float:
        """Width or height that the camera's pixels have at least in the pinhole's picture."""
        steps = (np.linalg.norm(np.diff(self.places, axis=axis), axis=-1) for axis in (1, 0))
        return float(min(step.min(initial=1.0) for step in steps))


@lru_cache(maxsize=_FEWEST_MAPS)
def field(camera: Camera) -> Field:
    """The field of a camera whose lens distorts.

    Raises ConfigError where the distortion folds the picture, or sees far more than a pinhole.
    """
    d, distortion = camera.detector, camera.lens.distortion
    assert distortion is not None
    where = f"[camera.{camera.name}]"
    f = camera.focal_length_px
    middle = 0.5 * np.array([d.width, d.height])
    y, x = np.mgrid[0 : d.height, 0 : d.width] + 0.5
    tangents = distortion.undistorted((np.stack([x, y], axis=-1) - middle) / f)
    if np.isnan(tangents).any():
        raise ConfigError(
            where, "optics.distortion", "folds the picture: two rays meet in one place"
        )
    reach = np.abs(tangents).max(axis=(0, 1)) * f
    if np.any(reach > _LARGEST_FIELD * middle):
        times = float((reach / middle).max())
        problem = f"sees {times:.1f} times the field of a pinhole, at most {_LARGEST_FIELD:g}"
        raise ConfigError(where, "optics.distortion", problem)
    width, height = (2 * (np.ceil(reach).astype(int) + _MARGIN)).tolist()
    lens = replace(camera.lens, distortion=None)
    pinhole = replace(camera, lens=lens, detector=replace(d, width=width, height=height))
    places = tangents * f + 0.5 * np.array([width, height])
    return Field(
        pinhole=pinhole,
        fine=_finer(pinhole, 0),
        centred=_finer(pinhole, 1),
        places=places.astype(np.float32),
        stretch=np.linalg.det(distortion.jacobian(tangents)),
    )


def _finer(pinhole: Camera, more: int) -> Camera:
    d = pinhole.detector
    fine = replace(
        d,
        width=FINER * d.width + more,
        height=FINER * d.height + more,
        pixel_pitch=d.pixel_pitch / FINER,
    )
    return replace(pinhole, detector=fine)


def sight_lines(camera: Camera) -> Array:
    """(height, width, 3) directions that the middles of pixels see, of depth 1, camera axes."""
    d, f = camera.detector, camera.focal_length_px
    if camera.lens.distortion is None:
        y, x = np.mgrid[0 : d.height, 0 : d.width] + 0.5
        x, y = (x - 0.5 * d.width) / f, (y - 0.5 * d.height) / f
    else:
        seen = field(camera)
        pinhole = seen.pinhole.detector
        x, y = np.moveaxis(seen.places.astype(np.float64), -1, 0)
        x, y = (x - 0.5 * pinhole.width) / f, (y - 0.5 * pinhole.height) / f
    return np.stack([x, y, np.ones_like(x)], axis=-1)


def relative_illumination(camera: Camera) -> Floats:
    """(height, width) irradiance of the image plane over that on the axis, of an even radiance."""
    d, vignetting = camera.detector, camera.lens.vignetting
    f = camera.focal_length_px
    if camera.lens.distortion is None:
        y, x = (np.arange(n) + 0.5 - 0.5 * n for n in (d.height, d.width))
        squared = (y[:, None] ** 2 + x**2) / f**2
        stretch = np.ones(squared.shape)
    else:
        seen = field(camera)
        pinhole = seen.pinhole.detector
        offset = seen.places.astype(np.float64) - 0.5 * np.array([pinhole.width, pinhole.height])
        squared = (offset**2).sum(axis=-1) / f**2
        stretch = seen.stretch
    if vignetting.angles:
        angle = np.arctan(np.sqrt(squared))
        return np.interp(angle, vignetting.angles, vignetting.relative).astype(np.float32)
    if not vignetting.natural:
        return np.ones(squared.shape, dtype=np.float32)
    return np.asarray(1.0 / ((1.0 + squared) ** 2 * stretch), dtype=np.float32)
