"""The tables of an air as textures: of its parts, and of the whole that images read."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import moderngl
import numpy as np

from simgl.arrays import Array, Array32
from simgl.gpu.release import all_or_nothing
from simgl.gpu.uniform_blocks import UniformBuffer
from simgl.passes.background.air_tables import (
    ABSORPTION,
    AIR,
    PROFILE,
    TABLES,
    AirKind,
    Texture,
    air_values,
    medium_textures,
    tables_of,
    texture_of,
)
from simgl.physics.atmosphere import (
    Air,
    Atmosphere,
    BandAir,
    band_transmittance,
    optical_depth_to_space,
)
from simgl.progress import ProgressCallback

# Of the whole air, those that images read.
SUMMED = ("transmittance_table", "diffuse_down")
# What passes the air twice; heights [m], and places by the root of a cosine.
PAIRS = "air_pairs"
PAIR_HEIGHTS = np.linspace(0.0, 16e3, 9)
_PAIR_PLACES = 32


@dataclass(frozen=True, kw_only=True)
class EarthAir:
    """What the tables depend on.

    radius : of the ground [m]
    albedo : mean of the ground, per band
    """

    air: Air
    radius: float
    albedo: tuple[float, float, float, float]

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        """Of all its numbers, once: every view asks several caches."""
        return hash((self.air, self.radius, self.albedo))


def parts_of_kind(kind: EarthAir) -> list[tuple[AirKind, Array]]:
    """The parts of an air, with the shares of their terms in each band (4, 4)."""
    air = kind.air
    if isinstance(air, Atmosphere):
        return [(AirKind(air=air, radius=kind.radius, albedo=kind.albedo), np.eye(4))]
    return [
        (
            AirKind(air=part, radius=kind.radius, albedo=_albedo_of_terms(kind, np.array(shares))),
            np.array(shares),
        )
        for part, shares in zip(air.parts, air.shares, strict=True)
    ]


def _albedo_of_terms(kind: EarthAir, shares: Array) -> tuple[float, float, float, float]:
    a, b, c, d = (kind.albedo[band] for band in np.argmax(shares, axis=0).tolist())
    return a, b, c, d


def medium_samplers(air: Atmosphere) -> list[str]:
    """What a march reads of the medium."""
    return [PROFILE, *([ABSORPTION] if air.absorbers else [])]


class _PartTables:
    """The tables of a part as textures, and the block that goes with them."""

    @all_or_nothing
    def __init__(
        self, ctx: moderngl.Context, part: AirKind, shares: Array, arrays: dict[str, Array32]
    ) -> None:
        self.air, self.shares = part.air, shares
        self.block = UniformBuffer(ctx, AIR)
        self.block.write(air_values(part, shares))
        self.textures = {name: texture_of(ctx, arrays[name]) for name in TABLES}
        self.textures |= medium_textures(ctx, part.air)

    def release(self) -> None:
        """Free everything."""
        self.block.release()
        for texture in self.textures.values():
            texture.release()


class AirTables:
    """The tables of an air.

    parts : those that light is marched through
    textures : of the whole air, what images read: ``transmittance_table``, ``diffuse_down``, and
        ``PAIRS`` where light falls by no one exponential
    """

    def __init__(
        self, ctx: moderngl.Context, kind: EarthAir, progress: ProgressCallback | None = None
    ) -> None:
        self.parts: list[_PartTables] = []
        self.textures: dict[str, Texture] = {}
        self._summed: list[Texture] = []
        try:
            self._make(ctx, kind, progress)
        except BaseException:
            self.release()
            raise

    def _make(
        self, ctx: moderngl.Context, kind: EarthAir, progress: ProgressCallback | None
    ) -> None:
        sums: dict[str, Array] = dict.fromkeys(SUMMED, np.zeros(4))
        for part, shares in parts_of_kind(kind):
            arrays = tables_of(ctx, part, progress)
            self.parts.append(_PartTables(ctx, part, shares, arrays))
            sums = {name: sums[name] + arrays[name] @ shares.T for name in SUMMED}
        if isinstance(kind.air, BandAir):
            sums[PAIRS] = pair_table(kind.air, kind.radius)
            self.textures = {n: texture_of(ctx, one.astype(np.float32)) for n, one in sums.items()}
            self._summed = list(self.textures.values())
        else:
            self.textures = {name: self.parts[0].textures[name] for name in SUMMED}

    @property
    def block(self) -> UniformBuffer:
        """What images read of it is the same in all parts."""
        return self.parts[0].block

    def release(self) -> None:
        """Free everything."""
        for texture in self._summed:
            texture.release()
        for part in self.parts:
            part.release()


def pair_table(air: BandAir, radius: float) -> Array:
    """(heights, suns, views, 4) what passes the air twice over the product of what passes it once.

    Down to a height and up again, by ``PAIR_HEIGHTS`` and the roots of both cosines from the
    vertical. Lines that took light on the way down have little left to take.
    """
    cosines = np.maximum(np.linspace(0.0, 1.0, _PAIR_PLACES) ** 2, 1e-4)
    table = []
    for height in PAIR_HEIGHTS:
        depth = optical_depth_to_space(air, radius, float(height), cosines)
        once = band_transmittance(air, depth)
        twice = band_transmittance(air, depth[:, None] + depth[None])
        product = once[:, None] * once[None]
        table.append(np.divide(twice, product, out=np.ones_like(twice), where=product > 1e-30))
    return np.array(table)
