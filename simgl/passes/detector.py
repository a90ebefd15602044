"""Detector and converter: noise, full well, digital numbers."""

from __future__ import annotations

import zlib

import moderngl
import numpy as np

from simgl.gpu.blocks import Block
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.state import State
from simgl.scene.camera import Camera

_DETECTOR = Block(
    "Detector",
    7,
    np.dtype(
        [
            # Low and high half of the epoch [TAI ns]: what makes one frame's noise its own.
            ("frame", "u4", 2),
            ("seed", "u4"),
            ("camera_salt", "u4"),
            ("full_well", "f4"),
            ("read_noise", "f4"),
            ("gain_dn_per_e", "f4"),
            ("pedestal", "f4"),
            ("largest_dn", "f4"),
            ("detector_padding_a", "f4"),
            ("detector_padding_b", "f4"),
            ("detector_padding_c", "f4"),
        ]
    ),
)


class DetectorPass:
    """Shot noise, full well, read noise and analogue-to-digital conversion, seeded by the epoch."""

    state = State()

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._program = FullscreenProgram(ctx, "detector/detector", _DETECTOR, ["mean_electrons"])

    def draw(
        self,
        camera: Camera,
        tai_ns: int,
        seed: int,
        mean_electrons: moderngl.Texture,
        target: moderngl.Framebuffer,
    ) -> None:
        """Fill an R16UI target with DN. Equal camera name, epoch and seed give equal noise."""
        d = camera.detector
        self.state.apply(self._ctx, target, (0, 0, *target.size))
        values = {
            "frame": (tai_ns & 0xFFFFFFFF, (tai_ns >> 32) & 0xFFFFFFFF),
            "seed": seed,
            # Two cameras of one scene must not share their noise; stream numbers are below 16.
            "camera_salt": zlib.crc32(camera.name.encode()) & 0xFFFFFFF0,
            "full_well": d.full_well,
            "read_noise": d.read_noise,
            "gain_dn_per_e": d.gain_dn_per_e,
            "pedestal": d.pedestal,
            "largest_dn": 2**d.bits - 1,
        }
        self._program.draw(values, [mean_electrons])

    def release(self) -> None:
        """Free everything."""
        self._program.release()
