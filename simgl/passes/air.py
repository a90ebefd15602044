"""The air before a camera: which tables its picture reads, drawn where they are not there yet.

A view's table holds for one height and one angle of the Sun, and for all directions. Both are taken
in steps, fine enough not to show, so that pictures from one place share it: those of a camera, and
the six that a spacecraft near it sees around itself.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass

import moderngl
import numpy as np

from simgl.gpu.blocks import Block, UniformBuffer
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.state import State
from simgl.gpu.targets import Format, ImageTarget
from simgl.passes.air_tables import AIR, SCATTERING, AirKind, AirTables, Progress, tables_of
from simgl.passes.blocks import AirBetween
from simgl.physics.air import AIR_TOP
from simgl.scene.earth import Earth
from simgl.view.air import AirSegment
from simgl.view.background import PlanetView

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
            ("view_padding", "f4"),
        ]
    ),
)

# What a variant of a shader that looks through the air reads, besides the blocks.
AIR_SAMPLERS = ("transmittance_table", "diffuse_down", "view_light", "view_transmittance")

_MARCH_SAMPLERS = ["transmittance_table", *SCATTERING]

_SEGMENT = Block(
    "AirSegment",
    23,
    np.dtype(
        [
            # Height [km], cosine of the view direction, and both ends [km].
            ("segment_place", "f4", 4),
            # Cosines of the Sun's direction from the zenith, and from the view direction.
            ("segment_sun", "f4", 2),
            ("segment_padding", "f4", 2),
        ]
    ),
)

# As in shaders/air/view.glsl; of the half circle of azimuths.
_GROUND_ROWS, _LIMB_ROWS, _SKY_ROWS = 64, 128, 64
_COLUMNS = 96
# Cells of a ray: single scattering within 0.1 % of twice as many.
_STEPS = 48

# The steps of a view: of its height, relative, and of the Sun's angle [rad]: 100 m at 400 km, and
# what 390 m on the ground make. At the terminator, where light falls by e in 1.5 degrees, half a
# step is 0.1 %.
_HEIGHT_STEP, _ANGLE_STEP = 2.0**-12, 2.0**-14
_KEPT = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class AirBefore:
    """What a shader binds to look through the air.

    inside : whether the camera stands in it
    textures : in the order of AIR_SAMPLERS
    """

    inside: bool
    textures: tuple[moderngl.Texture | moderngl.Texture3D, ...]


class AirPass:
    """Owns the tables of every air in use, and of the views last drawn."""

    state = State()

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._programs: dict[bool, FullscreenProgram] = {}
        self._between: FullscreenProgram | None = None
        self._view = UniformBuffer(ctx, AIR_VIEW)
        self._tables: dict[AirKind, AirTables] = {}
        self._views: OrderedDict[tuple[object, ...], ImageTarget] = OrderedDict()

    def prepare(self, earth: Earth, progress: Progress | None = None) -> None:
        """Make the tables that do not depend on a view, so that no frame waits for them."""
        kind = _kind_of(earth)
        if kind is not None and kind not in self._tables:
            made = tables_of(self._ctx, kind, progress)
            self._tables[kind] = AirTables(self._ctx, kind, made)

    def before(self, planet: PlanetView) -> AirBefore | None:
        """The air before a pinhole, its blocks bound; None where there is none.

        May draw: to be called before a pass sets its state.
        """
        kind = _kind_of(planet.earth)
        if kind is None:
            return None
        self.prepare(planet.earth)
        tables = self._tables[kind]
        height, angle = _snapped(planet)
        key = (kind, height, angle)
        tables.block.bind()
        if key not in self._views:
            self._draw(key, tables)
        self._views.move_to_end(key)
        self._view.write(_view_values(planet, kind.radius, height, angle))
        self._view.bind()
        shared = (tables.textures[name] for name in AIR_SAMPLERS[:2])
        return AirBefore(inside=height < AIR_TOP, textures=(*shared, *self._views[key].textures))

    def between(self, segment: AirSegment | None) -> AirBetween | None:
        """The air before a spacecraft; None where there is none. Read back: 4 ms on a CPU."""
        kind = None if segment is None else _kind_of(segment.earth)
        if segment is None or kind is None:
            return None
        self.prepare(segment.earth)
        tables = self._tables[kind]
        if self._between is None:
            self._between = FullscreenProgram(
                self._ctx, "air/between", _SEGMENT, _MARCH_SAMPLERS, {"STEPS": _STEPS}, shared=[AIR]
            )
        target = ImageTarget(self._ctx, (1, 1), (Format("f4", 4),) * 2)
        self.state.apply(self._ctx, target.framebuffer, (0, 0, 1, 1))
        tables.block.bind()
        ends = segment.near / 1e3, segment.far / 1e3
        values = {
            "segment_place": (segment.height / 1e3, segment.mu, *ends),
            "segment_sun": (segment.mu_sun, segment.nu),
        }
        self._between.draw(values, [tables.textures[name] for name in _MARCH_SAMPLERS])
        light, transmittance = (target.read(i)[0, 0].astype(np.float64) for i in (0, 1))
        self._ctx.detect_framebuffer(0).use()
        target.release()
        return AirBetween(light=light * segment.sun_irradiance, transmittance=transmittance)

    def _draw(self, key: tuple[AirKind, float, float], tables: AirTables) -> None:
        kind, height, angle = key
        inside = height < AIR_TOP
        if inside not in self._programs:
            self._programs[inside] = FullscreenProgram(
                self._ctx,
                "air/view",
                AIR_VIEW,
                _MARCH_SAMPLERS,
                shared=[AIR],
                defines={"STEPS": _STEPS} | ({"AIR_INSIDE": 1} if inside else {}),
            )
        size = _COLUMNS, _GROUND_ROWS + _LIMB_ROWS + _SKY_ROWS
        if len(self._views) >= _KEPT:
            target = self._views.popitem(last=False)[1]
        else:
            target = ImageTarget(self._ctx, size, (Format("f4", 4),) * 2)
            for texture in target.textures:
                texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
                texture.repeat_x = texture.repeat_y = False
        rows = size[1] if inside else size[1] - _SKY_ROWS
        area = (0, 0, _COLUMNS, rows)
        self.state.apply(self._ctx, target.framebuffer, area, area)
        sources = [tables.textures[name] for name in _MARCH_SAMPLERS]
        self._programs[inside].draw(_values(kind.radius, height, angle), sources)
        self._views[key] = target

    def release(self) -> None:
        """Free everything."""
        self._ctx.detect_framebuffer(0).use()
        for target in self._views.values():
            target.release()
        self._views.clear()
        for tables in self._tables.values():
            tables.release()
        self._tables.clear()
        for program in self._programs.values():
            program.release()
        self._programs.clear()
        if self._between is not None:
            self._between.release()
            self._between = None
        self._view.release()


def _kind_of(earth: Earth) -> AirKind | None:
    if earth.air is None:
        return None
    return AirKind(air=earth.air, radius=earth.equatorial_radius, albedo=earth.mean_albedo)


def _sun_in_sphere(planet: PlanetView) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Unit direction towards the Sun, stretched like everything in sphere space."""
    radii = np.array(planet.earth.radii)
    stretched = radii[0] / radii * planet.sun_direction_itrf.astype(np.float64)
    return np.asarray(stretched / np.linalg.norm(stretched))


def _snapped(planet: PlanetView) -> tuple[float, float]:
    """Height [m] and the Sun's angle from the zenith [rad] of the table that serves a view."""
    place = planet.camera_in_sphere.astype(np.float64)
    sun = _sun_in_sphere(planet)
    angle = float(np.arctan2(np.linalg.norm(np.cross(place, sun)), np.dot(place, sun)))
    steps = round(float(np.log(planet.height)) / _HEIGHT_STEP)
    return float(np.exp(steps * _HEIGHT_STEP)), round(angle / _ANGLE_STEP) * _ANGLE_STEP


def _values(radius: float, height: float, angle: float) -> dict[str, object]:
    """The block AIR_VIEW as a table's drawing reads it."""
    outside = height * (2.0 * radius + height) / radius**2
    reach = AIR_TOP * (2.0 * radius + AIR_TOP) / radius**2
    return {
        "camera_up": np.zeros(4),
        "sun_side": np.zeros(4),
        "camera_sun": (np.cos(angle), np.sin(angle)),
        "outside_air": outside,
        "horizon_reach": min(outside, reach),
        "camera_nearness": 1.0 / np.sqrt(1.0 + outside),
        "camera_height": height / 1e3,
        "view_columns": _COLUMNS,
    }


def _view_values(
    planet: PlanetView, radius: float, height: float, angle: float
) -> dict[str, object]:
    """The block as a picture reads it: its own horizon, the table's layout."""
    place = planet.camera_in_sphere.astype(np.float64)
    up = place / np.linalg.norm(place)
    sun = _sun_in_sphere(planet)
    side = sun - np.dot(sun, up) * up
    length = float(np.linalg.norm(side))
    if length < 1e-9:
        side = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
        length = float(np.linalg.norm(side))
    reach = AIR_TOP * (2.0 * radius + AIR_TOP) / radius**2
    return _values(radius, height, angle) | {
        "camera_up": (*up, 0.0),
        "sun_side": (*(side / length), 0.0),
        "outside_air": planet.outside,
        "horizon_reach": min(planet.outside, reach),
        "camera_nearness": 1.0 / np.sqrt(1.0 + planet.outside),
    }
