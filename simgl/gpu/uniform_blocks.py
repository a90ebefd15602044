"""Uniform blocks whose GLSL text is generated from the numpy dtype that packs them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np

from simgl.arrays import AnyArray
from simgl.errors import ShaderError

_SCALARS = {"f4": ("float", "vec"), "i4": ("int", "ivec"), "u4": ("uint", "uvec")}


def _glsl_type(name: str, dtype: np.dtype[Any]) -> tuple[str, str, int]:
    """GLSL type, array suffix and std140 alignment of one field."""
    base, shape = dtype.subdtype or (dtype, ())
    scalar, vector = _SCALARS.get(base.str[1:], ("", ""))
    if not scalar:
        raise ShaderError(f'block field "{name}": {base} has no GLSL type')
    if shape == ():
        return scalar, "", 4
    if shape == (2,):
        return f"{vector}2", "", 8
    if shape == (4,):
        return f"{vector}4", "", 16
    if shape == (4, 4) and scalar == "float":
        return "mat4", "", 16
    if len(shape) == 2 and shape[1] == 4:
        return f"{vector}4", f"[{shape[0]}]", 16
    if len(shape) == 3 and shape[1:] == (4, 4) and scalar == "float":
        return "mat4", f"[{shape[0]}]", 16
    raise ShaderError(f'block field "{name}": shape {shape} has no std140 layout without padding')


@dataclass(frozen=True)
class Member:
    """One of a block in GLSL: its name, type, and "[3]" behind that of an array of three."""

    name: str
    kind: str
    array: str


@dataclass(frozen=True)
class Block:
    """A std140 uniform block, described once.

    name : of the block in GLSL
    binding : the binding point that it keeps in every program
    dtype : structured; field names become GLSL names, C-order matrices go up untransposed
    """

    name: str
    binding: int
    dtype: np.dtype[Any]

    @property
    def include(self) -> str:
        """The name under which shaders include the generated text."""
        return f"block/{self.name.lower()}"

    @property
    def members(self) -> list[Member]:
        """In their order; raises ShaderError where numpy and std140 disagree."""
        members, offset = [], 0
        assert self.dtype.fields is not None
        for field in self.dtype.names or ():
            dtype, start = self.dtype.fields[field][:2]
            kind, suffix, alignment = _glsl_type(field, dtype)
            if start % alignment or start != offset:
                raise ShaderError(
                    f'block {self.name}: field "{field}" lies at byte {start}, std140 wants '
                    f"a multiple of {alignment}; reorder the dtype"
                )
            offset = start + dtype.itemsize
            members.append(Member(field, kind, suffix))
        if self.dtype.itemsize % 16:
            size = self.dtype.itemsize
            raise ShaderError(f"block {self.name}: size {size} is not a multiple of 16")
        return members

    @property
    def glsl(self) -> str:
        """The block's declaration; raises ShaderError where numpy and std140 disagree."""
        return self.declaration(str)

    def declaration(self, named: Callable[[str], str]) -> str:
        """The same with other names.

        named : of a member, its name in GLSL
        """
        lines = [f"    {m.kind} {named(m.name)}{m.array};" for m in self.members]
        body = "\n".join(lines)
        return f"layout(std140, row_major) uniform {self.name} {{\n{body}\n}};\n"


_NONE: Mapping[str, Any] = {}
# OpenGL's largest step between blocks that one buffer holds [bytes].
_SLOT = 256


class UniformBuffer:
    """A block's bytes on the GPU, several times where slots differ in some of its fields."""

    def __init__(self, ctx: moderngl.Context, block: Block, slots: int = 1) -> None:
        self.block = block
        self._size = block.dtype.itemsize
        self._step = self._size if slots == 1 else -(-self._size // _SLOT) * _SLOT
        self._buffer = ctx.buffer(reserve=slots * self._step)
        self._packed, self._written = np.zeros((slots, self._step), dtype=np.uint8), b""
        self._constants: Mapping[str, Any] = _NONE
        packed = self._packed[:, : self._size].view(block.dtype)[:, 0]
        names = block.dtype.names or ()
        self._fields = {name: packed[name] for name in names if "_padding" not in name}

    def write(
        self,
        values: Mapping[str, Any],
        by_slot: Mapping[str, AnyArray] = _NONE,
        constants: Mapping[str, Any] = _NONE,
    ) -> None:
        """Pack, and upload what has changed; every field must be given, but for those named
        ``..._padding...``.

        values : of every slot
        by_slot : of the first, the second and so on
        constants : of every slot; packed only where they are another mapping than the last time, so
            that nobody may change them
        """
        given = {**values, **by_slot, **constants} if by_slot or constants else values
        if given.keys() != self._fields.keys():
            missing = sorted(given.keys() ^ self._fields.keys())
            raise ShaderError(f"block {self.block.name}: fields {missing} do not match")
        for name, value in values.items():
            self._fields[name][...] = value
        for name, value in by_slot.items():
            self._fields[name][: len(value)] = value
        if constants is not self._constants:
            for name, value in constants.items():
                self._fields[name][...] = value
            self._constants = constants
        if (packed := self._packed.tobytes()) != self._written:
            self._buffer.write(packed)
            self._written = packed

    def bind(self, slot: int = 0) -> None:
        """Bind a slot to the block's binding point."""
        place = {"offset": slot * self._step, "size": self._size}
        self._buffer.bind_to_uniform_block(self.block.binding, **place)

    def release(self) -> None:
        """Free the buffer."""
        self._buffer.release()
