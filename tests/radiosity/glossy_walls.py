"""A matt wall beside a glossy plate: what it gets, by simgl and by quadrature of the law."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from simgl.arrays import Array, IndexArray
from simgl.physics.directional_albedo import lobe_albedo
from simgl.radiosity.bake import BakeSettings, bake
from simgl.radiosity.gather_points import face_normals
from simgl.radiosity.light_grids import CUTS, STEPS
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.precomputed_response import GatheredSunlight, PrecomputedResponse
from simgl.radiosity.remesh import subdivided
from simgl.radiosity.solver import reflectors
from simgl.radiosity.sunlit_patches import SunlitPatches
from simgl.scene.materials import Material
from simgl.scene.surface_layers import Coat, Crinkle
from tests.radiosity.shapes import Quad, quads

PLATE: Quad = ((0, -1, 0), (2, -1, 0), (2, 1, 0), (0, 1, 0))
WALL: Quad = ((0, -1, 0), (0, 1, 0), (0, 1, 1.5), (0, -1, 1.5))
APART: Quad = ((-0.3, -1, 0.1), (-0.3, 1, 0.1), (-1, 1, 1.4), (-1, -1, 1.4))
SETTINGS = BakeSettings(patches=2000, added_triangles=1000, grids=1000)
BLACK = Material(name="black", reflectance=(0.0,) * 4)
# Parts of the wall along each of its edges.
ACROSS = 4
METAL = Material(name="metal", reflectance=(0.92, 0.9, 0.5, 0.8), metallic=1.0)
FOIL = replace(
    METAL, roughness=0.22, conserving=True, crinkle=Crinkle(facet_size=0.025, slope=0.12)
)
WIDE = {
    "alpha 0.2": replace(METAL, roughness=0.2**0.5),
    "alpha 0.4": replace(METAL, roughness=0.4**0.5),
    "alpha 0.64": replace(METAL, roughness=0.8),
    "alpha 0.64, conserving": replace(METAL, roughness=0.8, conserving=True),
    "foil": FOIL,
}
# White and black paint, varnish, and a solar cell, as simgl/data/finishes.toml has them but for the
# white one's gloss and the varnish.
_WHITE = Material(name="white", reflectance=(0.88, 0.88, 0.84, 0.87))
_CELL = Material(name="cell", reflectance=(0.034, 0.036, 0.056, 0.07))
SMOOTH_GLASS = "cells, cover glass of roughness 0.05"
PAINTS = {
    "white paint, roughness 0.6": replace(_WHITE, roughness=0.6),
    "white paint, roughness 0.3": replace(_WHITE, roughness=0.3),
    "black paint, roughness 0.6": replace(_WHITE, reflectance=(0.035,) * 4, roughness=0.6),
    "white, clear coat of roughness 0.45": replace(_WHITE, coat=Coat(roughness=0.45)),
    "cells, cover glass of roughness 0.45": replace(_CELL, coat=Coat(roughness=0.45)),
    SMOOTH_GLASS: replace(_CELL, coat=Coat(roughness=0.05)),
}


def towards(elevation: float, azimuth: float) -> Array:
    e, a = np.radians((elevation, azimuth))
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


@lru_cache(maxsize=2)
def baked(*walls: Quad) -> LightTransport:
    """The plate with walls, each of the material of its number."""
    found = bake(subdivided(quads((PLATE, *walls)), 0.25), open_sheets=True, settings=SETTINGS)
    assert found is not None
    return found


def law(material: Material, n: Array, wi: Array, wo: Array) -> Array:
    """(k, 4) reflectance [sr-1], as docs/materials.md has it; wi (3,) or (k, 3)."""
    base, h = np.asarray(material.reflectance), wi + wo
    h /= np.linalg.norm(h, axis=-1, keepdims=True)
    NoL, NoV, NoH, VoH = wi @ n, wo @ n, h @ n, np.einsum("ki,ki->k", wo, h)
    f = np.broadcast_to(base / np.pi, (len(wo), 4))
    if material.roughness is not None:
        f0 = 0.04 + material.metallic * (base - 0.04)
        fresnel = f0 + (1.0 - f0) * (1.0 - VoH)[:, None] ** 5
        a2 = width_of(material) ** 2
        gain = np.ones((len(wo), 4))
        if material.conserving:
            cosine = np.linspace(0.02, 1.0, 50)
            once = np.interp(NoV, cosine, sum(lobe_albedo(cosine, np.full(50, a2**0.5))))
            gain += f0 * ((1.0 - once) / once)[:, None]
        f = f * (1.0 - material.metallic) * (1.0 - fresnel)
        f = f + gain * fresnel * _facets(a2, NoL, NoV, NoH)[:, None]
    if material.coat is not None:
        strength = material.coat.strength
        passing, leaving, mirrored = (0.04 + 0.96 * (1.0 - c) ** 5 for c in (NoL, NoV, VoH))
        f = f * ((1.0 - strength * passing) * (1.0 - strength * leaving))[:, None]
        facets = _facets(material.coat.roughness**4, NoL, NoV, NoH)
        f = f + (strength * mirrored * facets)[:, None]
    return np.asarray(f)


def width_of(material: Material) -> float:
    """Alpha of its base, without a coat."""
    assert material.roughness is not None
    a2 = material.roughness**4
    if material.crinkle is not None:
        # As wide as facets and slopes one after the other, by shaders/surface/crinkle.glsl.
        a2 = (a2**0.635 + (2.0 * material.crinkle.slope**2) ** 0.635) ** (1.0 / 0.635)
    return float(a2**0.5)


def _facets(a2: float, NoL: Array, NoV: Array, NoH: Array) -> Array:
    """(k,) what mirrors of that width would reflect [sr-1]."""
    D = a2 / (np.pi * (NoH**2 * (a2 - 1.0) + 1.0) ** 2)
    # Heitz 2014: G2 = 1 / (1 + Lambda(l) + Lambda(v)).
    lambdas = [0.5 * (np.sqrt(1.0 + a2 * (1.0 / c**2 - 1.0)) - 1.0) for c in (NoL, NoV)]
    return np.asarray(D / (4.0 * NoL * NoV * (1.0 + lambdas[0] + lambdas[1])))


def midpoints(corners: Quad, count: int, power: float = 1.0) -> tuple[Array, Array, Array]:
    """(n, 3) places of a sheet, denser along its first edge, their areas and its normal."""
    origin, first, _, last = np.array(corners, dtype=np.float64)
    u, v = first - origin, last - origin
    edges = np.linspace(0.0, 1.0, count + 1) ** power
    along, width = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)
    across = (np.arange(count) + 0.5) / count
    places = origin + along[:, None, None] * u + across[:, None] * v
    normal = np.cross(u, v)
    areas = np.repeat(width / count * np.linalg.norm(normal), count)
    return places.reshape(-1, 3), areas, normal / np.linalg.norm(normal)


def part_of(places: Array, wall: Quad) -> IndexArray:
    """(n,) which part of a wall places are in."""
    origin, first, _, last = np.array(wall, dtype=np.float64)
    part = np.zeros(len(places), dtype=np.int64)
    for edge in (first - origin, last - origin):
        step = (places - origin) @ edge / (edge @ edge) * ACROSS
        part = part * ACROSS + np.clip(step.astype(np.int64), 0, ACROSS - 1)
    return part


def mean_of_parts(values: Array, weights: Array, part: IndexArray) -> Array:
    return np.stack([np.average(values[part == p], 0, weights[part == p]) for p in range(16)])


def by_quadrature(
    material: Material, wall: Quad, sun: Array, lit: Callable[[Array], Array] | None = None
) -> Array:
    """(16, 4) mean irradiance of the parts of a black wall by the plate in a Sun of 1 W/m2.

    lit : whether places (n, 3) of the plate see the Sun; None where all do
    """
    at, areas, normal = midpoints(wall, 12)
    return mean_of_parts(of_plate(material, at, normal, sun, lit), areas, part_of(at, wall))


def of_plate(
    material: Material,
    at: Array,
    normal: Array,
    sun: Array,
    lit: Callable[[Array], Array] | None = None,
) -> Array:
    """(n, 4) irradiance of places (n, 3) of a normal (3,)."""
    places, patches, up = midpoints(PLATE, 160, 2.0)
    if lit is not None:
        places, patches = places[lit(places)], patches[lit(places)]
    light = np.empty((len(at), 4))
    for k, point in enumerate(at):
        way = point - places
        distance2 = np.einsum("ki,ki->k", way, way)
        way /= np.sqrt(distance2)[:, None]
        form = np.maximum(-way @ normal, 0.0) * (way @ up) / distance2 * patches
        light[k] = form @ law(material, up, sun, way) * (up @ sun)
    return light


@dataclass(frozen=True, kw_only=True)
class Triangles:
    """Middles (k, 3), areas (k,) and mean irradiance (k, 4) of triangles."""

    middle: Array
    areas: Array
    irradiance: Array

    def of_parts(self, wall: Quad) -> Array:
        return mean_of_parts(self.irradiance, self.areas, part_of(self.middle, wall))

    def mean(self) -> Array:
        return np.asarray(np.average(self.irradiance, 0, self.areas))


def found(transport: LightTransport, materials: Sequence[Material], sun: Array) -> Triangles:
    """The same of the first wall's triangles, by vertices and grids."""
    surface = reflectors(transport, materials)
    response = PrecomputedResponse(transport, surface, SunlitPatches(transport))
    return of_wall(transport, response.of_sun_at_vertices(sun, np.ones(4)))


def of_wall(transport: LightTransport, light: GatheredSunlight) -> Triangles:
    """What the first wall's triangles get by vertices and grids."""
    mesh = transport.mesh
    corners, grids = mesh.triangles.astype(np.int64), transport.grids
    front = light.vertices.reshape(len(mesh.positions), transport.sides, 4)[:, 0]
    irradiance = front[corners].mean(axis=1)
    assert grids is not None
    # Of a grid's small triangles six meet at each inner node, three on edges, one at corners.
    meeting = np.where(STEPS.max(axis=1) == CUTS, 1, np.where((STEPS == 0).any(axis=1), 3, 6))
    more = light.nodes[grids.row_of_node[:, :, 0]]
    irradiance[grids.triangles] += np.einsum("n,tnb->tb", meeting / meeting.sum(), more)
    of_wall = np.flatnonzero(mesh.material[corners[:, 0]] == 1)
    return Triangles(
        middle=mesh.positions[corners[of_wall]].mean(axis=1).astype(np.float64),
        areas=face_normals(mesh)[1][of_wall],
        irradiance=irradiance[of_wall],
    )
