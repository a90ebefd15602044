"""The air before a camera: which tables its image reads, drawn where they are not there yet.

A view's table holds for one height and one angle of the Sun, and for all directions. Heights are
taken in steps, fine enough not to show; angles of the Sun lie between four nodes, whose tables are
marched and then mixed, so that a moving Sun costs a march only when it passes a node. The table's
rows lie in parts, each with nodes of its own between those of the others: while the Sun moves
evenly a few rows are marched in each frame, and all of them only where the height passes a step.
Images from one place share the tables: those of a camera, and the six that a spacecraft near it
sees around it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from math import exp, floor, log

import moderngl
import numpy as np

from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing, release_all
from simgl.gpu.render_targets import Format, ImageTarget
from simgl.gpu.uniform_blocks import Block, UniformBuffer
from simgl.lru_cache import LruCache
from simgl.passes.background.air_tables import AIR, SCATTERING, AirKind, AirTables, tables_of
from simgl.passes.shared_blocks import AirBetween
from simgl.physics.atmosphere import AIR_TOP
from simgl.physics.frames import angle_between
from simgl.progress import ProgressCallback
from simgl.scene.earth import Earth
from simgl.view.aerial_perspective import AirSegment
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
            # Of the part of the table that is marched.
            ("first_row", "f4"),
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
_ROWS = _GROUND_ROWS + _LIMB_ROWS + _SKY_ROWS
_COLUMNS = 96
# Cells of a ray: single scattering within 0.1 % of twice as many.
_STEPS = 48

# The steps of a view: of its height, relative, and between the Sun's nodes [rad]: 400 m at 400 km,
# and 3.6 s on the way round. At the terminator light falls by e in 1.5 degrees, low in the limb's
# blue within half of one: half a step of height is 0.3 % there.
_HEIGHT_STEP, _NODE_STEP = 2.0**-10, 2.0**-8
# Parts of a table's rows.
_PARTS = 16
# Tables that are cached: a camera's and those of spacecraft near it, mixed, and their nodes.
_CAPACITY, _NODE_CAPACITY = 8, 16

# Atmospheres whose tables are cached, some megabytes each.
_MAX_KINDS = 4

_MIX = Block(
    "AirMix",
    24,
    np.dtype(
        [
            ("node_weights", "f4", 4),
            ("first_mixed", "i4"),
            ("mix_padding", "f4"),
            ("mix_padding2", "f4", 2),
        ]
    ),
)
_MIX_SAMPLERS = [f"{name}_{node}" for node in range(4) for name in ("light", "transmittance")]


@dataclass(frozen=True, kw_only=True, eq=False)
class AirBefore:
    """What a shader binds to look through the air.

    inside : whether the camera stands in it
    textures : in the order of AIR_SAMPLERS
    """

    inside: bool
    textures: tuple[moderngl.Texture | moderngl.Texture3D, ...]


class AtmospherePass:
    """Owns the tables of every air in use, and of the views last drawn."""

    state = State()

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._programs: dict[bool, FullscreenProgram] = {}
        self._between: FullscreenProgram | None = None
        self._view = UniformBuffer(ctx, AIR_VIEW)
        self._tables = LruCache[AirKind, AirTables](_MAX_KINDS, AirTables.release)
        self._mix = FullscreenProgram(ctx, "air/mix", _MIX, _MIX_SAMPLERS)
        self._nodes = LruCache[tuple[object, ...], ImageTarget](
            _NODE_CAPACITY * _PARTS, partial(release_all, ctx)
        )
        self._views = LruCache[tuple[object, ...], ImageTarget](
            _CAPACITY, partial(release_all, ctx)
        )
        self._last: tuple[tuple[object, ...], AirBefore] | None = None

    def prepare(self, earth: Earth, progress: ProgressCallback | None = None) -> None:
        """Make the tables that do not depend on a view, so that no frame waits for them."""
        kind = _kind_of(earth)
        if kind is not None:
            self._tables_of(kind, progress)

    def _tables_of(self, kind: AirKind, progress: ProgressCallback | None = None) -> AirTables:
        return self._tables.get(
            kind, lambda: AirTables(self._ctx, kind, tables_of(self._ctx, kind, progress))
        )

    def before(self, planet: PlanetView) -> AirBefore | None:
        """The air before a pinhole, its blocks bound; None where there is none.

        May draw: to be called before a pass sets its state.
        """
        kind = _kind_of(planet.earth)
        if kind is None:
            return None
        tables = self._tables_of(kind)
        tables.block.bind()
        # The faces of a sky look from one place.
        place = planet.earth.radii, planet.camera_in_sphere.tobytes(), planet.outside
        key = kind, *place, planet.sun_direction_itrf.tobytes()
        if self._last is None or self._last[0] != key:
            height, angle = planet.height, _sun_angle(planet)
            mixed = self._mixed(tables, kind, height, angle)
            self._last = None
            self._view.write(_view_values(planet, kind.radius, height, angle))
            shared = (tables.textures[name] for name in AIR_SAMPLERS[:2])
            air = AirBefore(inside=height < AIR_TOP, textures=(*shared, *mixed.textures))
            self._last = key, air
        self._view.bind()
        return self._last[1]

    def between(self, segment: AirSegment | None) -> AirBetween | None:
        """The air before a spacecraft; None where there is none. Read back: 4 ms on a CPU."""
        kind = None if segment is None else _kind_of(segment.earth)
        if segment is None or kind is None:
            return None
        tables = self._tables_of(kind)
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
        release_all(self._ctx, target)
        return AirBetween(light=light * segment.sun_irradiance, transmittance=transmittance)

    def _mixed(self, tables: AirTables, kind: AirKind, height: float, angle: float) -> ImageTarget:
        """The table of a view: between those of the nodes on both sides of the Sun's angle."""
        key = kind, height, angle
        return self._views.get(key, lambda: self._draw_mixed(tables, kind, height, angle))

    def _draw_mixed(
        self, tables: AirTables, kind: AirKind, height: float, angle: float
    ) -> ImageTarget:
        rows = _rows(height) // _PARTS
        mixed: list[tuple[float, list[moderngl.Texture]]] = []
        for part in range(_PARTS):
            between = angle / _NODE_STEP - part / _PARTS
            below = floor(between)
            nodes = [self._node(tables, kind, height, part, below + i) for i in (-1, 0, 1, 2)]
            mixed.append((between - below, [t for node in nodes for t in node.textures]))
        target = _new_table(self._ctx, _rows(height))
        for part, (share, textures) in enumerate(mixed):
            area = (0, part * rows, _COLUMNS, rows)
            self.state.apply(self._ctx, target.framebuffer, area, area)
            values = {"node_weights": _node_weights(share), "first_mixed": part * rows}
            self._mix.draw(values, textures)
        return target

    def _node(
        self, tables: AirTables, kind: AirKind, height: float, part: int, index: int
    ) -> ImageTarget:
        """The rows of a part, marched for one node."""
        # A step on the other side of the air's top has rows of another kind.
        inside = height < AIR_TOP
        step = _height_step(height)
        step = min(step, AIR_TOP) if inside else max(step, AIR_TOP)
        key = kind, step, inside, part, index
        angle = (index + part / _PARTS) * _NODE_STEP
        return self._nodes.get(
            key, lambda: self._march(tables, kind, step, angle, part, inside=inside)
        )

    def _march(
        self,
        tables: AirTables,
        kind: AirKind,
        height: float,
        angle: float,
        part: int,
        *,
        inside: bool,
    ) -> ImageTarget:
        if inside not in self._programs:
            self._programs[inside] = FullscreenProgram(
                self._ctx,
                "air/view",
                AIR_VIEW,
                _MARCH_SAMPLERS,
                shared=[AIR],
                defines={"STEPS": _STEPS} | ({"AIR_INSIDE": 1} if inside else {}),
            )
        rows = (_ROWS if inside else _ROWS - _SKY_ROWS) // _PARTS
        target = _new_table(self._ctx, rows)
        area = (0, 0, _COLUMNS, rows)
        self.state.apply(self._ctx, target.framebuffer, area, area)
        values = _values(kind.radius, height, angle) | {"first_row": part * rows}
        self._programs[inside].draw(values, [tables.textures[name] for name in _MARCH_SAMPLERS])
        return target

    def release(self) -> None:
        """Free everything."""
        self._last = None
        self._views.clear()
        self._nodes.clear()
        self._mix.release()
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
    return stretched / np.linalg.norm(stretched)


def _new_table(ctx: moderngl.Context, rows: int) -> ImageTarget:
    target = ImageTarget(ctx, (_COLUMNS, rows), (Format("f4", 4),) * 2)
    for texture in target.textures:
        texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
        texture.repeat_x = texture.repeat_y = False
    return target


def _rows(height: float) -> int:
    """Of the table of a height [m]: a camera in space looks at no sky."""
    return _ROWS if height < AIR_TOP else _ROWS - _SKY_ROWS


def _height_step(height: float) -> float:
    """Height of the tables that serve a view from a height [m]."""
    return exp(round(log(height) / _HEIGHT_STEP) * _HEIGHT_STEP)


def _node_weights(x: float) -> tuple[float, float, float, float]:
    """Of four nodes at -1, 0, 1 and 2, in the cubic through them."""
    return (
        -x * (x - 1.0) * (x - 2.0) / 6.0,
        (x + 1.0) * (x - 1.0) * (x - 2.0) / 2.0,
        -(x + 1.0) * x * (x - 2.0) / 2.0,
        (x + 1.0) * x * (x - 1.0) / 6.0,
    )


def _sun_angle(planet: PlanetView) -> float:
    """From the camera's zenith, in sphere space [rad]."""
    return angle_between(planet.camera_in_sphere.astype(np.float64), _sun_in_sphere(planet))


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
        "first_row": 0.0,
    }


def _view_values(
    planet: PlanetView, radius: float, height: float, angle: float
) -> dict[str, object]:
    """The block as an image reads it: its own horizon, the table's layout."""
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
