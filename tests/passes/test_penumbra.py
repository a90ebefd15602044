"""Penumbrae: the Sun's disc past an edge at any distance, and past a solid's two ends."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import pytest

from tests.scenes import lambert, radiance, scene

Array = np.ndarray[Any, np.dtype[np.floating[Any]]]
Table = dict[str, Any]

GREEN = 174.7738123  # [W m-2] of the Sun in 500-600 nm
TANGENT = np.tan(np.radians(0.263))


def plate(width: float, height: float, reflectance: float = 0.5) -> Table:
    return {"plate": {"width_m": width, "height_m": height, "material": lambert(reflectance)}}


def lit_share(
    gl: moderngl.Context,
    craft: dict[str, Table],
    *,
    span: float,
    size: int = 400,
    lean: tuple[float, float] = (0.0, 0.0),
) -> tuple[Array, Array]:
    """Ground coordinate x and lit share along it, on the middle row of a view from far above.

    span : width of the view on the plane z = 0 [m]
    lean : of the sunlight along x and y for each metre of height; 0 is a direction of the grid
        along which shadow maps are drawn
    """
    # Seen obliquely from the side, so that no blocker hides the plate.
    height = 1000.0
    pitch = 3.75e-6
    focal_mm = pitch * size / span * np.hypot(height, 600.0) * 1e3
    scenario = scene(
        craft,
        {
            "position_icrf_m": [0.0, -600.0, height],
            "boresight": [0.0, 600.0, -height],
            "up": [0.0, 1.0, 0.0],
            "focal_length_mm": focal_mm,
            "width_px": size,
            "height_px": 8,
        },
        sun_direction=(*lean, 1.0),
    )
    image = radiance(gl, scenario)[..., 1].astype(np.float64)
    x = (np.arange(size) + 0.5 - size / 2) * span / size
    # The middle pixels of the rows look at y within two pixels of 0.
    cosine = 1.0 / np.sqrt(1.0 + lean[0] ** 2 + lean[1] ** 2)
    return x, image[3:5].mean(axis=0) / (0.5 / np.pi * GREEN * cosine)


def disc_share(u: Array) -> Array:
    """Lit share of a uniform disc at u disc radii inside (+) a straight edge."""
    u = np.clip(u, -1.0, 1.0)
    return 0.5 + (u * np.sqrt(1.0 - u * u) + np.arcsin(u)) / np.pi


@pytest.mark.parametrize("distance", [1.0, 10.0, 100.0])
def test_a_straight_edge_has_the_discs_own_profile(gl: moderngl.Context, distance: float) -> None:
    """C3. The blind's edge lies over x = 0 and light is left at x > 0."""
    blur = distance * TANGENT
    wide = 6.0 * blur
    x, share = lit_share(
        gl,
        {
            "plate": {"model": plate(2.0 * wide, 2.0 * wide), "position_icrf_m": [0, 0, 0]},
            "blind": {
                "model": plate(8.0 * wide, 16.0 * wide),
                "position_icrf_m": [-4.0 * wide, 0, distance],
            },
        },
        span=4.0 * blur,
    )
    np.testing.assert_allclose(share, disc_share(x / blur), atol=0.02)
    u = np.array([-0.9, -0.7, -0.5, -0.3, -0.1, 0.0])
    truth = np.array([0.01869, 0.09406, 0.19550, 0.31192, 0.43644, 0.5])
    np.testing.assert_allclose(np.interp(u, x / blur, share), truth, atol=0.02)
    # No ripple: the profile rises all the way, but for the pattern of the disc's directions.
    assert np.diff(share).min() > -0.02


def test_a_solids_shadow_has_one_edge_from_each_of_its_ends(gl: moderngl.Context) -> None:
    """C8: a CubeSat's box over a plate, the inner end of its penumbra from its bottom edge."""
    x, share = lit_share(
        gl,
        {
            "plate": {"model": plate(0.6, 0.6), "position_icrf_m": [0, 0, 0]},
            "cubesat": {
                "model": {"box": {"size_m": [0.29, 0.20, 0.30], "material": lambert(0.0)}},
                "position_icrf_m": [0, 0, 0.65],
            },
        },
        span=0.32,
        size=1000,
    )
    levels = np.array([0.01, 0.10, 0.50, 0.90, 0.99])
    truth = np.array([0.1429, 0.1434, 0.1450, 0.1475, 0.1484])
    for side in (-1.0, 1.0):
        at = side * x
        order = np.argsort(at)
        near = at[order] > 0.12
        found = np.interp(levels, np.maximum.accumulate(share[order][near]), at[order][near])
        np.testing.assert_allclose(found, truth, atol=0.5e-3)


# From the middle of a cell of the grid to its corners and edges: 0.6 / 2 of the disc's radius.
@pytest.mark.parametrize("lean", [(0.0013, 0.0013), (-0.0013, 0.0007), (0.0013, 0.0)])
def test_shadow_edges_follow_a_sun_between_the_directions_of_the_maps(
    gl: moderngl.Context, lean: tuple[float, float]
) -> None:
    """A straight edge at 10 m, and both ends of a solid."""
    distance = 10.0
    blur = distance * TANGENT
    wide = 6.0 * blur
    blind = {"model": plate(8.0 * wide, 16.0 * wide), "position_icrf_m": [-4.0 * wide, 0, distance]}
    ground = {"model": plate(2.0 * wide, 2.0 * wide), "position_icrf_m": [0, 0, 0]}
    x, share = lit_share(gl, {"plate": ground, "blind": blind}, span=4.0 * blur, lean=lean)
    # As with the Sun on the grid: the scatter of the disc's directions.
    np.testing.assert_allclose(share, disc_share((x + lean[0] * distance) / blur), atol=0.02)
    box = {"box": {"size_m": [0.29, 0.20, 0.30], "material": lambert(0.0)}}
    x, share = lit_share(
        gl,
        {
            "plate": {"model": plate(0.6, 0.6), "position_icrf_m": [0, 0, 0]},
            "cubesat": {"model": box, "position_icrf_m": [0, 0, 0.65]},
        },
        span=0.32,
        size=1000,
        lean=lean,
    )
    for side in (-1.0, 1.0):
        out = side * x - 0.145
        # Light is blocked that comes less from outside than past the lower end, at 0.5 m, from
        # under the box, and past the upper one, at 0.8 m, from beside it.
        slope = np.maximum(-out / 0.5, -out / 0.8)
        near = out > -0.025
        truth = disc_share((side * lean[0] - slope) / TANGENT)
        np.testing.assert_allclose(share[near], truth[near], atol=0.02)


def test_a_far_blind_takes_the_share_of_the_disc_that_it_covers(gl: moderngl.Context) -> None:
    """A square of 1 m at 400 m covers 0.0944 of a disc of 0.526 deg."""
    x, share = lit_share(
        gl,
        {
            "plate": {"model": plate(2.0, 2.0), "position_icrf_m": [0, 0, 0]},
            "blind": {"model": plate(1.0, 1.0), "position_icrf_m": [0, 0, 400.0]},
        },
        span=1.0,
    )
    covered = 1.0 / (np.pi * (400.0 * TANGENT) ** 2)
    # Sixteen directions a sample, and at least five samples a pixel, even out over the picture.
    np.testing.assert_allclose(1.0 - share.mean(), covered, rtol=0.05)
    assert np.abs(1.0 - share - covered).max() < 0.03
    assert x.size == share.size
