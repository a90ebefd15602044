"""A lens as data: aperture, vignetting, distortion, point spread, stray light, surfaces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from simgl.camera.projections import Projection
from simgl.physics.spectrum import PerBand
from simgl.value_checks import check_bands, check_choice, check_positive, check_within

CameraEquation = Literal["4N2", "1+4N2"]


@dataclass(frozen=True, kw_only=True)
class Vignetting:
    """Irradiance off the axis, relative to the axis.

    natural : cos^4 of the angle divided by the stretch of the distortion, as in a thin lens
    angles, relative : instead, a profile measured on flat fields that includes all effects, linear
        between its angles [rad]; empty for none
    """

    natural: bool = True
    angles: tuple[float, ...] = ()
    relative: tuple[float, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Blur:
    """Blur in addition to diffraction.

    aberration : standard deviation of a Gaussian in the image plane [m]
    defocus : from the plane of best focus to the detector [m]
    """

    aberration: float = 0.0
    defocus: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Zone:
    """Blur at a distance from the principal point.

    share : that distance over the half diagonal of the image, 0..1
    blur : there
    """

    share: float
    blur: Blur


@dataclass(frozen=True, kw_only=True)
class PointSpread:
    """The point spread function.

    diffraction : of a circular pupil, by band and f-number
    zones : at least one, by increasing share; between two zones their images are mixed
    image : instead, rows of a measured point spread, non-negative, centred on the point
    image_scale : samples of ``image`` per pixel along an edge
    """

    diffraction: bool = True
    zones: tuple[Zone, ...] = (Zone(share=0.0, blur=Blur()),)
    image: tuple[tuple[float, ...], ...] | None = None
    image_scale: int = 1


@dataclass(frozen=True, kw_only=True)
class LensSurface:
    """A refracting surface of a lens.

    radius : of curvature [m], positive if the centre lies behind the surface; infinite for a plane
    gap : to the next surface [m]; ignored for the last one
    index : of refraction of the medium behind the surface
    reflectance : of the coating, 0..1
    """

    radius: float
    gap: float
    index: float
    reflectance: float


@dataclass(frozen=True, kw_only=True)
class Lens:
    """A lens.

    focal_length : along the image's rows [m]
    f_number : focal length over the diameter of the entrance pupil
    aspect : focal length along its columns over that along its rows
    skew : shift along the rows per length along the columns, over the focal length; 0 for square
        axes
    principal_offset : from the centre of the detector to the boresight's image, right and down [m]
    transmission : per band R, G, B, N, 0..1
    camera_equation : "4N2", pi L T / (4 N^2), for a distant object and an aplanatic lens; or
        "1+4N2", for a thin lens with a plane pupil
    vignetting : loss of light off the axis
    distortion : projection of directions; None for a pinhole
    spread : point spread function; None for none
    veiling_glare : fraction of the light that is scattered uniformly over the image
    surfaces : from front to back, for ghosts of the Sun; scaled to the focal length; empty for none
    """

    focal_length: float
    f_number: float
    transmission: PerBand = (1.0, 1.0, 1.0, 1.0)
    camera_equation: CameraEquation = "4N2"
    vignetting: Vignetting = Vignetting()
    distortion: Projection | None = None
    spread: PointSpread | None = None
    veiling_glare: float = 0.0
    surfaces: tuple[LensSurface, ...] = ()
    aspect: float = 1.0
    skew: float = 0.0
    principal_offset: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("focal_length", "f_number", "aspect"):
            check_positive(f"lens: {name}", getattr(self, name))
        check_bands("lens: transmission", self.transmission)
        check_within("lens: veiling_glare", self.veiling_glare, 0.0, 1.0)
        check_choice("lens: camera_equation", self.camera_equation, get_args(CameraEquation))
