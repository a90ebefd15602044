"""What a matt wall gets beside glossy surfaces in sunlight, all bounces, against paths of light.

python -m benchmarks.glossy_light [part of a scene's name]...
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from simgl.arrays import Array, IndexArray
from simgl.physics.directional_albedo import lambda_smith
from simgl.radiosity.gather_points import face_normals
from simgl.radiosity.hemisphere import frames
from simgl.radiosity.remesh import subdivided
from simgl.rays import RayTracer
from simgl.scene.materials import Material
from simgl.scene.mesh import Mesh
from tests.radiosity.glossy_walls import (
    FOIL,
    METAL,
    PAINTS,
    PLATE,
    WALL,
    WIDE,
    baked,
    found,
    law,
    midpoints,
    part_of,
    towards,
    width_of,
)
from tests.radiosity.shapes import Quad, quads

SIDE: Quad = ((0, 1, 0), (2, 1, 0), (2, 1, 1.2), (0, 1, 1.2))
SHADE: Quad = ((0.4, -0.2, 0.3), (0.4, 1.5, 0.3), (1.2, 1.5, 0.9), (1.2, -0.2, 0.9))
DARK = Material(name="dark", reflectance=(0.03,) * 4)
MATT = Material(name="matt", reflectance=(0.7, 0.7, 0.7, 0.5))
ALPHA_02 = WIDE["alpha 0.2"]
SCENES: dict[str, tuple[tuple[Quad, ...], tuple[Material, ...]]] = {
    "alpha 0.2": ((WALL,), (ALPHA_02, MATT)),
    "alpha 0.64": ((WALL,), (WIDE["alpha 0.64"], MATT)),
    "alpha 0.64, conserving": ((WALL,), (WIDE["alpha 0.64, conserving"], MATT)),
    "foil": ((WALL,), (FOIL, MATT)),
    "alpha 0.2, in a shadow": ((WALL, SHADE), (ALPHA_02, MATT, DARK)),
    "alpha 0.2, a matt wall beside": ((WALL, SIDE), (ALPHA_02, MATT, MATT)),
    "alpha 0.2, a metal wall beside": ((WALL, SIDE), (ALPHA_02, MATT, ALPHA_02)),
    "alpha 0.04": ((WALL,), (replace(METAL, roughness=0.2), MATT)),
    **{name: ((WALL,), (paint, MATT)) for name, paint in PAINTS.items()},
}
SUNS = ((20.0, 0.0), (20.0, 40.0), (45.0, 0.0), (45.0, 40.0), (70.0, 0.0), (70.0, 40.0))
# Of paths, together and in all; those of a wall that gets a tenth of them leave 1 % in its parts.
_AT_ONCE, _TIMES, _BOUNCES, _LIFT = 250_000, 6, 8, 1e-4


def main() -> None:
    rng = np.random.default_rng(20261127)
    print("scene | Sun: elevation, azimuth | sum | worst part of those of a tenth of the brightest")
    for name, (walls, materials) in SCENES.items():
        if not any(word in name for word in sys.argv[1:] or [""]):
            continue
        for elevation, azimuth in SUNS:
            sun = towards(elevation, azimuth)
            true = _by_paths(walls, materials, sun, rng).mean(axis=1)
            seen = found(baked(*walls), materials, sun).of_parts(WALL).mean(axis=1)
            bright = true > 0.1 * true.max()
            worst = float(np.abs(seen / true - 1.0)[bright].max())
            total = float(seen.sum() / true.sum() - 1.0)
            print(f"{name} | {elevation:g}, {azimuth:g} | {total:+.1%} | {worst:.1%}", flush=True)


def _by_paths(
    walls: Sequence[Quad], materials: Sequence[Material], sun: Array, rng: np.random.Generator
) -> Array:
    """(16, 4) irradiance of parts of the first wall by surfaces in a Sun of 1 W/m2."""
    mesh = subdivided(quads((PLATE, *walls)), 0.25)
    tracer = RayTracer(mesh)
    light = [_one_batch(tracer, mesh, materials, sun, rng) for _ in range(_TIMES)]
    return np.asarray(np.mean(light, axis=0))


def _one_batch(
    tracer: RayTracer,
    mesh: Mesh,
    materials: Sequence[Material],
    sun: Array,
    rng: np.random.Generator,
) -> Array:
    """The same by paths that start from places of the surfaces in sunlight."""
    faces, areas = face_normals(mesh)
    worn = mesh.material[mesh.triangles[:, 0]].astype(np.int64)
    triangle = rng.choice(len(areas), _AT_ONCE, p=areas / areas.sum())
    corners = mesh.positions[mesh.triangles[triangle]].astype(np.float64)
    places = np.einsum("nc,nci->ni", rng.dirichlet((1.0, 1.0, 1.0), _AT_ONCE), corners)
    n = _against(faces[triangle], -sun)
    places += _LIFT * n
    lit = ~tracer.occluded(
        places.astype(np.float32), np.broadcast_to(sun, places.shape).astype(np.float32)
    )
    places, n, worn_here = places[lit], n[lit], worn[triangle[lit]]
    power = np.tile((n @ sun * areas.sum() / _AT_ONCE)[:, None], 4)
    from_, normal = np.broadcast_to(sun, n.shape), midpoints(WALL, 1)[2]
    on_wall, wall_area = np.zeros((16, 4)), midpoints(WALL, 1)[1].sum()
    for _ in range(_BOUNCES):
        ways, power = _reflected(materials, worn_here, n, from_, power, rng)
        hit, distance = tracer.hits(places.astype(np.float32), ways.astype(np.float32))
        met = np.flatnonzero((hit >= 0) & (power.max(axis=1) > 0.0))
        from_, power, worn_here = -ways[met], power[met], worn[hit[met]]
        places = places[met] + distance[met, None] * ways[met]
        n = _against(faces[hit[met]], ways[met])
        front = np.flatnonzero((worn_here == 1) & (n @ normal > 0.5))
        np.add.at(on_wall, part_of(places[front], WALL), power[front])
        places += _LIFT * n
    return on_wall / (wall_area / len(on_wall))


def _against(normals: Array, ways: Array) -> Array:
    """(n, 3) normals of sheets, of the side that ways (3,) or (n, 3) meet."""
    return np.where(np.sum(normals * ways, axis=1)[:, None] > 0.0, -normals, normals)


def _reflected(
    materials: Sequence[Material],
    worn: IndexArray,
    n: Array,
    from_: Array,
    power: Array,
    rng: np.random.Generator,
) -> tuple[Array, Array]:
    """Directions (k, 3) in which light (k, 4) goes on from surfaces, and how much of it.

    n, from_ : (k, 3) normals, and unit directions to where it comes from
    """
    axes, up = frames(n), np.array([0.0, 0.0, 1.0])
    wi, wo = np.einsum("kij,ki->kj", axes, from_), np.empty_like(from_)
    left = np.zeros_like(power)
    for number, material in enumerate(materials):
        at = np.flatnonzero(worn == number)
        # A base that is matt, or for the sides of lobes; lobes of facets.
        widths: list[float | None] = [None]
        if material.roughness is not None:
            widths.append(width_of(material))
        if material.coat is not None:
            widths.append(material.coat.roughness**2)
        kind = rng.integers(len(widths), size=len(at))
        for k, alpha in enumerate(widths):
            of_kind = at[kind == k]
            wo[of_kind] = _drawn(alpha, wi[of_kind], rng)
        upwards = at[(wo[at, 2] > 1e-6) & (wi[at, 2] > 1e-6)]
        a, b = wi[upwards], wo[upwards]
        density = np.mean([_density(alpha, a, b) for alpha in widths], axis=0)
        share = law(material, up, a, b) * (b[:, 2] / density)[:, None]
        left[upwards] = power[upwards] * share
    return np.einsum("kij,kj->ki", axes, wo), left


def _drawn(alpha: float | None, wi: Array, rng: np.random.Generator) -> Array:
    """(k, 3) unit directions: by their cosines, or mirrored at facets that wi see (Heitz 2018, by
    caps of a sphere, Dupuy & Benyoub 2023)."""
    u, turn = rng.random(len(wi)), 2.0 * np.pi * rng.random(len(wi))
    if alpha is None:
        sine, z = np.sqrt(u), np.sqrt(1.0 - u)
        return np.stack([sine * np.cos(turn), sine * np.sin(turn), z], axis=1)
    stretch = np.array([alpha, alpha, 1.0])
    seen = wi * stretch
    seen /= np.linalg.norm(seen, axis=1, keepdims=True)
    z = (1.0 - u) * (1.0 + seen[:, 2]) - seen[:, 2]
    sine = np.sqrt(np.maximum(1.0 - z * z, 0.0))
    h = (np.stack([sine * np.cos(turn), sine * np.sin(turn), z], axis=1) + seen) * stretch
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    return np.asarray(2.0 * np.sum(wi * h, axis=1)[:, None] * h - wi)


def _density(alpha: float | None, wi: Array, wo: Array) -> Array:
    """(k,) of ``_drawn`` [sr-1]."""
    if alpha is None:
        return np.asarray(wo[:, 2] / np.pi)
    h = wi + wo
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    facets = alpha**2 / (np.pi * (h[:, 2] ** 2 * (alpha**2 - 1.0) + 1.0) ** 2)
    return np.asarray(facets / (4.0 * wi[:, 2] * (1.0 + lambda_smith(wi[:, 2], alpha))))


if __name__ == "__main__":
    main()
