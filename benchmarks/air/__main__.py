"""The air's tables against photons at rays of its own, and against the truth table; and the cost.

python -m benchmarks.air --out FILE.json
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import moderngl
import numpy as np

from benchmarks.air.photons import radiance_factor
from benchmarks.record import write_record
from simgl.arrays import Array
from simgl.gpu.context import open_context
from simgl.gpu.pipeline_state import State
from simgl.gpu.render_targets import Format, ImageTarget
from simgl.passes.background.air_tables import ORDERS, AirKind, make_tables
from simgl.physics.atmosphere import STANDARD
from simgl.scene.earth import Earth
from tests.authorities.atmosphere import rows
from tests.passes.air_scenes import RADIUS, Window, sphere, window

SIZE = 1280, 960

# Name, height of the camera [m], elevation and azimuth of the view, elevation of the Sun [deg].
RAYS = (
    ("space, 45 deg down", 400e3, -45.0, 70.0, 50.0),
    ("space, limb at 12 km", 400e3, -19.46, 120.0, 35.0),
    ("space, over the terminator", 400e3, -60.0, 0.0, 3.0),
    ("36,000 km, near the limb", 3.6e7, -81.5, 40.0, 60.0),
    ("10 km, level", 1e4, 0.0, 60.0, 40.0),
    ("ground, beside the Sun", 2.0, 25.0, 15.0, 25.0),
    ("ground, away from the low Sun", 2.0, 20.0, 180.0, 4.0),
)


def _direction(elevation_deg: float, azimuth_deg: float) -> Array:
    e, a = np.radians([elevation_deg, azimuth_deg])
    return np.array([np.sin(e), np.cos(e) * np.cos(a), np.cos(e) * np.sin(a)])


def simgl_rays(look: Window, photons: int) -> list[dict[str, Any]]:
    """Tables over photons for the standard air over ground of albedo 0.2, with standard errors."""
    earth = Earth(equatorial_radius=RADIUS, polar_radius=RADIUS, albedo=(0.2,) * 4, air=STANDARD)
    rng = np.random.default_rng(20261121)
    comparisons = []
    for name, height, elevation, azimuth, sun_elevation in RAYS:
        place = np.array([RADIUS + height, 0.0, 0.0])
        view, sun = _direction(elevation, azimuth), _direction(sun_elevation, 0.0)
        seen = look.ray(earth, place, view, sun)
        truth = np.array(
            [
                radiance_factor(
                    STANDARD, RADIUS, 0.2, place, view, sun, band=b, photons=photons, rng=rng
                )
                for b in range(4)
            ]
        )
        comparisons.append(
            {
                "ray": name,
                "photons": truth[:, 0].round(5).tolist(),
                "error_percent": (100.0 * (seen / truth[:, 0] - 1.0)).round(2).tolist(),
                "standard_error_percent": (100.0 * truth[:, 1] / truth[:, 0]).round(2).tolist(),
            }
        )
    return comparisons


def worst_rows(look: Window) -> list[dict[str, Any]]:
    """The five rows of the truth table that are met least well, all orders of scattering."""
    comparisons = []
    for column, albedo in (("all_black", 0.0), ("all_albedo0.3", 0.3)):
        for row in rows():
            r = float(np.linalg.norm(row.camera))
            place = row.camera * max(1.0, (RADIUS + 2.0) / r)
            error = look.ray(sphere(albedo), place, row.view, row.sun)[:3] / row.values[column] - 1
            comparisons.append(
                {
                    "row": row.name,
                    "column": column,
                    "error_percent": (100.0 * error).round(2).tolist(),
                    "value": row.values[column].tolist(),
                }
            )
    return sorted(comparisons, key=lambda f: -max(np.abs(f["error_percent"])))[:8]


def _milliseconds(ctx: moderngl.Context, draw: Callable[[], object]) -> dict[str, float]:
    """Least of nine: on the clock, and of all cores' work (a loaded machine shares its cores)."""
    draw()
    ctx.finish()
    clock, work = [], []
    for _ in range(9):
        start, before = time.perf_counter(), time.process_time()
        draw()
        ctx.finish()
        clock.append(time.perf_counter() - start)
        work.append(time.process_time() - before)
    return {"clock_ms": round(1e3 * min(clock), 1), "work_ms": round(1e3 * min(work), 1)}


def cost(ctx: moderngl.Context, look: Window) -> dict[str, Any]:
    """A picture filled by the Earth, at 1280 x 960, against an empty pass."""
    place, view = np.array([6.778137e6, 0.0, 0.0]), np.array([-1.0, 0.0, 0.0])
    suns = [_direction(40.0 + 0.1 * k, 30.0) for k in range(40)]
    target = ImageTarget(ctx, SIZE, (Format("f4", 4),))
    empty = ctx.program(
        vertex_shader="#version 330\nvoid main() { gl_Position = vec4(vec2(gl_VertexID & 1,"
        " gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }",
        fragment_shader="#version 330\nout vec4 c;\nvoid main() { c = vec4(0.5); }",
    )
    array = ctx.vertex_array(empty, [])

    def nothing() -> None:
        State().apply(ctx, target.framebuffer, (0, 0, *SIZE))
        array.render(moderngl.TRIANGLES, vertices=3)

    def planet(earth: Earth, sun: Array) -> None:
        look.draw(earth, place, view, sun, target, pixel=6e-4)

    ground, air = Earth(albedo=(0.3,) * 4), Earth(albedo=(0.3,) * 4, air=STANDARD)
    moving = iter(suns)
    result = {
        "empty": _milliseconds(ctx, nothing),
        "ground": _milliseconds(ctx, lambda: planet(ground, suns[0])),
        "ground and air": _milliseconds(ctx, lambda: planet(air, suns[0])),
        "ground, air and a new view's table": _milliseconds(ctx, lambda: planet(air, next(moving))),
    }
    ctx.detect_framebuffer(0).use()
    for owner in (array, empty, target):
        owner.release()
    return result


def main() -> None:
    """Run everything and write the record."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--out", type=Path, required=True)
    arguments.add_argument("--photons", type=int, default=60_000)
    given = arguments.parse_args()
    ctx = open_context()
    start, before = time.perf_counter(), time.process_time()
    kind = AirKind(air=STANDARD, radius=RADIUS, albedo=(0.2,) * 4)
    tables = make_tables(ctx, kind, orders=ORDERS)
    static = {
        "clock_s": round(time.perf_counter() - start, 1),
        "work_s": round(time.process_time() - before, 1),
        "bytes": sum(table.nbytes for table in tables.values()),
    }
    with window(ctx) as look:
        record = {
            "renderer": ctx.info["GL_RENDERER"],
            "static_tables": static,
            "cost_1280x960": cost(ctx, look),
            "own_rays": simgl_rays(look, given.photons),
            "truth_table_worst": worst_rows(look),
        }
    write_record(given.out, record)


if __name__ == "__main__":
    main()
