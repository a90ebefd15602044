"""The air before a camera: which tables its image reads, drawn where they are not there yet.

A view's table holds for one height and one angle of the Sun, and for all directions. Heights are
taken in steps, fine enough not to show; angles of the Sun lie between four nodes, whose tables are
marched and then mixed, so that a moving Sun costs a march only when it passes a node. Nodes lie
close where the Sun is low over some of what is seen, and eight times as far apart where it is high
over all of it. The table's rows lie in parts, each with nodes of its own between those of the
others: while the Sun moves evenly a few rows are marched in each frame, and all of them only where
the height passes a step. What the air lets through does not depend on the Sun. Images from one
place share the tables: those of a camera, and the six that a spacecraft near it sees around it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from math import acos, exp, floor, log, log1p, pi

import moderngl
import numpy as np

from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing, release_all
from simgl.gpu.render_targets import Format, ImageTarget
from simgl.gpu.uniform_blocks import Block, UniformBuffer
from simgl.lru_cache import LruCache
from simgl.passes.background.air_march import (
    AIR_VIEW,
    COLUMNS,
    MARCHED,
    STEPS,
    AirMarch,
    MarchedRows,
)
from simgl.passes.background.air_tables import AIR, medium_defines
from simgl.passes.background.earth_air import PAIRS, AirTables, EarthAir, medium_samplers
from simgl.passes.shared_blocks import AirBetween
from simgl.physics.air_profile import AIR_TOP
from simgl.physics.constants import WGS84_EQUATORIAL_RADIUS
from simgl.physics.frames import angle_between
from simgl.progress import ProgressCallback
from simgl.scene.earth import Earth
from simgl.view.aerial_perspective import AirSegment
from simgl.view.background import PlanetView

# What a variant of a shader that looks through the air reads, besides the blocks.
AIR_SAMPLERS = ("transmittance_table", "diffuse_down", "view_light", "view_transmittance")

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
# The steps of a view: of its height, relative, and between the Sun's nodes [rad]: 400 m at 400 km,
# and 3.6 s on the way round. At the terminator light falls by e in 1.5 degrees, low in the limb's
# blue within half of one: half a step of height is 0.3 % there.
_HEIGHT_STEP, _NODE_STEP = 2.0**-10, 2.0**-8
# Where the Sun stands high over all that is seen nodes may be so many times as far apart: what the
# air lets pass of its light, exp(-t / cos) with t = 0.35, is then interpolated within 5e-5 up to 70
# degrees from the zenith. From 82 degrees on they are close. [rad]
_WIDER, _LOW_SUN, _BLEND = 8.0, np.radians(75.0), np.radians(3.0)
# Parts of a table's rows, and the nodes of each that are cached, in turns.
_PARTS, _SLOTS = 16, 8
# Tables that are cached: a camera's and those of spacecraft near it, mixed, and heights of nodes.
_CAPACITY, _HEIGHTS = 8, 8

# Atmospheres whose tables are cached, some megabytes each.
_MAX_KINDS = 4

_MIX = Block(
    "AirMix",
    24,
    np.dtype(
        [
            # Of the four nodes of each part, and their slots.
            ("node_weights", "f4", (_PARTS, 4)),
            ("node_slots", "i4", (_PARTS, 4)),
            # Rows of a slot, and of a part.
            ("slot_rows", "i4"),
            ("part_rows", "i4"),
            ("mix_padding", "i4", 2),
        ]
    ),
)


@dataclass(frozen=True, kw_only=True, eq=False)
class AirBefore:
    """What a shader binds to look through the air.

    inside : whether the camera stands in it
    textures : in the order of AIR_SAMPLERS
    pairs : table of what passes it twice, of an air in which light falls by no one exponential
    """

    inside: bool
    textures: tuple[moderngl.Texture | moderngl.Texture3D, ...]
    pairs: moderngl.Texture | moderngl.Texture3D | None


@dataclass(frozen=True, kw_only=True, eq=False)
class _Nodes:
    """Tables of one height: of light at the nodes that the Sun has passed last.

    light : ``_SLOTS`` tables, one under the other
    cached : index of the node whose rows a part has in a slot
    """

    kind: EarthAir
    height: float
    inside: bool
    transmittance: ImageTarget
    light: ImageTarget
    cached: dict[tuple[int, int], int]

    @property
    def rows(self) -> int:
        """Of a table."""
        return self.transmittance.size[1]

    @property
    def part_rows(self) -> int:
        """Of a part of a table."""
        return self.rows // _PARTS


class AtmospherePass:
    """Owns the tables of every air in use, and of the views last drawn."""

    state = State()

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._march = AirMarch(ctx)
        self._between: dict[bool, FullscreenProgram] = {}
        self._view = UniformBuffer(ctx, AIR_VIEW)
        self._tables = LruCache[EarthAir, AirTables](_MAX_KINDS, AirTables.release)
        self._mix = FullscreenProgram(ctx, "air/mix", _MIX, ["node_light"])
        self._nodes = LruCache[tuple[object, ...], _Nodes](
            _HEIGHTS, lambda nodes: release_all(ctx, nodes.transmittance, nodes.light)
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

    def _tables_of(self, kind: EarthAir, progress: ProgressCallback | None = None) -> AirTables:
        return self._tables.get(kind, lambda: AirTables(self._ctx, kind, progress))

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
            nodes = self._nodes_of(tables, kind, height, moonlit=planet.moonlit)
            light = self._light(tables, nodes, height, angle)
            self._last = None
            self._view.write(_view_values(planet, kind.radius, height, angle))
            shared = (tables.textures[name] for name in AIR_SAMPLERS[:2])
            of_view = *light.textures, *nodes.transmittance.textures
            pairs = tables.textures.get(PAIRS)
            air = AirBefore(inside=nodes.inside, textures=(*shared, *of_view), pairs=pairs)
            self._last = key, air
        self._view.bind()
        return self._last[1]

    def between(self, segment: AirSegment | None) -> AirBetween | None:
        """The air before a spacecraft; None where there is none. Read back: 4 ms on a CPU."""
        kind = None if segment is None else _kind_of(segment.earth)
        if segment is None or kind is None:
            return None
        target = ImageTarget(self._ctx, (1, 1), (Format("f4", 4),) * 2)
        ends = segment.near / 1e3, segment.far / 1e3
        values = {
            "segment_place": (segment.height / 1e3, segment.mu, *ends),
            "segment_sun": (segment.mu_sun, segment.nu),
        }
        light, transmittance = np.zeros(4), np.zeros(4)
        for part in self._tables_of(kind).parts:
            samplers = [*medium_samplers(part.air), *MARCHED]
            absorbs = bool(part.air.absorbers)
            if absorbs not in self._between:
                self._between[absorbs] = FullscreenProgram(
                    self._ctx,
                    "air/between",
                    _SEGMENT,
                    samplers,
                    {"STEPS": STEPS} | medium_defines(part.air),
                    shared=[AIR],
                )
            self.state.apply(self._ctx, target.framebuffer, (0, 0, 1, 1))
            part.block.bind()
            self._between[absorbs].draw(values, [part.textures[name] for name in samplers])
            of_terms = (target.read(i)[0, 0].astype(np.float64) for i in (0, 1))
            of_bands = [part.shares @ one for one in of_terms]
            light, transmittance = light + of_bands[0], transmittance + of_bands[1]
        release_all(self._ctx, target)
        return AirBetween(light=light * segment.sun_irradiance, transmittance=transmittance)

    def _light(self, tables: AirTables, nodes: _Nodes, height: float, angle: float) -> ImageTarget:
        """The light of a view: between that of the nodes on both sides of the Sun's angle."""
        key = nodes.kind, height, angle
        return self._views.get(key, lambda: self._draw_mixed(tables, nodes, angle))

    def _draw_mixed(self, tables: AirTables, nodes: _Nodes, angle: float) -> ImageTarget:
        weights, slots = np.zeros((_PARTS, 4)), np.zeros((_PARTS, 4), dtype=np.int32)
        for part in range(_PARTS):
            between = _node_place(angle, nodes.height) - part / _PARTS
            below = floor(between)
            weights[part] = _node_weights(between - below)
            for i in range(4):
                index = below + i - 1
                slots[part, i] = slot = index % _SLOTS
                if nodes.cached.get((part, slot)) != index:
                    self._march_node(tables, nodes, part, index)
        target = _new_table(self._ctx, nodes.rows)
        self.state.apply(self._ctx, target.framebuffer, (0, 0, *target.size))
        values = {
            "node_weights": weights,
            "node_slots": slots,
            "slot_rows": nodes.rows,
            "part_rows": nodes.part_rows,
        }
        self._mix.draw(values, nodes.light.textures)
        return target

    def _nodes_of(
        self, tables: AirTables, kind: EarthAir, height: float, *, moonlit: bool
    ) -> _Nodes:
        """Of the Sun or of the Moon: each keeps its own angles while the other's are read."""
        # A step on the other side of the air's top has rows of another kind.
        inside = height < AIR_TOP
        step = _height_step(height)
        step = min(step, AIR_TOP) if inside else max(step, AIR_TOP)

        def made() -> _Nodes:
            # A camera in space looks at no sky.
            rows = _ROWS if inside else _ROWS - _SKY_ROWS
            nodes = _Nodes(
                kind=kind,
                height=step,
                inside=inside,
                transmittance=_new_table(self._ctx, rows),
                light=_new_table(self._ctx, _SLOTS * rows),
                cached={},
            )
            values = _values(kind.radius, step, 0.0)
            wanted = MarchedRows(nodes.transmittance, 0, rows, inside=inside, light=False)
            self._march.fill(tables, wanted, values)
            return nodes

        return self._nodes.get((kind, step, inside, moonlit), made)

    def _march_node(self, tables: AirTables, nodes: _Nodes, part: int, index: int) -> None:
        """Fill the rows of a part for one node."""
        slot = index % _SLOTS
        nodes.cached.pop((part, slot), None)
        angle = _node_angle(index + part / _PARTS, nodes.height)
        values = _values(nodes.kind.radius, nodes.height, angle) | {"first_row": -slot * nodes.rows}
        first = slot * nodes.rows + part * nodes.part_rows
        wanted = MarchedRows(nodes.light, first, nodes.part_rows, inside=nodes.inside, light=True)
        self._march.fill(tables, wanted, values)
        nodes.cached[part, slot] = index

    def release(self) -> None:
        """Free everything."""
        self._last = None
        self._views.clear()
        self._nodes.clear()
        self._mix.release()
        self._tables.clear()
        self._march.release()
        for program in self._between.values():
            program.release()
        self._between.clear()
        self._view.release()


def _kind_of(earth: Earth) -> EarthAir | None:
    if earth.air is None:
        return None
    return EarthAir(air=earth.air, radius=earth.equatorial_radius, albedo=earth.mean_albedo)


def _sun_in_sphere(planet: PlanetView) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Unit direction towards the Sun, stretched like everything in sphere space."""
    radii = np.array(planet.earth.radii)
    stretched = radii[0] / radii * planet.sun_direction_itrf.astype(np.float64)
    return stretched / np.linalg.norm(stretched)


def _new_table(ctx: moderngl.Context, rows: int) -> ImageTarget:
    target = ImageTarget(ctx, (COLUMNS, rows), (Format("f4", 4),))
    for texture in target.textures:
        texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
        texture.repeat_x = texture.repeat_y = False
    return target


def _height_step(height: float) -> float:
    """Height of the tables that serve a view from a height [m]."""
    return exp(round(log(height) / _HEIGHT_STEP) * _HEIGHT_STEP)


def _node_place(angle: float, height: float) -> float:
    """Number of nodes up to an angle of the Sun from the zenith of a height [rad, m]."""
    # On the horizon the Sun stands lower by the angle between both zeniths.
    dip = acos(WGS84_EQUATORIAL_RADIUS / (WGS84_EQUATORIAL_RADIUS + height))
    past = (angle - (_LOW_SUN - dip)) / _BLEND
    # Of the steps from wide to close, the integral of a logistic function.
    close = _BLEND * (max(past, 0.0) + log1p(exp(-abs(past))))
    return (angle / _WIDER + (1.0 - 1.0 / _WIDER) * close) / _NODE_STEP


def _node_angle(place: float, height: float) -> float:
    """Angle of the Sun up to which there are so many nodes: the inverse of ``_node_place``."""
    low, high = -pi, 2.0 * pi
    while (middle := 0.5 * (low + high)) not in (low, high):
        if _node_place(middle, height) < place:
            low = middle
        else:
            high = middle
    return low


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
        "view_columns": COLUMNS,
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
