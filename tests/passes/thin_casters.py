"""Sheets, rods and booms in sunlight, and in how many pixels it is not what rays say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import moderngl
import numpy as np
from numpy.typing import ArrayLike

from simgl.arrays import Array, IndexArray, Mask
from simgl.model_files.model_from_mesh import model_from_mesh
from simgl.motion.trajectory import FixedAttitude, Motion, UniformMotion
from simgl.rays import ray_tracer
from simgl.scenario.scenario import Scenario
from simgl.scene.materials import Material
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import SceneState
from tests.scenes import radiance, scene

Place = tuple[float, float, float]

REFLECTANCE = 0.5
GREEN = 174.7738123  # [W m-2] of the Sun in 500-600 nm
# Of the Sun's disc [rad].
RADIUS = np.radians(0.263)
# Places within a pixel at which rays tell the truth, and those of pixels that these leave in doubt:
# sunlight that comes through a gap may fall on a twentieth of a pixel.
_PLACES = 0.5 + np.array([(-0.3, -0.1), (0.1, -0.3), (0.3, 0.1), (-0.1, 0.3)])
_CLOSE_PLACES = (np.stack(np.meshgrid(*2 * [np.arange(12.0)]), axis=-1).reshape(-1, 2) + 0.5) / 12.0
# Of the full sunlight: a sample, a fifth of a pixel, may lie past an edge that all places miss.
_TOLERANCE = 0.25
# Of a box, by its corners: x runs first, then y, then z.
_FACES = np.array(
    [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
)
# Of incidence: where sunlight grazes more, none is looked for.
_LEAST_COSINE = 0.05


@dataclass(frozen=True, kw_only=True)
class ThinScene:
    """Bodies at rest, and a camera that looks at a place.

    bodies : models and their places, ICRF [m]
    camera, target : places [m]
    width_px : of the image along both edges
    """

    bodies: tuple[tuple[SpacecraftModel, Place], ...]
    camera: Place
    target: Place
    focal_length_mm: float = 8.0
    width_px: int = 300

    def scenario(self, sun: Array) -> Scenario:
        """With direct sunlight alone, from a unit direction."""
        # The same field of view at any size.
        pitch_um = 3.75 * 300.0 / self.width_px
        empty = scene(
            {},
            {
                "position_icrf_m": list(self.camera),
                "boresight": list(np.subtract(self.target, self.camera)),
                "up": [0.1, 0.2, 1.0],
                "focal_length_mm": self.focal_length_mm,
                "pixel_pitch_um": pitch_um,
                "width_px": self.width_px,
                "height_px": self.width_px,
            },
            sun_direction=(float(sun[0]), float(sun[1]), float(sun[2])),
            render={"inter_reflection": False},
        )
        still = FixedAttitude(R_icrf_from_body=np.eye(3))
        models, motions = {}, {}
        for number, (model, place) in enumerate(self.bodies):
            name = f"{model.name}_{number}"
            models[name] = model
            where = UniformMotion(position=np.array(place), velocity=np.zeros(3), epoch_tai_ns=0)
            motions[name] = Motion(trajectory=where, attitude=still)
        return replace(empty, models=models, motions=motions)


def sun_directions(count: int) -> Array:
    """(count, 3) unit, evenly over the sphere, none along an axis."""
    k = np.arange(count) + 0.5
    z = 1.0 - 2.0 * k / count
    angle = 2.39996323 * k + 0.4
    across = np.sqrt(1.0 - z * z)
    return np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=1)


def wrong_pixels(
    gl: moderngl.Context, thin: ThinScene, sun: Array, rays: int = 64
) -> tuple[Mask, Mask]:
    """(h, w) pixels brighter or darker than rays at any place around allow; those compared.

    Compared are pixels around which a surface faces the Sun.
    """
    scenario = thin.scenario(sun)
    image = radiance(gl, scenario)[..., 1].astype(np.float64)
    drawn = image / (REFLECTANCE / np.pi * GREEN)
    traced = _Traced(scenario, sun, rays)
    all_pixels = np.ones(drawn.shape, dtype=np.bool_)
    first, *others = (traced.hits(place, all_pixels) for place in _PLACES)
    most = _neighbours(np.max([hits.cosine for hits in (first, *others)], axis=0), np.maximum)
    compared = most > _LEAST_COSINE

    low = traced.lit(first, all_pixels)
    high = low.copy()

    def doubtful() -> Mask:
        least, largest = _neighbours(low, np.minimum), _neighbours(high, np.maximum)
        return (np.maximum(least - drawn, drawn - largest) > _TOLERANCE * most) & compared

    def around_doubtful() -> Mask:
        return _neighbours(doubtful().astype(np.float64), np.maximum) > 0.0

    def allow(hits: _Hits, where: Mask) -> None:
        lit = traced.lit(hits, where)[where]
        low[where] = np.minimum(low[where], lit)
        high[where] = np.maximum(high[where], lit)

    # What the first places of each pixel allow, all of them allow.
    around = around_doubtful()
    for hits in others:
        allow(hits, around)
    around = around_doubtful()
    if around.any():
        for place in _CLOSE_PLACES:
            allow(traced.hits(place, around), around)
    return doubtful(), compared


def _neighbours(image: Array, pick: np.ufunc) -> Array:
    """The least or largest of three by three pixels."""
    for axis in (0, 1):
        padded = np.pad(image, [(1, 1) if a == axis else (0, 0) for a in (0, 1)], mode="edge")
        size = image.shape[axis]
        image = pick.reduce([np.take(padded, range(k, k + size), axis=axis) for k in range(3)])
    return image


@dataclass(frozen=True)
class _Hits:
    """Where rays through one place of each pixel end.

    points, normals : (h * w, 3); NaN in pixels that are not asked for or see space
    cosine : (h, w) of incidence of sunlight; 0 there, and where a surface faces away
    """

    points: Array
    normals: Array
    cosine: Array


class _Traced:
    """What rays say of an image."""

    def __init__(self, scenario: Scenario, sun: Array, rays: int) -> None:
        self._state, self._sun, self._rays = scenario.at(scenario.epoch_tai_ns), sun, rays

    def hits(self, place: Array, where: Mask) -> _Hits:
        """Of rays through a place of the pixels that are asked for."""
        one = self._state.cameras["cam"]
        y, x = np.nonzero(where)
        at = np.stack([x + place[0], y + place[1], np.ones(x.size)])
        ways = np.linalg.solve(one.camera.intrinsics, at).T @ one.R_camera_from_icrf
        points, normals = (np.full((where.size, 3), np.nan) for _ in range(2))
        chosen = where.ravel()
        points[chosen], normals[chosen] = _first_hits(self._state, one.position, ways)
        cosine = np.maximum(np.nan_to_num(normals @ self._sun), 0.0).reshape(where.shape)
        return _Hits(points, normals, cosine)

    def lit(self, hits: _Hits, where: Mask) -> Array:
        """(h, w) cosine of incidence times visible share of the disc; 0 in other pixels."""
        lit, chosen = np.zeros(where.shape), where.ravel()
        points, normals = hits.points[chosen], hits.normals[chosen]
        lit[where] = _disc_shares(self._state, points, normals, self._sun, self._rays)
        return lit * hits.cosine


def _first_hits(state: SceneState, origin: Array, ways: Array) -> tuple[Array, Array]:
    """(n, 3) places that rays meet first, and normals there, on the viewer's side; NaN for none."""
    points, normals = (np.full(ways.shape, np.nan) for _ in range(2))
    nearest = np.full(len(ways), np.inf)
    for body in state.bodies.values():
        start = np.broadcast_to(origin - body.pose.position, ways.shape)
        mesh = body.model.mesh
        triangle, distance = ray_tracer(body.model.posed_mesh).hits(start, ways)
        closer = np.flatnonzero((triangle >= 0) & (distance < nearest))
        nearest[closer] = distance[closer]
        points[closer] = origin + distance[closer, None] * ways[closer]
        a, b, c = np.moveaxis(mesh.positions[mesh.triangles[triangle[closer]]].astype(float), 1, 0)
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        behind = np.einsum("ij,ij->i", normal, ways[closer]) > 0.0
        normals[closer] = np.where(behind[:, None], -normal, normal)
        # On the triangle's own plane, which float32 distances miss by more than rays start off it.
        off = np.einsum("ij,ij->i", a + body.pose.position - points[closer], normals[closer])
        points[closer] += off[:, None] * normals[closer]
    return points, normals


def _disc_shares(state: SceneState, points: Array, normals: Array, sun: Array, rays: int) -> Array:
    """(n,) share of the disc that places see; 0 where they face away from it."""
    share = np.zeros(len(points))
    lit = np.flatnonzero(normals @ sun > 0.0)
    if lit.size == 0:
        return share
    # 20 um off the surface: less than a thirtieth of the least pixel.
    start = points[lit] + 2e-5 * normals[lit]
    open_rays = np.zeros(len(lit))
    for way in _disc(sun, rays):
        blocked = np.zeros(len(lit), dtype=np.bool_)
        for body in state.bodies.values():
            free = np.flatnonzero(~blocked)
            origins = start[free] - body.pose.position
            tracer = ray_tracer(body.model.posed_mesh)
            blocked[free] = tracer.occluded(origins, np.broadcast_to(way, origins.shape))
        open_rays += ~blocked
    share[lit] = open_rays / rays
    return share


def _disc(sun: Array, rays: int) -> Array:
    """(rays, 3) directions evenly over the Sun's disc."""
    k = np.arange(rays)
    radius, angle = np.tan(RADIUS) * np.sqrt((k + 0.5) / rays), 2.39996323 * k
    across = np.cross(sun, np.eye(3)[int(np.argmin(np.abs(sun)))])
    across /= np.linalg.norm(across)
    other = np.cross(sun, across)
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    return np.asarray(sun + x[:, None] * across + y[:, None] * other)


def _model(name: str, corners: Array, triangles: IndexArray, *, sheets: bool) -> SpacecraftModel:
    grey = Material(name="grey", reflectance=(REFLECTANCE,) * 4)
    return model_from_mesh((corners, triangles), name=name, materials=[grey], double_sided=sheets)


def sheets(name: str, quads: Sequence[Array]) -> SpacecraftModel:
    """Double-sided, from the corners of each quadrilateral."""
    corners = np.array(quads, dtype=float).reshape(-1, 3)
    first = 4 * np.arange(len(quads))[:, None]
    triangles = np.concatenate([first + np.array(half) for half in ((0, 1, 2), (0, 2, 3))])
    return _model(name, corners, triangles, sheets=True)


def solids(name: str, bars: Sequence[tuple[ArrayLike, ArrayLike, float]]) -> SpacecraftModel:
    """Closed bars of a square section: their ends, and the width [m]."""
    corners: list[ArrayLike] = []
    triangles: list[IndexArray] = []
    for start, end, width in bars:
        a, b = np.array(start), np.array(end)
        along = (b - a) / np.linalg.norm(b - a)
        u = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
        u /= np.linalg.norm(u)
        v = np.cross(along, u)
        first = 8 * len(corners)
        corners.append(
            [p + 0.5 * width * (i * u + j * v) for p in (a, b) for j in (-1, 1) for i in (-1, 1)]
        )
        triangles += [first + _FACES[:, [0, 1, 2]], first + _FACES[:, [0, 2, 3]]]
    return _model(name, np.concatenate(corners), np.concatenate(triangles), sheets=False)


_ORIGIN: Place = (0.0, 0.0, 0.0)
_X, _Y, _Z = np.eye(3)


def _quad(corner: ArrayLike, along: ArrayLike, up: ArrayLike) -> Array:
    """(4, 3) corners of a parallelogram."""
    start, u, v = (np.asarray(vector, dtype=float) for vector in (corner, along, up))
    return np.stack([start, start + u, start + u + v, start + v])


def thin_walls(name: str, walls: Sequence[tuple[ArrayLike, ArrayLike]]) -> SpacecraftModel:
    """Closed boxes along the axes, from their lowest and highest corners [m]."""
    steps = np.array([(i, j, k) for k in (0, 1) for j in (0, 1) for i in (0, 1)])
    corners = [np.where(steps == 1, np.array(high), np.array(low)) for low, high in walls]
    faces = np.concatenate([_FACES[:, [0, 1, 2]], _FACES[:, [0, 2, 3]]])
    triangles = [8 * number + faces for number in range(len(walls))]
    return _model(name, np.concatenate(corners), np.concatenate(triangles), sheets=False)


def _of_three_sheets() -> dict[str, tuple[SpacecraftModel, Place, Place, float]]:
    """Models, cameras and what they look at, focal lengths [mm]."""
    stem, side = 0.7 * _Z + 0.05 * _X, 0.5 * _Z + 0.1 * _Y
    tee = [
        _quad((-0.5, 0.0, 0.0), _X, _Y),
        _quad(_ORIGIN, stem, _Y),
        _quad((-0.5, 0.45, 0.0), _X, side),
    ]
    spine = np.array((-0.48, 0.59, -0.65))
    ways = np.array([(0.7, 0.7, 0.1), (-0.6, 0.5, 0.62), (0.2, -0.3, 0.93)])
    fan = [_quad(_ORIGIN, spine, way) for way in ways]
    return {
        "T of three sheets": (sheets("tee", tee), (1.6, -1.4, 1.5), (0.0, 0.4, 0.2), 8.0),
        "fan of three sheets": (sheets("fan", fan), (1.6, 1.9, 1.3), (0.0, 0.4, 0.0), 8.0),
    }


def _louvre() -> SpacecraftModel:
    """Eight blades of 12 cm between two cheeks."""
    blade = 0.12 * (np.cos(0.6) * _X + np.sin(0.6) * _Z)
    blades = [_quad(0.08 * k * _Z, blade, 0.8 * _Y) for k in range(8)]
    cheeks = [_quad((0.0, y, -0.05), 0.12 * _X, 0.8 * _Z) for y in (0.0, 0.8)]
    return sheets("louvre", [*blades, *cheeks])


def _truss() -> SpacecraftModel:
    """Five bays of three sides, rods of 15 to 25 mm."""
    turns = np.array([0.3, 2.4, 4.5])
    ring = 0.4 * np.stack([np.zeros(3), np.cos(turns), np.sin(turns)], axis=1)
    bars = []
    for bay in range(6):
        here, there = ring + 0.6 * bay * _X, ring + 0.6 * (bay + 1) * _X
        for k in range(3):
            bars.append((here[k], here[(k + 1) % 3], 0.02))
            if bay < 5:
                bars.append((here[k], there[k], 0.025))
                bars.append((here[k], there[(k + 1) % 3], 0.015))
    return solids("truss", bars)


@cache
def thin_scenes() -> dict[str, ThinScene]:
    """By what they show."""
    corner = sheets("corner", [_quad(_ORIGIN, u, v) for u, v in ((_X, _Y), (_Y, _Z), (_Z, _X))])
    walls = [(0.0 * _X, _X, _Y), (0.0 * _X, _Y, _Z), (0.0 * _X, _X, _Z), (_X, _Y, _Z), (_Y, _X, _Z)]
    box = sheets("box", [_quad(*wall) for wall in walls])
    shelves = [_quad(0.12 * k * _Z, _X + 0.02 * k * _Z, _Y) for k in range(4)]
    stack = sheets("stack", [*shelves, _quad((0.5, 0.0, -0.2), (0.1, 0.0, 0.8), _Y)])
    folds = [
        _quad((0.35 * k, 0.0, 0.25 * (k % 2)), (0.35, 0.0, 0.25 - 0.5 * (k % 2)), _Y)
        for k in range(4)
    ]
    zigzag = sheets("zigzag", folds)
    bus_bar = ((-0.6, 0.0, 0.0), (0.6, 0.0, 0.0), 1.2)
    boom_bar = ((0.3, -6.5, 0.7), (0.3, 6.5, 0.7), 0.02)
    part = solids("boomed", [bus_bar, boom_bar])
    bus, boom = solids("bus", [bus_bar]), solids("boom", [boom_bar])
    panels = [_quad((-0.5, 0.75 * k, 0.0), _X, 5.0 * k * _Y) for k in (-1, 1)]
    wings = sheets("wings", panels)

    def of(model: SpacecraftModel, camera: Place, target: Place, focal_mm: float) -> ThinScene:
        bodies = ((model, _ORIGIN),)
        return ThinScene(bodies=bodies, camera=camera, target=target, focal_length_mm=focal_mm)

    scenes = {
        "closed corner of sheets": of(corner, (2.2, 1.8, 2.0), (0.4, 0.4, 0.4), 8.0),
        "open box": of(box, (2.2, 1.3, 2.6), (0.5, 0.5, 0.4), 8.0),
        "open box from 5 cm": of(box, (0.05, 0.05, 0.3), (0.0, 0.0, 0.0), 3.0),
        "open box from 5 cm, obliquely": of(box, (0.05, 0.5, 0.06), (0.0, 0.6, 0.0), 3.0),
        "crossing sheets": of(stack, (2.2, -1.3, 1.6), (0.5, 0.5, 0.2), 8.0),
        "folded sheets": of(zigzag, (1.2, -1.0, 2.2), (0.7, 0.5, 0.1), 8.0),
        "truss": of(_truss(), (1.2, -2.0, 1.2), (1.5, 0.0, 0.0), 6.0),
    }
    leaf = np.cos(0.7) * _X + np.sin(0.7) * _Z
    hinge = sheets("hinge", [_quad(_ORIGIN, _X, _Y), _quad(_ORIGIN, leaf, _Y)])
    tray = thin_walls(
        "tray",
        [
            (_ORIGIN, (1.0, 1.0, 0.001)),
            (_ORIGIN, (0.001, 1.0, 1.0)),
            (_ORIGIN, (1.0, 0.001, 1.0)),
            ((1.0, 0.0, 0.0), (1.001, 1.0, 1.0)),
            ((0.0, 1.0, 0.0), (1.0, 1.001, 1.0)),
        ],
    )
    scenes |= {name: of(*parts) for name, parts in _of_three_sheets().items()}
    scenes |= {
        "louvre": of(_louvre(), (1.4, -0.6, 1.1), (0.05, 0.4, 0.3), 8.0),
        "half-open hinge": of(hinge, (1.7, -1.3, 1.2), (0.3, 0.4, 0.2), 8.0),
        "half-open hinge from 40 cm": of(hinge, (0.35, 0.3, 0.18), (0.02, 0.55, 0.02), 3.0),
        "box of walls of 1 mm": of(tray, (2.2, 1.3, 2.6), (0.5, 0.5, 0.4), 8.0),
    }
    target, way = np.array([0.3, 0.2, 0.7]), np.array([0.48795, 0.39036, 0.78072])
    for distance, focal_mm in ((0.05, 3.0), (0.5, 3.0), (3.0, 8.0), (20.0, 20.0), (300.0, 300.0)):
        x, y, z = target + distance * way
        place, aim = (float(x), float(y), float(z)), (0.3, 0.2, 0.7)
        seen = f"boom of 2 cm on its bus from {distance:g} m"
        scenes[seen] = of(part, place, aim, focal_mm)
        beside = replace(scenes[seen], bodies=((bus, _ORIGIN), (boom, _ORIGIN)))
        scenes[seen.replace("on its bus", "beside a bus")] = beside
    scenes["wings of sheets"] = ThinScene(
        bodies=((bus, _ORIGIN), (wings, _ORIGIN)), camera=(3.0, 2.0, 4.0), target=(0.0, 0.8, 0.0)
    )
    return scenes
