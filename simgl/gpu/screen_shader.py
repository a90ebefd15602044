"""What a full-screen draw is made of, whichever kind of shader draws it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from simgl.gpu.uniform_blocks import Block


@dataclass(frozen=True, eq=False)
class ScreenShader:
    """The shader ``NAME.frag`` over an area, at a depth.

    depth : -1..1
    blocks, spare : that it reads, bound by whoever owns them; that only other variants read
    samplers, defines : texture units by name; of the variant
    """

    name: str
    depth: float
    blocks: Sequence[Block]
    samplers: Mapping[str, int]
    defines: Mapping[str, float] = field(default_factory=dict)
    spare: Sequence[Block] = ()
