"""Values of uniform blocks that the corners of a full-screen triangle hand to its fragments.

For each eight pixels llvmpipe reads a number of a block with eight loads, forty instructions in
all. What is flat over a triangle costs it one.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from simgl.gpu.glsl import Stage
from simgl.gpu.uniform_blocks import Block

# Vectors of up to four numbers; llvmpipe takes 32.
MAX_VECTORS = 30
_WORD = re.compile(r"\w+")


def placeholder(block: Block) -> str:
    """What stands in a fragment stage for a block until ``hand_values`` has chosen its members."""
    return f"@{block.name}"


@dataclass(frozen=True)
class HandedValues:
    """How the members of blocks reach a fragment stage.

    vertex : declares the blocks, and hands values on
    fragment : the stage, with the declarations of what it gets
    """

    vertex: str
    fragment: Stage


def hand_values(fragment: Stage, blocks: Sequence[Block]) -> HandedValues:
    """Hand on as many as fit of the members that the stage names and that are no arrays; the others
    stay in their blocks.

    fragment : with a ``placeholder`` for each block that it includes
    """
    named = set(_WORD.findall(fragment.text))
    text, vertex, hands = fragment.text, [], []
    left = MAX_VECTORS
    for block in blocks:
        if f"{placeholder(block)}\n" not in text:
            continue
        declared, reads_block = [], False
        for member in block.members:
            if member.name not in named:
                continue
            vectors = 4 if member.kind == "mat4" else 1
            if member.array or vectors > left:
                declared.append(f"#define {member.name} {_in_block(member.name)}")
                reads_block = True
                continue
            left -= vectors
            declared.append(f"flat in {member.kind} {member.name};")
            vertex.append(f"flat out {member.kind} {member.name};")
            hands.append(f"    {member.name} = {_in_block(member.name)};")
        renamed = block.declaration(_in_block)
        vertex.append(renamed)
        lines = [renamed] * reads_block + declared
        text = text.replace(f"{placeholder(block)}\n", "\n".join(lines) + "\n")
    vertex += ["void hand_values() {", *hands, "}"]
    return HandedValues("\n".join(vertex), Stage(text, fragment.files))


def _in_block(member: str) -> str:
    return f"{member}_in_block"
