"""The ways in which a lens spreads the light of its bands: on the CPU, and by compute shaders."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import moderngl
import numpy as np

from simgl.arrays import Array32
from simgl.camera.camera import Camera
from simgl.camera.camera_equation import irradiance_per_radiance
from simgl.camera.distortion import relative_illumination
from simgl.camera.point_spread import Spread, SunInCamera
from simgl.gpu.render_targets import Format, ImageTarget
from simgl.passes.compute_spread import ComputeSpreadPass

# From the irradiance (height, width) of each band before the lens to that behind it.
Spreading = Callable[[Camera, Sequence[Array32], SunInCamera | None], list[Array32]]


def on_cpu(cam: Camera, planes: Sequence[Array32], sun: SunInCamera | None = None) -> list[Array32]:
    """By numpy."""
    return Spread(cam).apply(planes, sun)


def on_gpu(gl: moderngl.Context) -> Spreading:
    """By compute shaders, whoever runs them."""

    def spread(
        cam: Camera, planes: Sequence[Array32], sun: SunInCamera | None = None
    ) -> list[Array32]:
        size = cam.detector.width, cam.detector.height
        relative = relative_illumination(cam).astype(np.float64)
        factors = irradiance_per_radiance(cam) * relative[..., None]
        radiance, bands = (ImageTarget(gl, size, [Format("f4", 4)]) for _ in range(2))
        radiance.textures[0].write((np.stack(planes, axis=-1) / factors).astype("<f4").tobytes())
        by_compute = ComputeSpreadPass(gl)
        by_compute.bands(cam, sun, radiance, bands)
        results = bands.read()
        gl.detect_framebuffer(0).use()
        for owner in (radiance, bands, by_compute):
            owner.release()
        return [np.ascontiguousarray(results[..., band]) for band in range(4)]

    return spread
