"""Sunlight that ends within a patch, and what other surfaces get of it."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from simgl.arrays import Array, Array32, IndexArray
from simgl.radiosity.bake import BakeSettings, bake
from simgl.radiosity.gather_points import gather_points_of
from simgl.radiosity.leaving_light import LeavingLight, uneven
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.patches import SPOTS
from simgl.radiosity.solver import reflectors, vertex_irradiance
from simgl.radiosity.sunlit_patches import SunlitPatches
from simgl.scene.mesh import Mesh
from tests.radiosity.boxes import white
from tests.radiosity.shapes import quads

# A floor of 2 x 2 m, and a plate of that size 0.5 m above it, seen from below.
HEIGHT = 0.5
FLOOR = ((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))
PLATE = ((-1, -1, HEIGHT), (-1, 1, HEIGHT), (1, 1, HEIGHT), (1, -1, HEIGHT))
# The plate's shadow leaves a strip of the floor in the light, 0.55 m wide, which ends at x = 0.45.
STRIP = 0.55
SUN = np.array([STRIP, 0.0, HEIGHT]) / np.hypot(STRIP, HEIGHT)


def to_rectangle(x: Array, y: Array, low: float, high: float, height: float) -> Array:
    """Form factor from a small plate at (x, y) to a rectangle opposite it, x from low to high and y
    from -1 to 1: the sum over its four corners of the factor to a rectangle in the corner of a
    parallel plane (Howell, A Catalog of Radiation Configuration Factors, B-3).
    """

    def corner(a: Array, b: Array) -> Array:
        u, v = a / height, b / height
        p, q = np.sqrt(1.0 + u * u), np.sqrt(1.0 + v * v)
        return (u / p * np.arctan(v / p) + v / q * np.arctan(u / q)) / (2.0 * np.pi)

    sums = np.zeros_like(x)
    for a, sign in ((high - x, 1.0), (low - x, -1.0)):
        sums += sign * (corner(a, 1.0 - y) - corner(a, -1.0 - y))
    return sums


def transport(patches: int, added_triangles: int = 300) -> LightTransport:
    settings = BakeSettings(
        patches=patches,
        patch_rays=64,
        gather_rays=1024,
        added_triangles=added_triangles,
        edge_share=1.0 / 60.0,
    )
    found = bake(quads((FLOOR, PLATE)), open_sheets=True, settings=settings)
    assert found is not None
    return found


def under_the_plate(mesh: Mesh) -> tuple[IndexArray, Array]:
    """(n,) vertices of the plate, and the mean of the closed form over the places where their rays
    start: irradiance over that of a surface that faces the Sun."""
    chosen = np.flatnonzero(mesh.positions[:, 2] == np.float32(HEIGHT))
    points = gather_points_of(mesh, 2)
    x, y = np.moveaxis(points.origins[points.of_vertex[0, chosen]][..., :2], 2, 0)
    share = to_rectangle(x, y, 1.0 - STRIP, 1.0, HEIGHT).mean(axis=1)
    return chosen, 0.5 * SUN[2] * share


def first_bounce(body: LightTransport, even: bool) -> Array32:
    """(v,) irradiance of the vertices' fronts over that of a surface that faces the Sun."""
    albedo = reflectors(body, white(0.5, 2)).albedo
    irradiance = np.repeat(SunlitPatches(body).cosines(SUN)[:, :, None], 4, axis=2)
    light = LeavingLight(
        patches=albedo * irradiance.mean(axis=1),
        uneven=None if even else uneven(albedo, irradiance),
    )
    values = np.empty((*body.of_vertices.shape, 4), dtype=np.float32)
    with ThreadPoolExecutor(max_workers=1) as executor:
        vertex_irradiance(body.of_vertices, light, values, executor)
    return values[:, 0, 0]


def test_a_shadows_edge_across_a_plate_lights_the_other_by_the_closed_form() -> None:
    """What patches of half a metre get wrong, against what is left of it with their spots."""
    body = transport(16)
    chosen, expected = under_the_plate(body.mesh)
    off = {even: first_bounce(body, even)[chosen] - expected for even in (True, False)}
    rms = {even: float(np.sqrt(np.mean(o**2))) / expected.max() for even, o in off.items()}
    # A spot is half as wide as its patch: light that is even over it is at most half as far from
    # where it belongs. A tenth more for the rays of vertices, which both have.
    assert rms[False] < 0.6 * rms[True]


def test_spots_of_many_patches_place_the_edge() -> None:
    body = transport(3000, 1500)
    chosen, expected = under_the_plate(body.mesh)
    found = first_bounce(body, even=False)[chosen]
    # The floor's triangles have legs of 6.2 cm, their quarters of 3.1 cm. An edge that is off by
    # half of that is off by 2.8 % of the strip; some thirty along it leave a fifth in the mean.
    np.testing.assert_allclose(found, expected, atol=0.028 * expected.max())
    np.testing.assert_allclose(found.mean(), expected.mean(), rtol=0.005)


def test_spots_are_the_quarters_of_their_patch() -> None:
    """Their light is that of the patch in the mean, and rays meet each about as often."""
    body = transport(60)
    cosines = SunlitPatches(body).cosines(SUN)
    assert cosines.shape == (len(body.areas), SPOTS)
    more = uneven(
        np.ones((len(body.areas), 4), np.float32), np.repeat(cosines[..., None], 4, axis=2)
    )
    np.testing.assert_allclose(more.mean(axis=1), 0.0, atol=1e-6)
    assert body.gather.shape[1] == SPOTS * len(body.areas)
    of_floor = body.normals[:, 0, 2] > 0.5
    met = np.asarray(body.gather.sum(axis=0)).reshape(-1, SPOTS)[of_floor & (body.areas > 0)].sum(0)
    # Four quarters of some dozen patches, which vertices everywhere look at.
    np.testing.assert_allclose(met / met.sum(), 1.0 / SPOTS, atol=0.08)
