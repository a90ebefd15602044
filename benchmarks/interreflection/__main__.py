"""Interreflection on Space Rider: its time in a frame, and sunlight between grid directions.

python -m benchmarks.interreflection --out FILE.json
"""

from __future__ import annotations

import argparse
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.record import write_record
from simgl.arrays import Array, Array32
from simgl.bench.scenes import scene_files
from simgl.environment_map import SkyRadiance, cell_radiance, cube_directions
from simgl.gpu.context import temporary_context
from simgl.passes.interreflection import InterreflectionPass
from simgl.radiosity.hemisphere import CELLS_ACROSS
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.solver import radiosity, reflectors, sun_cosines, vertex_irradiance
from simgl.radiosity.sunlit_patches import SunlitPatches
from simgl.radiosity.transport_store import TransportStore
from simgl.scenario.loader import load_scenario
from simgl.scene.mean_materials import mean_materials
from simgl.view.background import SKY_TEXELS
from simgl.view.frame_view import frame_view
from simgl.view.spacecraft_view import SpacecraftView

SUN = np.array([154.4, 174.8, 171.9, 313.4])
# Of a cloudy Earth below, per band [W m-2 sr-1], and how far it reaches from nadir at 400 km.
EARTH = np.array([20.0, 22.0, 25.0, 38.0])
EARTH_RADIUS = np.radians(70.0)
# An orbit of 400 km turns so far in a second [rad].
STEP = np.radians(0.0649)
FRAMES, WARM_UP = 60, 5
EXECUTOR = ThreadPoolExecutor(max_workers=1)


def earth_below() -> SkyRadiance:
    """Uniform, about -z."""
    seen = cube_directions(SKY_TEXELS)[..., 2] < -np.cos(EARTH_RADIUS)
    return SkyRadiance(radiance=(seen[..., None] * EARTH).astype(np.float32))


def directions(count: int) -> Array:
    """(count, 3) unit, anywhere."""
    vectors = np.random.default_rng(20261122).normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


def frame_times(ctx: moderngl.Context, spacecraft: SpacecraftView, step: float) -> dict[str, float]:
    """Of ``InterreflectionPass``, the Sun moved by a step [rad] from each to the next [ms].

    work : of all cores
    """
    transports = TransportStore()
    interreflection, sky = InterreflectionPass(ctx, transports, EXECUTOR), earth_below()
    assert spacecraft.incident_light is not None
    clock, work = [], []
    for frame in range(WARM_UP + FRAMES):
        turned = Rotation.from_rotvec([0.0, frame * step, 0.0])
        sun = turned.apply(spacecraft.incident_light.sun_direction)
        moved = replace(
            spacecraft, incident_light=replace(spacecraft.incident_light, sun_direction=sun)
        )
        start, before = time.perf_counter(), time.process_time()
        interreflection.draw([moved], lambda _: sky, "exact")
        interreflection.complete()
        clock.append(1e3 * (time.perf_counter() - start))
        work.append(1e3 * (time.process_time() - before))
    interreflection.release()
    names = "clock_p50", "clock_p95", "clock_least"
    values = np.percentile(clock[WARM_UP:], [50, 95, 0]).round(2).tolist()
    return dict(zip(names, values, strict=True)) | {
        "work_p50": round(float(np.median(work[WARM_UP:])), 2),
        "work_mean": round(float(np.mean(work[WARM_UP:])), 2),
    }


def interpolated_sunlight(
    spacecraft: SpacecraftView, transport: LightTransport, count: int
) -> dict[str, Any]:
    """Irradiance of vertices by other surfaces, sunlight on the patches interpolated between the
    directions of a grid, against sunlight traced in the Sun's own direction; surfaces are matt."""
    surface = reflectors(transport, mean_materials(spacecraft.model))
    sunlit = SunlitPatches(transport)
    sky = transport.sky @ (np.float32(np.pi) * cell_radiance(earth_below(), CELLS_ACROSS))

    def on_vertices(cosines: Array32) -> Array32:
        irradiance = (cosines[:, None] * SUN).astype(np.float32) + sky
        exitance = radiosity(transport, surface, surface.albedo * irradiance)
        return vertex_irradiance(transport.of_vertices, exitance)

    errors = []
    for direction in directions(count):
        interpolated = on_vertices(sunlit.cosines(direction))
        traced = on_vertices(sun_cosines(transport, direction))
        errors.append(np.sqrt(np.mean((interpolated - traced) ** 2) / np.mean(traced**2)))
    return {
        "directions": count,
        "rms_percent_p50_p95": (100 * np.percentile(errors, [50, 95])).round(1).tolist(),
    }


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.interreflection")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--directions", type=int, default=200)
    options = parser.parse_args()
    scenario = load_scenario(scene_files()["source_600"])
    state = scenario.at(scenario.epoch_tai_ns)
    spacecraft = frame_view(state, "observer", sample_budget=1000).tiles[0].spacecraft[0]
    with temporary_context() as ctx:
        transport = TransportStore().of(spacecraft.model)
        assert transport is not None
        results = {
            "renderer": ctx.info["GL_RENDERER"],
            "frame_ms": {
                "frames a second apart": frame_times(ctx, spacecraft, STEP),
                "frames 0.1 s apart": frame_times(ctx, spacecraft, 0.1 * STEP),
                "frames 15 s apart": frame_times(ctx, spacecraft, 15.0 * STEP),
            },
            "interpolated_sunlight": interpolated_sunlight(
                spacecraft, transport, options.directions
            ),
        }
    write_record(options.out, results)
    print(options.out.read_text())


if __name__ == "__main__":
    main()
