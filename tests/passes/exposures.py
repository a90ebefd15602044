"""Cameras and exposures for tests of the detector."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from simgl.arrays import Image16
from simgl.camera.camera import Camera, Detector, Lens
from simgl.gpu.render_targets import ImageTarget
from simgl.passes.exposure import ELECTRONS_FORMAT
from simgl.passes.readout import DN_FORMAT, ReadoutPass

SIDE = 512
EPOCH = 1_774_008_037_000_000_000


def camera(exposure_time: float = 0.001, **changes: Any) -> Camera:
    """1 ms, one DN per electron, no pedestal, no read noise, unless changed."""
    values: dict[str, Any] = {
        "width": SIDE,
        "height": SIDE,
        "pixel_pitch": 5e-6,
        "quantum_efficiency": (0.5, 0.5, 0.5, 0.5),
        "full_well": 60_000.0,
        "read_noise": 0.0,
        "bits": 16,
        "pedestal": 0.0,
        "gain_dn_per_e": 1.0,
    }
    detector = Detector(**(values | changes))
    return Camera(
        name="cam",
        lens=Lens(focal_length=0.01, f_number=4.0),
        detector=detector,
        exposure_time=exposure_time,
    )


def expose(
    gl: moderngl.Context,
    mean: float | NDArray[np.floating[Any]],
    cam: Camera,
    *,
    tai_ns: int = EPOCH,
    seed: int = 1,
    draw: int = 0,
) -> Image16:
    size = (cam.detector.width, cam.detector.height)
    source = ImageTarget(gl, size, [ELECTRONS_FORMAT])
    target = ImageTarget(gl, size, [DN_FORMAT])
    pass_ = ReadoutPass(gl)
    padded = np.zeros((size[1], -(-size[0] // 4) * 4), dtype="<f4")
    padded[:, : size[0]] = mean
    source.textures[0].write(padded.tobytes())
    pass_.draw(cam, tai_ns, seed, source.textures[0], target.framebuffer, draw)
    dn: Image16 = target.read().copy()
    gl.detect_framebuffer(0).use()
    for resource in (source, target, pass_):
        resource.release()
    return dn
