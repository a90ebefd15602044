"""Marches through the air of a view: rows of its tables, for one height and angle of the Sun."""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np

from simgl.gpu.fullscreen import FullscreenProgram, Screen
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import release_all
from simgl.gpu.render_targets import Format, ImageTarget
from simgl.gpu.screen_shader import ScreenShader
from simgl.gpu.uniform_blocks import Block
from simgl.passes.background.air_tables import AIR, SCATTERING, medium_defines
from simgl.passes.background.earth_air import AirTables, medium_samplers

AIR_VIEW = Block(
    "AirView",
    22,
    np.dtype(
        [
            # Of the camera, in sphere space, and the horizontal direction towards the Sun there.
            ("camera_up", "f4", 4),
            ("sun_side", "f4", 4),
            # Cosine and sine of the Sun's angle from the camera's zenith.
            ("camera_sun", "f4", 2),
            # r^2 - R^2 of the camera, and of its horizon's far end: its own, or the top's [R^2].
            ("outside_air", "f4"),
            ("horizon_reach", "f4"),
            # One over the camera's place in sphere space; its height [km].
            ("camera_nearness", "f4"),
            ("camera_height", "f4"),
            ("view_columns", "f4"),
            # Of the table that is marched, from the target's.
            ("first_row", "f4"),
        ]
    ),
)

# Of a march, besides the medium's.
MARCHED = ["transmittance_table", *SCATTERING]

# Cells of a ray: single scattering within 0.1 % of twice as many. From space so many of them take
# one diffuse light: within 0.03 % of one for each, in 0.6 of the time. Inside the air that of long
# rays through twilight changes too much.
STEPS, _DIFFUSE_CELLS = 48, 3


@dataclass(frozen=True, eq=False)
class MarchedRows:
    """Rows of a target, from one on so many, of a view.

    inside : of a camera inside the air
    light : of light, or else of transmittance
    """

    target: ImageTarget
    first: int
    count: int
    inside: bool
    light: bool


class AirMarch:
    """Owns the programs that march."""

    state = State()
    more = State(blend=(moderngl.ONE, moderngl.ONE))

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._programs: dict[tuple[bool, ...], FullscreenProgram] = {}
        self._roots: dict[bool, Screen] = {}

    def fill(self, tables: AirTables, wanted: MarchedRows, values: dict[str, object]) -> None:
        """Fill rows of a target.

        Where the air has several parts, what their terms add to the bands is summed first.

        values : of the block AIR_VIEW
        """
        area = 0, wanted.first, wanted.target.size[0], wanted.count
        summed = len(tables.parts) > 1 or bool(tables.parts[0].air.absorbers)
        target = wanted.target
        sums = ImageTarget(self._ctx, target.size, (Format("f4", 4),)) if summed else target
        try:
            (self.more if summed else self.state).apply(self._ctx, sums.framebuffer, area, area)
            if summed:
                sums.framebuffer.clear(0.0, 0.0, 0.0, 0.0, viewport=area)
            for part in tables.parts:
                samplers = medium_samplers(part.air) + (MARCHED if wanted.light else [])
                defines = medium_defines(part.air) | ({"SUMMED": 1} if summed else {})
                part.block.bind()
                program = self._view_program(
                    samplers, defines, inside=wanted.inside, light=wanted.light
                )
                program.draw(values, [part.textures[name] for name in samplers])
            tables.block.bind()
            if summed:
                sums.textures[0].use(0)
                root = self._root_program(light=wanted.light)
                root.draw(self.state, target.framebuffer, area)
        finally:
            if summed:
                release_all(self._ctx, sums)

    def _view_program(
        self, samplers: list[str], defines: dict[str, int], *, inside: bool, light: bool
    ) -> FullscreenProgram:
        variant = inside, light, bool(defines)
        if variant not in self._programs:
            wanted = {"AIR_INSIDE": inside, "TRANSMITTANCE": not light}
            self._programs[variant] = FullscreenProgram(
                self._ctx,
                "air/view",
                AIR_VIEW,
                samplers,
                shared=[AIR],
                defines={"STEPS": STEPS, "DIFFUSE_CELLS": 1 if inside else _DIFFUSE_CELLS}
                | defines
                | {name: 1 for name, is_wanted in wanted.items() if is_wanted},
            )
        return self._programs[variant]

    def _root_program(self, *, light: bool) -> Screen:
        if light not in self._roots:
            defines = {} if light else {"TRANSMITTANCE": 1}
            shader = ScreenShader("air/root", 0.0, [], {"air_sums": 0}, defines)
            self._roots[light] = Screen(self._ctx, shader)
        return self._roots[light]

    def release(self) -> None:
        """Free everything."""
        for programs in (self._programs, self._roots):
            for program in programs.values():
                program.release()
            programs.clear()
