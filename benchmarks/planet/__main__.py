"""``python -m benchmarks.planet --out FILE.json``: the Earth with its air and clouds from several
places at 1280 x 960, and two empty full-screen passes of the same size and format.

Each draw is finished before the clock stops. Rounds over all of them take turns, so that other work
on the machine slows all alike; of each the quickest counts.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import moderngl
import msgspec
import numpy as np
import typer

from benchmarks.record import load, write_record
from simgl import assets
from simgl.gpu.context import temporary_context
from simgl.gpu.glsl import assemble
from simgl.gpu.pipeline_state import State
from simgl.gpu.render_targets import Format, ImageTarget
from simgl.passes.background.air import AtmospherePass
from simgl.passes.background.planet import PlanetPass
from simgl.passes.background.planet_blocks import PLANET
from simgl.physics.ephemeris import itrf_from_icrf, tai_ns_from_utc
from simgl.scenario.loader import scenario_from_dict
from simgl.view.background import Background, background

SIZE = 1280, 960
UTC_NOON = "2026-03-20T12:00:00"
EARTH_RADIUS_KM = 6378.137
# Latitude, longitude [deg], height [km], angle from nadir [deg], field of view along a row [deg].
VIEWS = {
    "400 km, straight down, sea": (-30.0, -20.0, 400.0, 0.0, 40.0),
    "400 km, straight down, land": (5.0, 20.0, 400.0, 0.0, 40.0),
    "845 km, straight down": (5.0, -25.0, 845.0, 0.0, 40.0),
    "400 km, 45 deg of slant": (28.0, -18.0, 400.0, 45.0, 45.0),
    "400 km, limb, 22 deg over it": (-5.0, -30.0, 400.0, 66.0, 45.0),
    "36,000 km, whole Earth": (10.0, -10.0, 36_000.0, 0.0, 23.0),
    "36,000 km, Earth across the frame": (10.0, -10.0, 36_000.0, 0.0, 16.0),
    "400 km, straight down, night": (-30.0, 170.0, 400.0, 0.0, 40.0),
}


Area = tuple[int, int, int, int]
_FULLSCREEN = "common/fullscreen.vert"


class Cost(msgspec.Struct, frozen=True, kw_only=True):
    """Of one draw [ms]: on all cores together, and by the clock."""

    cpu_ms: float
    wall_ms: float


class Record(msgspec.Struct, frozen=True, kw_only=True):
    """What a run found; load : of the machine before it."""

    renderer: str
    load: float
    draws: dict[str, Cost]


def _camera(
    latitude: float, longitude: float, height_km: float, slant: float, field: float
) -> dict[str, Any]:
    lat, lon, tilt = np.radians([latitude, longitude, slant])
    up = np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
    east = np.array([-np.sin(lon), np.cos(lon), 0.0])
    boresight = -np.cos(tilt) * up + np.sin(tilt) * east
    R_icrf_from_itrf = itrf_from_icrf(tai_ns_from_utc(UTC_NOON)).T
    return {
        "position_icrf_m": (R_icrf_from_itrf @ up * (EARTH_RADIUS_KM + height_km) * 1e3).tolist(),
        "boresight": (R_icrf_from_itrf @ boresight).tolist(),
        "up": (R_icrf_from_itrf @ np.cross(east, boresight)).tolist(),
        "width_px": SIZE[0],
        "height_px": SIZE[1],
        "pixel_pitch_um": 3.75,
        "focal_length_mm": 3.75e-3 * SIZE[0] / (2.0 * np.tan(np.radians(0.5 * field))),
    }


def _backgrounds() -> dict[str, Background]:
    cameras = {str(i): _camera(*place) for i, place in enumerate(VIEWS.values())}
    scenario = scenario_from_dict({"epoch": {"utc": UTC_NOON}, "camera": cameras})
    state = scenario.at(scenario.epoch_tai_ns)
    return {name: background(state, state.cameras[str(i)]) for i, name in enumerate(VIEWS)}


class _Empty:
    """A full-screen pass of this folder; reads the block of the planet last drawn."""

    def __init__(self, ctx: moderngl.Context, name: str, target: ImageTarget, area: Area) -> None:
        self._ctx, self._target, self._area = ctx, target, area
        texts = {PLANET.include: PLANET.glsl, name: (Path(__file__).parent / name).read_text()}
        stages = (assemble(assets.shaders(), n, None, texts) for n in (_FULLSCREEN, name))
        vertex, fragment = (stage.text for stage in stages)
        self._program = ctx.program(vertex_shader=vertex, fragment_shader=fragment)
        block = self._program.get("Planet", None)
        if isinstance(block, moderngl.UniformBlock):
            block.binding = PLANET.binding
        self._array = ctx.vertex_array(self._program, [])

    def draw(self) -> None:
        State().apply(self._ctx, self._target.framebuffer, self._area, self._area)
        self._array.render(moderngl.TRIANGLES, vertices=3)


def _timed(ctx: moderngl.Context, draw: Callable[[], None]) -> tuple[float, float]:
    cpu, wall = time.process_time(), time.perf_counter()
    draw()
    ctx.finish()
    return 1e3 * (time.process_time() - cpu), 1e3 * (time.perf_counter() - wall)


def main(
    out: Annotated[Path, typer.Option(help="JSON file for the results.")],
    rounds: Annotated[int, typer.Option(help="Draws of each.")] = 30,
) -> None:
    """Draw, time, print, and write the record."""
    before = load()
    with temporary_context() as ctx:
        air = AtmospherePass(ctx)
        planet = PlanetPass(ctx, air)
        target = ImageTarget(ctx, SIZE, (Format("f4", 4),))
        area = 0, 0, *SIZE

        def draw_earth(view: Background) -> None:
            planet.draw(planet.planned(view, target.framebuffer, area, None))

        draws: dict[str, Callable[[], None]] = {
            name: partial(draw_earth, view) for name, view in _backgrounds().items()
        }
        for name in ("constant", "sphere"):
            draws[f"empty pass: {name}"] = _Empty(ctx, f"{name}.frag", target, area).draw
        taken: dict[str, list[tuple[float, float]]] = {name: [] for name in draws}
        for round_ in range(rounds + 2):
            for name, draw in draws.items():
                # The air's tables of eight views are kept: made before the clock starts.
                draw()
                ctx.finish()
                spent = _timed(ctx, draw)
                if round_ > 1:
                    taken[name].append(spent)
        renderer = ctx.info["GL_RENDERER"]
    costs = {
        name: Cost(
            cpu_ms=round(min(c for c, _ in times), 2),
            wall_ms=round(min(w for _, w in times), 2),
        )
        for name, times in taken.items()
    }
    record = Record(
        renderer=renderer,
        load=before,
        draws=costs,
    )
    write_record(out, record)
    sphere = costs["empty pass: sphere"]
    for name, one in costs.items():
        times = f"{one.cpu_ms / sphere.cpu_ms:.1f} of the sphere's"
        print(f"{name:36}{one.cpu_ms:8.1f} ms of CPU, {one.wall_ms:6.1f} by the clock, {times}")


if __name__ == "__main__":
    typer.run(main)
