"""The air against an independent Monte Carlo, row by row; each failure names its row."""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array
from simgl.environment_map import DOWN, FORWARD
from simgl.passes.background import earth_air
from simgl.passes.background.air_tables import AirKind, make_tables, tables_of
from simgl.physics.atmosphere import SOURCE
from simgl.physics.skylight import table_suns
from simgl.scene.earth import Earth
from simgl.view.background import SKY_TEXELS, TERMINATOR_TEXELS
from tests.authorities.atmosphere import Row, ground_irradiance, plate_irradiance, rows
from tests.passes.air_scenes import RADIUS, sphere, window

# A camera that stands on the ground is put so far above it [m]: 1e-6 of the air's depth.
LIFT = 2.0


def place_of(row: Row) -> Array:
    """Where a row's camera stands."""
    r = float(np.linalg.norm(row.camera))
    return row.camera * max(1.0, (RADIUS + LIFT) / r)


def report(errors: dict[str, Array], limits: dict[str, Array]) -> None:
    """Fail with every row beyond its limit, the worst one first."""
    beyond = {name: np.abs(e) / limits[name] for name, e in errors.items()}
    bad = sorted((n for n in errors if beyond[n].max() > 1.0), key=lambda n: -beyond[n].max())
    assert not bad, "\n".join(f"{n}: {np.round(100 * errors[n], 2)} %" for n in bad)


def test_single_scattering_is_within_a_hundredth_at_every_row(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    def of_no_orders(ctx: moderngl.Context, kind: AirKind, progress: object = None) -> object:
        del progress
        return make_tables(ctx, kind, orders=0)

    monkeypatch.setattr(earth_air, "tables_of", of_no_orders)
    black, errors = sphere(0.0), {}
    with window(gl) as look:
        for row in rows():
            seen = look.ray(black, place_of(row), row.view, row.sun)[:3]
            errors[row.name] = seen / row.values["single"] - 1.0
    report(errors, dict.fromkeys(errors, np.full(3, 0.01)))


@pytest.mark.parametrize(("column", "albedo"), [("all_black", 0.0), ("all_albedo0.3", 0.3)])
def test_all_orders_are_right_at_every_row(
    gl: moderngl.Context, column: str, albedo: float
) -> None:
    earth, errors, limits = sphere(albedo), {}, {}
    with window(gl) as look:
        for row in rows():
            truth = row.values[column]
            errors[row.name] = look.ray(earth, place_of(row), row.view, row.sun)[:3] / truth - 1.0
            twilight = np.where(truth > 1e-3, 0.05, 0.10)
            limits[row.name] = twilight if row.sun_zenith_deg >= 88.0 else np.full(3, 0.02)
    report(errors, limits)


@dataclass(frozen=True, kw_only=True)
class _BlackInTheMean(Earth):
    """A ground whose own reflectance does not change the light in the air."""

    @property
    def mean_albedo(self) -> tuple[float, float, float, float]:
        return (0.0, 0.0, 0.0, 0.0)


def test_transmittance_is_within_half_a_hundredth_at_every_row(gl: moderngl.Context) -> None:
    """Of the ground: what its reflection loses from 2 m above it to the camera. To space: what is
    left of a bright field behind. The Sun stands over the camera, wherever a row has it: all that
    a camera sees of the ground is lit, and rows from one height share the light in the air."""
    white, black = (
        _BlackInTheMean(equatorial_radius=RADIUS, polar_radius=RADIUS, albedo=(a,) * 4, air=SOURCE)
        for a in (1.0, 0.0)
    )
    errors = {}
    with window(gl) as look:
        for row in rows():
            place = place_of(row)
            sun = place / np.linalg.norm(place)
            b = float(np.dot(place, row.view))
            to_ground = b * b - np.dot(place, place) + RADIUS**2
            if b < 0.0 and to_ground > 0.0:
                near = place - (b + np.sqrt(to_ground)) * row.view
                near *= (RADIUS + LIFT) / np.linalg.norm(near)
                high, low = (
                    look.ray(white, p, row.view, sun) - look.ray(black, p, row.view, sun)
                    for p in (place, near)
                )
                seen = high / low
            else:
                bright, dark = (
                    look.picture(black, place, row.view, sun, behind=b)[1, 1].astype(float)
                    for b in (1e3, 0.0)
                )
                seen = (bright - dark) / 1e3
            errors[row.name] = seen[:3] / row.values["T_view"] - 1.0
    report(errors, dict.fromkeys(errors, np.full(3, 0.005)))


@pytest.mark.parametrize(("column", "albedo"), [("diffuse_black", 0.0), ("diffuse_a3", 0.3)])
def test_the_sky_lights_the_ground_within_two_hundredths(
    gl: moderngl.Context, column: str, albedo: float
) -> None:
    tables = tables_of(gl, AirKind(air=SOURCE, radius=RADIUS, albedo=(albedo,) * 4))
    down = tables["diffuse_down"][0]
    errors, limits = {}, {}
    for zenith, truth in ground_irradiance().items():
        mu = np.cos(np.radians(zenith))
        seen = np.array([np.interp(mu, table_suns(), down[:, band]) for band in range(3)])
        errors[f"{zenith:g} deg"] = seen / truth[column] - 1.0
        limits[f"{zenith:g} deg"] = np.full(3, 0.02)
    report(errors, limits)


@pytest.mark.parametrize(("ground", "albedo"), [("black", 0.0), ("a3", 0.3)])
def test_plates_at_500_km_get_the_light_that_the_truth_gives_them(
    gl: moderngl.Context, ground: str, albedo: float
) -> None:
    """By the six faces of a spacecraft's sky; within 2 %, or three of the truth's own errors."""
    up, sunward = np.eye(3)[0], np.eye(3)[1]
    normals = {"nadir": -up, "horizon_sunward": sunward, "horizon_antisun": -sunward}
    errors, limits = {}, {}
    with window(gl) as look:
        for zenith, n in ((30.0, SKY_TEXELS), (90.0, TERMINATOR_TEXELS)):
            across = (np.arange(n) + 0.5) * 2.0 / n - 1.0
            y, x = np.meshgrid(across, across, indexing="ij")
            solid_angle = (2.0 / n) ** 2 / (1.0 + x * x + y * y) ** 1.5
            z = np.radians(zenith)
            sun = np.cos(z) * up + np.sin(z) * sunward
            found = {name: np.zeros(4) for name in normals}
            for down, forward in zip(DOWN, FORWARD, strict=True):
                face = look.picture(
                    sphere(albedo),
                    (RADIUS + 500e3) * up,
                    forward,
                    sun,
                    up=-down,
                    size=(n, n),
                    pixel=2.0 / n,
                )
                rays = x[..., None] * np.cross(down, forward) + y[..., None] * down + forward
                rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
                for name, normal in normals.items():
                    weight = np.maximum(rays @ normal, 0.0) * solid_angle
                    found[name] += np.einsum("yxb,yx->b", face, weight) / np.pi
            for name in normals:
                value, error = plate_irradiance()[f"sza{zenith:.0f}_{name}"][ground].T
                errors[f"{zenith:g} {name}"] = found[name][:3] / value - 1.0
                limits[f"{zenith:g} {name}"] = np.maximum(0.02, 3.0 * error / value)
    report(errors, limits)
