"""``python -m benchmarks.gpu.ways``: work that a GPU may do itself or leave to the CPU, both ways.

Prints a line of JSON for each step, so that the first ones stay where time runs out. For a lens
that spreads light: the median and 90th percentile of the time by each way, and how far the images
lie apart, as a fraction of the peak; ways take turns. For scenes: frames with light sums and spread
on the CPU, and by compute shaders; frames whose pages of shading points the CPU numbers, which it
does once it has asked for squares that share points, and a compute shader, without these; their
median and those of their passes.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from unittest.mock import patch

import moderngl
import numpy as np

from simgl import Simulator, load_scenario
from simgl.arrays import Array32
from simgl.bench.frame_times import FrameLoop, epochs_of, frame_statistics
from simgl.bench.scenes import bench_scenes
from simgl.camera.camera import Camera, Detector, Lens
from simgl.camera.camera_equation import square_electrons_per_irradiance
from simgl.camera.detector import Mosaic
from simgl.camera.lens import Blur, PointSpread, Zone
from simgl.gpu.context import temporary_context
from simgl.gpu.render_targets import Format, ImageTarget
from simgl.passes.compute_spread import ComputeSpreadPass
from simgl.passes.exposure import ELECTRONS_FORMAT
from simgl.passes.spread import SpreadPass

_PHOTONS_PER_JOULE = np.array([3.3e18, 2.8e18, 2.3e18, 4.2e18])
_MOSAIC = Mosaic(
    order="GRBG", red=(0.6, 0.1, 0.0, 0.3), green=(0.1, 0.5, 0.1, 0.3), blue=(0.0, 0.1, 0.4, 0.2)
)
_BEFORE = 3
# Modules that choose who does some work, and scenes with much of it: spread of light and sums at
# vertices; numbers of pages.
_CHOICES = {
    "frames": ("simgl.rendering.camera_pipeline", "simgl.passes.interreflection"),
    "pages": ("simgl.passes.gbuffer",),
}
_SCENES = {
    "frames": ("reference_1280", "camera_1280", "source_600"),
    "pages": ("bay_1280", "docking_20m", "square_2048"),
}
# For the frames of each way, at most.
_LIMIT_S = 8.0


def _camera(size: tuple[int, int], mosaic: Mosaic | None) -> Camera:
    detector = Detector(
        width=size[0],
        height=size[1],
        pixel_pitch=3.75e-6,
        quantum_efficiency=(0.6, 0.6, 0.6, 0.3),
        full_well=20000.0,
        read_noise=4.0,
        bits=12,
        pedestal=64.0,
        gain_dn_per_e=0.2,
    )
    zones = (Zone(share=0.0, blur=Blur(aberration=1e-6)),)
    lens = Lens(
        focal_length=13e-3,
        f_number=2.8,
        spread=PointSpread(diffraction=True, zones=zones),
        veiling_glare=0.001,
    )
    return Camera(
        name="camera",
        lens=lens,
        detector=replace(detector, mosaic=mosaic),
        exposure_time=1e-4,
    )


def _times(
    ctx: moderngl.Context, ways: Mapping[str, Callable[[], None]], rounds: int
) -> dict[str, dict[str, float]]:
    """Of each way [ms]."""
    taken: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(_BEFORE + rounds):
        for name, work in ways.items():
            ctx.finish()
            start = time.perf_counter()
            work()
            ctx.finish()
            taken[name].append(1e3 * (time.perf_counter() - start))
    return {
        name: {
            "p50_ms": round(float(np.median(times[_BEFORE:])), 3),
            "p90_ms": round(float(np.quantile(times[_BEFORE:], 0.9)), 3),
        }
        for name, times in taken.items()
    }


def spread(
    ctx: moderngl.Context, size: tuple[int, int], mosaic: Mosaic | None, rounds: int
) -> dict[str, object]:
    """A lens that spreads the light of a whole image."""
    camera = _camera(size, mosaic)
    square = square_electrons_per_irradiance(replace(camera, exposure_time=1.0), _PHOTONS_PER_JOULE)
    radiance = ImageTarget(ctx, size, [Format("f4", 4)])
    light = np.random.default_rng(1).random((size[1], size[0], 4), dtype=np.float32)
    radiance.textures[0].write((100.0 * light).astype("<f4").tobytes())
    passes: dict[str, SpreadPass | ComputeSpreadPass]
    passes = {"cpu": SpreadPass(), "compute": ComputeSpreadPass(ctx)}
    targets, ways = {}, {}
    for name, way in passes.items():
        target = targets[name] = ImageTarget(ctx, size, [ELECTRONS_FORMAT])

        def work(way: SpreadPass | ComputeSpreadPass = way, target: ImageTarget = target) -> None:
            way.electrons(camera, square, None, radiance, target)

        ways[name] = work
    times = _times(ctx, ways, rounds)
    images: list[Array32] = [target.read() for target in targets.values()]
    for owner in (*passes.values(), radiance, *targets.values()):
        owner.release()
    difference = float(np.abs(images[1] - images[0]).max() / images[0].max())
    return {**times, "difference": float(f"{difference:.2g}")}


def frames(ctx: moderngl.Context, work: str, scene: str, count: int) -> dict[str, object]:
    """Frames 0.1 s apart by each way to do some work of ``_CHOICES`` [ms]."""
    by_way: dict[str, object] = {}
    bench_scene = bench_scenes()[scene]
    for name, by_compute in (("cpu", False), ("compute", True)):
        scenario = load_scenario(bench_scene.path)
        epochs = epochs_of(scenario, 2 * count, 0.1)
        with ExitStack() as stack:
            for module in _CHOICES[work]:
                chosen = patch(f"{module}.prefers_compute", lambda _, way=by_compute: way)
                stack.enter_context(chosen)
            simulator = stack.enter_context(Simulator(scenario, ctx))
            loop = FrameLoop(simulator, bench_scene.cameras, epochs, _LIMIT_S)
            loop.warm_up()
            seconds, passes = loop.frame_seconds(count), loop.pass_seconds(count)
        by_way[name] = {
            "p50_ms": frame_statistics(seconds).p50,
            **{f"{one}_p50_ms": frame_statistics(passes[one]).p50 for one in sorted(passes)},
        }
    return by_way


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=40)
    rounds = parser.parse_args().rounds
    with temporary_context() as ctx:
        steps: dict[str, Callable[[], object]] = {
            "renderer": lambda: ctx.info["GL_RENDERER"],
            "spread, 1280 x 960": partial(spread, ctx, (1280, 960), None, rounds),
            "spread, 1280 x 960, colour": partial(spread, ctx, (1280, 960), _MOSAIC, rounds),
            "spread, 2048 x 2048": partial(spread, ctx, (2048, 2048), None, rounds),
            **{
                f"{work} of {scene}": partial(frames, ctx, work, scene, rounds)
                for work, scenes in _SCENES.items()
                for scene in scenes
            },
        }
        for name, step in steps.items():
            print(json.dumps({name: step()}), flush=True)


if __name__ == "__main__":
    main()
