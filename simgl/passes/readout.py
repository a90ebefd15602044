"""Detector and converter: noise, fixed pattern, full well, digital numbers.

    mean electrons -> pattern, dark current -> shot noise -> particles -> blooming -> full well
                   -> offsets, read noise -> digital numbers

What a camera does not have is not compiled in. What stays with it from frame to frame is drawn once
and kept. Particles, the noise of rows and blooming, which are few numbers or run along columns, are
computed on the CPU.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import moderngl
import numpy as np

from simgl.arrays import Array32, IndexArray
from simgl.camera.blooming import with_blooming
from simgl.camera.camera import Camera
from simgl.camera.detector import Detector
from simgl.camera.noise_streams import PIXELS, camera_salt, epoch_words, row_offsets
from simgl.camera.particle_hits import hits
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import release_all
from simgl.gpu.render_targets import Format, ImageTarget, read_by_texel
from simgl.gpu.uniform_blocks import Block
from simgl.lru_cache import MANY, LruCache

# What the converter gives, eight pixels a texel: on the CPU renderer each texel costs by itself.
DN_FORMAT = Format("u4", 4, packed=True, halves=True)
_FOUR = Format("f4", PIXELS, packed=True)

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
            ("dark_electrons", "f4"),
            ("exposure_time", "f4"),
            # Of the images of one epoch.
            ("image_draw", "u4"),
        ]
    ),
)
_PATTERN = Block(
    "Pattern",
    15,
    np.dtype(
        [
            ("serial", "u4"),
            ("prnu", "f4"),
            ("dead_pixels", "f4"),
            ("hot_pixels", "f4"),
            ("hot_current", "f4"),
            ("dsnu", "f4"),
            ("rows", "f4"),
            ("columns", "f4"),
        ]
    ),
)

# Of the maps in the cache, four bytes a pixel; those of one camera stay whatever their sizes.
_MAX_BYTES = 256 << 20
_OF_A_CAMERA = 4


def pattern_maps(detector: Detector) -> tuple[str, ...]:
    """The maps that a detector's fixed pattern needs."""
    p = detector.pattern
    needed = {
        "GAIN_MAP": p.prnu > 0.0 or p.dead_pixels > 0.0,
        "DARK_MAP": p.hot_pixels > 0.0 and detector.hot_current > 0.0,
        "OFFSET_MAP": p.dsnu > 0.0 or p.rows > 0.0 or p.columns > 0.0,
    }
    return tuple(name for name, wanted in needed.items() if wanted)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Hit:
    """What particles have left.

    rows : all that they have come to, the first and past the last
    electrons : a texture of the image, right in these rows
    """

    rows: tuple[int, int]
    electrons: moderngl.Texture


class ReadoutPass:
    """Everything between mean electrons and DN, seeded by epoch and draw."""

    state = State()

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._programs: dict[tuple[str, ...], FullscreenProgram] = {}
        self._maps = LruCache[tuple[object, ...], ImageTarget](
            MANY, partial(release_all, ctx), max_bytes=_MAX_BYTES
        )
        self._maps.reserve(_OF_A_CAMERA)

    def draw(
        self,
        camera: Camera,
        tai_ns: int,
        seed: int,
        mean_electrons: moderngl.Texture,
        target: moderngl.Framebuffer,
        image_draw: int = 0,
    ) -> None:
        """Fill a target of ``DN_FORMAT``.

        Equal camera name, epoch, draw and seed give equal noise; equal serial number and detector
        give equal patterns.

        mean_electrons : of light, four pixels a texel
        """
        detector = camera.detector
        block = self._values(camera, tai_ns, seed, image_draw)
        charge = {"": mean_electrons}
        after: dict[str, moderngl.Texture] = {}
        passing: list[moderngl.Texture] = []
        for name in pattern_maps(detector):
            (after if name == "OFFSET_MAP" else charge)[name] = self._map(name, detector)
        if detector.row_noise > 0.0:
            offsets = row_offsets(camera, tai_ns, seed, image_draw).astype("<f4")
            size = (1, detector.height)
            after["ROW_OFFSETS"] = self._ctx.texture(size, 1, offsets.tobytes(), dtype="f4")
            read_by_texel(after["ROW_OFFSETS"])
            passing.append(after["ROW_OFFSETS"])
        hit = self._hit(detector, *hits(camera, tai_ns, seed, image_draw))
        if hit is None and detector.particles is not None and not self._knows_hits:
            # With no charge: its shader is compiled for the first image, not when a particle comes.
            hit = self._hit(detector, np.zeros(1, dtype=np.int64), np.zeros(1, dtype=np.int64))
        if detector.blooming > 0.0:
            charge = {"SPILT": self._spilt(detector, block, charge, hit)}
            passing.append(charge["SPILT"])
            hit = None
        self._draw(target, block, charge, after, hit)
        for texture in passing:
            texture.release()

    @property
    def _knows_hits(self) -> bool:
        return any("HITS" in variant for variant in self._programs)

    def _hit(self, detector: Detector, pixels: IndexArray, electrons: IndexArray) -> _Hit | None:
        """What particles have left, uploaded; None where none has come.

        pixels : as row * width + column, in increasing order
        """
        if not pixels.size:
            return None
        width, height = detector.width, detector.height
        first, past = int(pixels[0]) // width, int(pixels[-1]) // width + 1
        rows = np.zeros((past - first, -(-width // PIXELS) * PIXELS), dtype="<f4")
        rows[pixels // width - first, pixels % width] = electrons
        target = self._maps.get(
            ("HITS", width, height),
            lambda: ImageTarget(self._ctx, (width, height), [_FOUR]),
            4 * width * height,
        )
        (texture,) = target.textures
        texture.write(rows.data, viewport=(0, first, texture.width, past - first))
        return _Hit(rows=(first, past), electrons=texture)

    def _spilt(
        self,
        detector: Detector,
        block: dict[str, object],
        charge: dict[str, moderngl.Texture],
        hit: _Hit | None,
    ) -> moderngl.Texture:
        collected = ImageTarget(self._ctx, (detector.width, detector.height), [_FOUR])
        self._draw(collected.framebuffer, block, charge, {}, hit, ("COLLECT",))
        electrons = collected.read()
        release_all(self._ctx, collected)
        return self._four(with_blooming(electrons, detector.full_well, detector.blooming))

    def _four(self, image: Array32) -> moderngl.Texture:
        """An image as a texture of four pixels a texel."""
        height, width = image.shape
        texels = -(-width // PIXELS)
        padded = np.zeros((height, texels * PIXELS), dtype="<f4")
        padded[:, :width] = image
        texture = self._ctx.texture((texels, height), PIXELS, padded.tobytes(), dtype="f4")
        read_by_texel(texture)
        return texture

    def _values(self, camera: Camera, tai_ns: int, seed: int, image_draw: int) -> dict[str, object]:
        d = camera.detector
        return {
            "frame": epoch_words(tai_ns),
            "seed": seed,
            "camera_salt": camera_salt(camera.name),
            "full_well": d.full_well,
            "read_noise": d.read_noise,
            "gain_dn_per_e": d.gain_dn_per_e,
            "pedestal": d.pedestal,
            "largest_dn": d.largest_dn,
            "dark_electrons": d.dark_current * camera.exposure_time,
            "exposure_time": camera.exposure_time,
            "image_draw": image_draw,
        }

    def _draw(
        self,
        target: moderngl.Framebuffer,
        block: dict[str, object],
        charge: dict[str, moderngl.Texture],
        after: dict[str, moderngl.Texture],
        hit: _Hit | None,
        further: tuple[str, ...] = (),
    ) -> None:
        """Each row with the program that it needs.

        charge, after : textures of what makes up the charge of a pixel, and of what comes after the
            well, by what they switch on
        """
        first, past = (0, 0) if hit is None else hit.rows
        for start, end in ((0, first), (first, past), (past, target.height)):
            if start == end:
                continue
            struck = {} if hit is None or start != first else {"HITS": hit.electrons}
            textures = charge | struck | after
            rows = 0, start, target.width, end - start
            self.state.apply(self._ctx, target, (0, 0, *target.size), rows)
            self._program(textures, further).draw(block, list(textures.values()))

    def _program(
        self, textures: dict[str, moderngl.Texture], further: tuple[str, ...]
    ) -> FullscreenProgram:
        variant = (*(name for name in textures if name), *further)
        if variant not in self._programs:
            samplers = [_SAMPLERS[name] for name in textures]
            self._programs[variant] = FullscreenProgram(
                self._ctx, "readout/readout", _DETECTOR, samplers, variant
            )
        return self._programs[variant]

    def _map(self, name: str, detector: Detector) -> moderngl.Texture:
        """One map of a detector's pattern, drawn at the first call."""
        d = detector
        key = name, d.width, d.height, d.serial, d.pattern, d.hot_current
        size = 4 * d.width * d.height
        drawn = self._maps.get(key, lambda: self._drawn(name, detector), size)
        return drawn.textures[0]

    def _drawn(self, name: str, detector: Detector) -> ImageTarget:
        p = detector.pattern
        program = FullscreenProgram(self._ctx, "readout/pattern", _PATTERN, [], [name])
        target = ImageTarget(self._ctx, (detector.width, detector.height), [_FOUR])
        self.state.apply(self._ctx, target.framebuffer, (0, 0, *target.framebuffer.size))
        values = {
            "serial": detector.serial,
            "prnu": p.prnu,
            "dead_pixels": p.dead_pixels,
            "hot_pixels": p.hot_pixels,
            "hot_current": detector.hot_current,
            "dsnu": p.dsnu,
            "rows": p.rows,
            "columns": p.columns,
        }
        program.draw(values, [])
        program.release()
        return target

    def release(self) -> None:
        """Free everything."""
        for program in self._programs.values():
            program.release()
        self._programs.clear()
        self._maps.clear()


_SAMPLERS = {
    "": "mean_electrons",
    "SPILT": "spilt_electrons",
    "GAIN_MAP": "gain_map",
    "DARK_MAP": "dark_map",
    "OFFSET_MAP": "offset_map",
    "ROW_OFFSETS": "row_offsets",
    "HITS": "hits",
}
