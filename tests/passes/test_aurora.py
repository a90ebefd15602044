"""The aurora in images: as much light as its oval sends, at its heights, by night alone."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.physics import aurora
from tests.scenes import radiance, scene

Array = np.ndarray[Any, Any]

DARK = {"atmosphere": "none", "clouds": {"cover": 0.0}, "moonlight": False, "airglow": False}
RADIUS = 6371e3


def seen(
    gl: moderngl.Context,
    position: Array,
    boresight: Array,
    *,
    kp: float | None,
    sun: tuple[float, float, float] = (0.0, 0.0, -1.0),
    pixels: tuple[int, int] = (96, 96),
    field: float,
) -> Array:
    camera = {
        "position_icrf_m": position.tolist(),
        "boresight": boresight.tolist(),
        "up": [1.0, 0.0, 0.0] if abs(boresight[2]) > 0.9 else [0.0, 0.0, 1.0],
        "width_px": pixels[0],
        "height_px": pixels[1],
        "pixel_pitch_um": 5.0,
        "focal_length_mm": 5e-3 * pixels[0] / (2.0 * np.tan(0.5 * field)),
    }
    earth = DARK if kp is None else DARK | {"aurora_kp": kp}
    return radiance(gl, scene({}, camera, sun_direction=sun, earth=earth))


def test_an_oval_sends_as_much_light_as_its_particles_bring(gl: moderngl.Context) -> None:
    """Seen from far over the pole, in the night of the hemisphere. Half a percent is the
    projection, the rest chance: the arcs' bright stretches and folds."""
    distance, field = 60e6, 0.12
    over = np.array([0.0, 0.0, distance]), np.array([0.0, 0.0, -1.0])
    # Without cities.
    image = seen(gl, *over, kp=3.0, field=field) - seen(gl, *over, kp=None, field=field)
    pixel = (2.0 * np.tan(0.5 * field) / 96) ** 2
    # The oval lies 20 deg from the pole, 6,100 km of the way to the camera.
    towards = distance - (RADIUS + 120e3) * np.cos(np.radians(20.0))
    power = image.sum(axis=(0, 1)) * pixel * towards**2
    expected = aurora.hemispheric_power(3.0) * aurora.brightness().sum(axis=0)
    np.testing.assert_allclose(power, expected, rtol=0.06)


def test_its_light_at_the_limb_begins_at_100_km_and_ends_at_350(gl: moderngl.Context) -> None:
    # From over 25 deg of latitude; the limb there is the 70th degree.
    across, along = np.radians([45.0, 25.0])
    position = RADIUS / np.cos(across) * np.array([np.cos(along), 0.0, np.sin(along)])
    # 150 km over it.
    to_limb = (RADIUS + 150e3) * np.array([np.cos(np.radians(70.0)), 0.0, np.sin(np.radians(70.0))])
    to_limb -= position
    to_limb /= np.linalg.norm(to_limb)
    image = seen(gl, position, to_limb, kp=4.0, field=0.02, pixels=(32, 128))
    rows = image.mean(axis=1)
    heights = _tangent_heights(position, to_limb, 0.02, (32, 128))
    assert rows[heights > 356e3].max() == 0.0
    green = heights[rows[:, 1].argmax()]
    assert 95e3 < green < 130e3
    redness = rows[:, 0] / np.maximum(rows[:, 1], 1e-12)
    assert (
        redness[(heights > 230e3) & (heights < 330e3)].mean()
        > 3.0 * redness[np.abs(heights - 110e3) < 10e3].mean()
    )


def _tangent_heights(
    position: Array, forward: Array, field: float, pixels: tuple[int, int]
) -> Array:
    up = np.array([0.0, 0.0, 1.0]) - forward[2] * forward
    up /= np.linalg.norm(up)
    tangent = (np.arange(pixels[1]) + 0.5 - pixels[1] / 2) * 2.0 * np.tan(0.5 * field) / pixels[0]
    ray = forward - tangent[:, None] * up
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    nearest = position - (ray @ position)[:, None] * ray
    # Of the ellipsoid, whose radius is 6360 km at 70 deg.
    return np.linalg.norm(nearest, axis=1) - 6359.6e3


def test_there_is_none_by_day_and_none_unless_asked_for(gl: moderngl.Context) -> None:
    over = np.array([0.0, 0.0, 20e6]), np.array([0.0, 0.0, -1.0])
    day = [seen(gl, *over, kp=kp, sun=(0.0, 0.0, 1.0), field=0.5) for kp in (None, 5.0)]
    np.testing.assert_array_equal(day[0], day[1])
    night = [seen(gl, *over, kp=kp, field=0.5) for kp in (None, 0.0)]
    assert (night[1] - night[0]).max() > 1e-6


def test_waves_in_the_airglow_have_their_rms_and_keep_its_mean(gl: moderngl.Context) -> None:
    """Over 2,000 km of a dark sea: some 20 of the bands' trains and a few of the widest waves."""
    over = np.array([0.0, -9.4e6, 0.0]), np.array([0.0, 1.0, 0.0])
    camera = {
        "position_icrf_m": over[0].tolist(),
        "boresight": over[1].tolist(),
        "up": [0.0, 0.0, 1.0],
        "width_px": 96,
        "height_px": 96,
        "pixel_pitch_um": 5.0,
        "focal_length_mm": 0.7,
    }
    glow = DARK | {"atmosphere": "standard", "airglow": True}
    even, waving = (
        radiance(gl, scene({}, camera, sun_direction=(0.0, 1.0, 0.0), earth=glow | more))
        for more in ({}, {"airglow_waves": 0.2})
    )
    ratio = waving[..., 1] / even[..., 1]
    assert ratio.mean() == pytest.approx(1.0, abs=0.05)
    # The ground's share of the light, a few percent, has no waves.
    assert ratio.std() == pytest.approx(0.2, rel=0.25)
