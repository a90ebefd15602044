"""The ordered passes that turn radiance into irradiance, electrons and digital numbers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import moderngl

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.camera.camera_equation import square_electrons_per_irradiance
from simgl.camera.point_spread import SunInCamera, has_spread
from simgl.gpu.context import prefers_compute
from simgl.gpu.release import all_or_nothing, release_all
from simgl.gpu.render_targets import Area, Format, ImageTarget, TargetStore
from simgl.gpu.timers import PassTimer
from simgl.passes.compute_spread import ComputeSpreadPass
from simgl.passes.exposure import ELECTRONS_FORMAT, ExposurePass
from simgl.passes.optics import OpticsPass
from simgl.passes.readout import DN_FORMAT, ReadoutPass
from simgl.passes.spread import SpreadPass

_BANDS = (Format("f4", 4),)
_ELECTRONS = (ELECTRONS_FORMAT,)
_DN = (DN_FORMAT,)


@dataclass(frozen=True, kw_only=True, eq=False)
class ColourLight:
    """What pixels of one colour see, whose share of some light is not that of the Sun's.

    camera : in which all other pixels are blind
    photons_per_joule : (4,) of the light in each band
    sun : gives ghosts
    """

    camera: Camera
    photons_per_joule: Array
    radiance: ImageTarget
    sun: SunInCamera | None


class CameraPipeline:
    """Lens and detector of any camera: owns their passes and targets in one OpenGL context.

    timer : where the passes' times go; one of its own if not given
    Each answer is valid until the next call of its kind at this size.
    """

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, timer: PassTimer | None = None) -> None:
        self._ctx = ctx
        self._timer = PassTimer(ctx) if timer is None else timer
        self._optics = OpticsPass(ctx)
        self._spread = ComputeSpreadPass(ctx) if prefers_compute(ctx) else SpreadPass()
        self._exposure = ExposurePass(ctx)
        self._detector = ReadoutPass(ctx)
        self._targets = TargetStore(ctx)

    def irradiance(
        self, camera: Camera, radiance: ImageTarget, sun: SunInCamera | None = None
    ) -> ImageTarget:
        """Irradiance of the image plane per band [W m-2], RGBA32F.

        sun : gives ghosts
        """
        target = self._target("irradiance", camera, _BANDS)
        if has_spread(camera):
            with self._timer.measure("spread"):
                self._spread.bands(camera, sun, radiance, target)
        else:
            with self._timer.measure("optics"):
                self._optics.draw(camera, radiance.textures[0], target.framebuffer)
        return target

    def electrons_through(
        self,
        camera: Camera,
        photons_per_joule: Array,
        radiance: ImageTarget,
        sun: SunInCamera | None = None,
        lit_area: Area | None = None,
    ) -> ImageTarget:
        """Mean electrons [e-] of a radiance, in ``ELECTRONS_FORMAT``.

        lit_area : outside which the radiance is 0; None where nothing is known of it

        A lens that spreads light works on what the detector's filters make of the bands, not on
        the bands: one sum for a monochrome detector, three for one of colour.
        """
        target = self._target("electrons", camera, _ELECTRONS)
        if has_spread(camera):
            light = camera, photons_per_joule, radiance, sun
            self._spread_electrons(*light, target, lit_area=lit_area)
            return target
        relative = self._optics.relative_illumination(camera)
        seen = radiance.textures[0]
        with self._timer.measure("exposure"):
            self._exposure.draw_through_lens(
                camera, photons_per_joule, seen, relative, target.framebuffer
            )
        return target

    def electrons_by_colour(self, camera: Camera, parts: Iterable[ColourLight]) -> ImageTarget:
        """Mean electrons [e-] where pixels of each colour see their own light.

        parts : at least one, each asked for when the one before has been used
        """
        target = self._target("electrons", camera, _ELECTRONS)
        if has_spread(camera):
            for number, part in enumerate(parts):
                light = part.camera, part.photons_per_joule, part.radiance, part.sun
                self._spread_electrons(*light, target, adds=number > 0)
            return target
        relative = self._optics.relative_illumination(camera)
        target.blacken()
        for part in parts:
            seen = part.radiance.textures[0]
            with self._timer.measure("exposure"):
                self._exposure.add_through_lens(
                    part.camera,
                    part.photons_per_joule,
                    seen,
                    relative,
                    target.framebuffer,
                )
        return target

    def _spread_electrons(
        self,
        camera: Camera,
        photons_per_joule: Array,
        radiance: ImageTarget,
        sun: SunInCamera | None,
        target: ImageTarget,
        *,
        lit_area: Area | None = None,
        adds: bool = False,
    ) -> None:
        one_second = replace(camera, exposure_time=1.0)
        square = square_electrons_per_irradiance(one_second, photons_per_joule)
        with self._timer.measure("spread"):
            self._spread.electrons(
                camera, square, sun, radiance, target, lit_area=lit_area, adds=adds
            )

    def electrons(
        self, camera: Camera, photons_per_joule: Array, irradiance: ImageTarget
    ) -> ImageTarget:
        """Mean electrons [e-], in ``ELECTRONS_FORMAT``."""
        target = self._target("electrons", camera, _ELECTRONS)
        with self._timer.measure("exposure"):
            source = irradiance.textures[0]
            self._exposure.draw(camera, photons_per_joule, source, target.framebuffer)
        return target

    def digital(
        self,
        camera: Camera,
        tai_ns: int,
        seed: int,
        electrons: ImageTarget,
        draw: int = 0,
        place: int = 0,
    ) -> ImageTarget:
        """Digital numbers, in ``DN_FORMAT``.

        draw : of the images of one epoch
        place : images in different places are valid at the same time
        """
        target = self._target(f"dn {place}", camera, _DN)
        with self._timer.measure("detector"):
            source = electrons.textures[0]
            self._detector.draw(camera, tai_ns, seed, source, target.framebuffer, draw)
        return target

    def _target(self, use: str, camera: Camera, formats: tuple[Format, ...]) -> ImageTarget:
        return self._targets.of(use, (camera.detector.width, camera.detector.height), formats)

    def release(self) -> None:
        """Free everything that this imager made."""
        owners = self._targets, self._optics, self._spread, self._exposure, self._detector
        release_all(self._ctx, *owners)

    def __enter__(self) -> CameraPipeline:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()
