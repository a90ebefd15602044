"""What a matt wall gets beside metal in sunlight, all bounces, against paths of light.

python -m benchmarks.metal_light
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from simgl.arrays import Array, UIntArray
from simgl.radiosity.gather_points import face_normals
from simgl.radiosity.hemisphere import frames
from simgl.radiosity.remesh import subdivided
from simgl.rays import RayTracer
from simgl.scene.materials import Material
from simgl.scene.mesh import Mesh
from tests.radiosity.metal_walls import (
    FOIL,
    METAL,
    PLATE,
    WALL,
    WIDE,
    baked,
    found,
    law,
    mean_of_parts,
    midpoints,
    part_of,
    towards,
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
}
SUNS = ((20.0, 0.0), (20.0, 40.0), (45.0, 0.0), (45.0, 40.0), (70.0, 0.0), (70.0, 40.0))
_ACROSS, _PATHS, _BOUNCES, _LIFT = 20, 900, 8, 1e-4


def main() -> None:
    rng = np.random.default_rng(20261127)
    print("scene | Sun: elevation, azimuth | sum | worst part of those of a tenth of the brightest")
    for name, (walls, materials) in SCENES.items():
        mesh = subdivided(quads((PLATE, *walls)), 0.25)
        for elevation, azimuth in SUNS:
            sun = towards(elevation, azimuth)
            places, areas, normal = midpoints(WALL, _ACROSS)
            light = _by_paths(mesh, materials, sun, (places, normal), rng)
            true = mean_of_parts(light, areas, part_of(places, WALL)).mean(axis=1)
            seen = found(baked(*walls), materials, sun).of_parts(WALL).mean(axis=1)
            bright = true > 0.1 * true.max()
            worst = float(np.abs(seen / true - 1.0)[bright].max())
            total = float(seen.sum() / true.sum() - 1.0)
            print(f"{name} | {elevation:g}, {azimuth:g} | {total:+.1%} | {worst:.1%}", flush=True)


def _by_paths(
    mesh: Mesh,
    materials: Sequence[Material],
    sun: Array,
    surface: tuple[Array, Array],
    rng: np.random.Generator,
) -> Array:
    """(n, 4) irradiance of places (n, 3) of a normal (3,) by surfaces in a Sun of 1 W/m2."""
    tracer, faces = RayTracer(mesh), face_normals(mesh)[0]
    worn = mesh.material[mesh.triangles[:, 0]]
    places = np.repeat(surface[0] + _LIFT * surface[1], _PATHS, axis=0)
    ways = _cosine(np.broadcast_to(surface[1], places.shape), rng)
    light, through = np.zeros((len(places), 4)), np.full((len(places), 4), np.pi)
    alive = np.arange(len(places))
    for _ in range(_BOUNCES):
        triangle, distance = tracer.hits(places.astype(np.float32), ways.astype(np.float32))
        met = triangle >= 0
        alive, through, ways = alive[met], through[met], ways[met]
        places, worn_here = places[met] + distance[met, None] * ways, worn[triangle[met]]
        n = faces[triangle[met]]
        n = np.where(np.einsum("ij,ij->i", n, ways)[:, None] > 0.0, -n, n)
        places = places + _LIFT * n
        lit = np.flatnonzero(n @ sun > 0.0)
        rays = np.broadcast_to(sun, (len(lit), 3)).astype(np.float32)
        lit = lit[~tracer.occluded(places[lit].astype(np.float32), rays)]
        suns = np.broadcast_to(sun, (len(lit), 3))
        sent = _law(materials, worn_here[lit], n[lit], suns, -ways[lit])
        light[alive[lit]] += through[lit] * sent * (n[lit] @ sun)[:, None]
        onward = _cosine(n, rng)
        through = np.pi * through * _law(materials, worn_here, n, onward, -ways)
        ways = onward
    return light.reshape(-1, _PATHS, 4).mean(axis=1)


def _law(materials: Sequence[Material], worn: UIntArray, n: Array, wi: Array, wo: Array) -> Array:
    """(k, 4) reflectance [sr-1]."""
    f = np.empty((len(n), 4))
    # In the axes of each normal all have one.
    wi, wo = (np.einsum("kij,ki->kj", frames(n), way) for way in (wi, wo))
    up = np.array([0.0, 0.0, 1.0])
    for number, material in enumerate(materials):
        at = worn == number
        if material.metallic > 0.0:
            f[at] = law(material, up, wi[at], wo[at])
        else:
            f[at] = np.asarray(material.reflectance) / np.pi
    return f


def _cosine(normals: Array, rng: np.random.Generator) -> Array:
    pairs = rng.random((len(normals), 2))
    radius, turn = np.sqrt(pairs[:, 0]), 2.0 * np.pi * pairs[:, 1]
    z = np.sqrt(1.0 - pairs[:, 0])
    local = np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1)
    return np.asarray(np.einsum("nij,nj->ni", frames(normals), local))


if __name__ == "__main__":
    main()
