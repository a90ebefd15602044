"""Programs made from shader files and checked once against what their pass declares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

import moderngl

from simgl import assets
from simgl.errors import ShaderError
from simgl.gpu.compute_glsl import GLSL_VERSION as COMPUTE_GLSL_VERSION
from simgl.gpu.compute_glsl import as_compute, is_of_draw
from simgl.gpu.context import is_software
from simgl.gpu.glsl import Stage, assemble
from simgl.gpu.handed_values import hand_values, placeholder
from simgl.gpu.held_signals import signals_held
from simgl.gpu.uniform_blocks import Block

# The vertex stage of full-screen passes, and the same with values of blocks.
FULLSCREEN, _WITH_VALUES = "common/fullscreen.vert", "common/fullscreen_values.vert"


def _compile(ctx: moderngl.Context, vertex: Stage, fragment: Stage) -> moderngl.Program:
    try:
        with signals_held():
            return ctx.program(vertex_shader=vertex.text, fragment_shader=fragment.text)
    except moderngl.Error as error:
        log = str(error)
        # moderngl names the failed stage in the log's head, above a line of "=".
        stage = vertex if "vertex_shader" in log.partition("=")[0] else fragment
        lines = [line for line in log.splitlines() if line.strip(" =")]
        raise ShaderError("\n".join(stage.explain(line) for line in lines)) from None


def load_program(
    ctx: moderngl.Context,
    name: str,
    *,
    vertex: str | None = None,
    blocks: Sequence[Block] = (),
    spare: Sequence[Block] = (),
    samplers: Sequence[str] | Mapping[str, int] = (),
    defines: Mapping[str, int | float] | None = None,
) -> moderngl.Program:
    """The program of ``NAME.vert`` and ``NAME.frag``, its blocks and samplers bound and checked.

    name : e.g. ``surface/surface``
    vertex : another vertex stage; of ``FULLSCREEN`` the corners hand the fragments values of the
        blocks on a CPU renderer (``hand_values``)
    spare : blocks that only other variants of the shader read, by its ``#ifdef``
    samplers : texture units are their places in this sequence, or given by name

    Raises ShaderError where a block's size differs from its dtype, or a sampler or block is
    declared on one side only.
    """
    if not isinstance(samplers, Mapping):
        samplers = {sampler: unit for unit, sampler in enumerate(samplers)}
    stages = _stages(ctx, name, vertex or f"{name}.vert", blocks, spare, defines)
    return _checked(name, _compile(ctx, *stages), blocks, samplers)


def _stages(
    ctx: moderngl.Context,
    name: str,
    vertex: str,
    blocks: Sequence[Block],
    spare: Sequence[Block],
    defines: Mapping[str, int | float] | None,
) -> tuple[Stage, Stage]:
    root, fragment = assets.shaders(), f"{name}.frag"
    generated = {block.include: block.glsl for block in (*blocks, *spare)}
    if vertex != FULLSCREEN or not is_software(ctx):
        stages = (assemble(root, stage, defines, generated) for stage in (vertex, fragment))
        return next(stages), next(stages)
    generated |= {block.include: placeholder(block) for block in blocks}
    handed = hand_values(assemble(root, fragment, defines, generated), blocks)
    values = {"block/handed_values": handed.vertex}
    return assemble(root, _WITH_VALUES, defines, values), handed.fragment


def load_compute_shader(
    ctx: moderngl.Context,
    name: str,
    *,
    blocks: Sequence[Block],
    spare: Sequence[Block],
    samplers: Mapping[str, int],
    defines: Mapping[str, int | float],
) -> moderngl.ComputeShader:
    """``NAME.frag`` as a compute shader (``as_compute``), else as ``load_program`` does it."""
    generated = {block.include: block.glsl for block in (*blocks, *spare)}
    stage = as_compute(assemble(assets.shaders(), f"{name}.frag", defines, generated))
    return _checked(name, _compile_compute(ctx, stage), blocks, samplers)


def load_compute_program(
    ctx: moderngl.Context,
    name: str,
    *,
    samplers: Sequence[str],
    parameters: Sequence[str],
    defines: Mapping[str, int | float],
) -> moderngl.ComputeShader:
    """``NAME.comp``, whose buffers have the bindings that are written there.

    samplers : texture units are their places in this sequence
    parameters : all other uniforms

    Raises ShaderError where a uniform is declared on one side only.
    """
    stage = assemble(assets.shaders(), f"{name}.comp", defines, version=COMPUTE_GLSL_VERSION)
    program = _compile_compute(ctx, stage)
    units = {sampler: unit for unit, sampler in enumerate(samplers)}
    return _checked(name, program, (), units, parameters)


def _compile_compute(ctx: moderngl.Context, stage: Stage) -> moderngl.ComputeShader:
    try:
        with signals_held():
            return ctx.compute_shader(stage.text)
    except moderngl.Error as error:
        lines = [line for line in str(error).splitlines() if line.strip(" =")]
        raise ShaderError("\n".join(stage.explain(line) for line in lines)) from None


_Program = TypeVar("_Program", moderngl.Program, moderngl.ComputeShader)


def _checked(
    name: str,
    program: _Program,
    blocks: Sequence[Block],
    samplers: Mapping[str, int],
    parameters: Sequence[str] = (),
) -> _Program:
    """The program with its blocks and samplers bound; released where they do not match."""
    try:
        _bind_and_check(name, program, blocks, samplers, parameters)
    except ShaderError:
        program.release()
        raise
    return program


def _bind_and_check(
    name: str,
    program: moderngl.Program | moderngl.ComputeShader,
    blocks: Sequence[Block],
    samplers: Mapping[str, int],
    parameters: Sequence[str],
) -> None:
    declared = {block.name: block for block in blocks}
    unused = {*samplers, *parameters}
    for key in program:
        member = program[key]
        if isinstance(member, moderngl.UniformBlock):
            block = declared.pop(key, None)
            if block is None:
                raise ShaderError(
                    f"{name}: the shader has a block {key} that the pass does not give"
                )
            if member.size != block.dtype.itemsize:
                raise ShaderError(
                    f"{name}: block {key} has {member.size} bytes in GLSL, "
                    f"{block.dtype.itemsize} in numpy"
                )
            member.binding = block.binding
        elif isinstance(member, moderngl.Uniform):
            if isinstance(program, moderngl.ComputeShader) and is_of_draw(key):
                continue
            unused.discard(key)
            if key in parameters:
                continue
            if key not in samplers:
                raise ShaderError(f"{name}: uniform {key} is not a declared sampler")
            member.value = samplers[key]
    if unused:
        raise ShaderError(f"{name}: samplers {sorted(unused)} are declared but not used")
    if declared:
        raise ShaderError(f"{name}: blocks {sorted(declared)} are declared but not used")
