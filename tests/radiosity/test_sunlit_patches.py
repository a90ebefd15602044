"""Sunlight on patches as the Sun moves: a pure function, even in its steps, and cast by others."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array
from simgl.radiosity.solver import Blocker
from simgl.radiosity.sunlit_patches import SunlitPatches, direction_of, grid_corners
from simgl.rays import RayTracer
from simgl.scene.mesh import plate
from tests.radiosity.boxes import inside, open_box


def towards(x: float, y: float = 0.0) -> Array:
    """Unit direction, x radians about y from the zenith."""
    d = np.array([np.sin(x), y, np.cos(x)])
    return d / np.linalg.norm(d)


def test_what_was_asked_before_changes_no_bit() -> None:
    transport = open_box()
    asked = [towards(0.01 * k - 0.4, 0.003 * k) for k in range(12)]
    one = SunlitPatches(transport)
    in_order = [one.cosines(d) for d in asked]
    other = SunlitPatches(transport)
    backwards = [other.cosines(d) for d in asked[::-1]][::-1]
    for a, b in zip(in_order, backwards, strict=True):
        np.testing.assert_array_equal(a, b)


def test_light_is_continuous_while_the_sun_moves() -> None:
    """Steps of a fiftieth of a degree, across the lattice's lines, their diagonals and the axes."""
    patches = SunlitPatches(open_box())
    step = np.radians(0.02)
    for start in (np.radians(-46.0), np.radians(-1.0), np.radians(89.0)):
        across = [towards(start + k * step, 1e-4 + 0.3 * k * step) for k in range(100)]
        values = np.stack([patches.cosines(d) for d in across])
        # A node's whole difference to the next, at most 1, is spread over half a degree; an
        # octahedral map stretches directions by up to 1.6.
        assert np.abs(np.diff(values, axis=0)).max() < 2.0 * 1.6 * 0.02 / 0.5


def test_free_patches_have_the_exact_cosine() -> None:
    transport = open_box()
    direction = towards(0.3, 0.1)
    found = SunlitPatches(transport).cosines(direction)
    outside = ~inside(transport)
    cosine = np.maximum(transport.normals[:, 0] @ direction, 0.0)
    # float32 sums of three nodes.
    np.testing.assert_allclose(found[outside], cosine[outside], atol=1e-6)


def test_three_directions_of_the_lattice_add_up_to_the_one_between() -> None:
    """Everywhere, so that a wall in full light has the cosine itself."""
    random = np.random.default_rng(2).normal(size=(400, 3))
    # On the folds of the map the octahedron has its edges: there neighbours must agree.
    edges = random * np.tile(1.0 - np.eye(3), (134, 1))[:400]
    for direction in np.concatenate([random, edges, np.eye(3), -np.eye(3)]):
        direction = direction / np.linalg.norm(direction)
        corners = grid_corners(direction)
        total = sum(weight * direction_of(node) for node, weight in corners)
        np.testing.assert_allclose(total, direction, atol=1e-12)
        # Three directions half a degree apart, times what an octahedral map stretches.
        reach = min(float(direction_of(node) @ direction) for node, _ in corners)
        assert reach > np.cos(np.radians(1.6 * 0.5 * 2.0**0.5))


def test_sunlight_in_the_box_is_that_of_the_directions_around() -> None:
    """Total light on the floor, whose shadow's edge moves evenly with the Sun."""
    transport = open_box()
    floor = inside(transport) & (transport.normals[:, 0, 2] > 0.9)
    area = transport.areas[floor]
    for angle in (-0.35, -0.5, -0.65):
        found = SunlitPatches(transport).cosines(towards(angle))[floor]
        # Wall of 1 m at x = 0: its shadow is tan(angle) long; the floor is 2 m x 1 m.
        expected = (2.0 - np.tan(abs(angle))) * np.cos(angle)
        # Eight points a patch place the edge to a tenth of a patch of 4 cm.
        np.testing.assert_allclose((area * found).sum(), expected, rtol=5e-3)


def test_another_body_hides_the_patches_in_its_shadow() -> None:
    transport = open_box()
    zenith = np.array([0.0, 0.0, 1.0])
    moved = np.eye(4)
    moved[:3, 3] = (-0.5, -0.5, -3.0)  # a square of 1 m, 3 m above x 0..1, y 0..1
    square = plate(1.0, 1.0)
    blocker = Blocker(
        tracer=RayTracer(square),
        other_from_body=moved,
        centre=square.centre,
        radius=square.radius,
        hull=square.hull,
    )
    free = SunlitPatches(transport).cosines(zenith)
    shaded = SunlitPatches(transport).cosines(zenith, [blocker])
    x = transport.points[..., 0]
    floor = inside(transport) & (transport.normals[:, 0, 2] > 0.9)
    assert shaded[floor & (x.max(axis=1) < 1.0)].max() == 0.0
    clear = floor & (x.min(axis=1) > 1.0)
    np.testing.assert_array_equal(shaded[clear], free[clear])
    assert free[clear].min() > 0.99
