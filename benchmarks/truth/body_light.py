"""Light between surfaces of one body: pixels of a frame loop's image against paths of light."""

from __future__ import annotations

from dataclasses import asdict

import moderngl
import numpy as np

from benchmarks.truth.light_paths import LightPaths, PixelLight
from benchmarks.truth.light_scenes import scenes
from benchmarks.truth.rows import Row, Table, relative
from simgl.arrays import Array, IndexArray
from simgl.content_digest import content_digest
from simgl.disk_cache import cache_folder, read_arrays, write_arrays
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.simulator import Product, Simulator

# Pixels of a scene, drawn among those that show a body, and paths of each: minutes on two cores.
PIXELS, PATHS = 2400, 8192
# A difference counts relative to the truth, but at least to this share of its mean.
FLOOR = 0.01
# Deep in the shadow few paths meet light: pixels whose truth is less certain than this, relative to
# what differences count by, get so many times more paths.
_CERTAIN, _MORE = 0.008, 12
# Dark: less than a twentieth of the light is the Sun's own.
_DARK = 0.05


def table(gl: moderngl.Context) -> Table:
    """Share of pixels near the truth, and the sum of the dark ones, scene by scene."""
    rows = []
    for name, scenario in scenes().items():
        state = scenario.at(scenario.epoch_tai_ns)
        pixels, truth = traced(state)
        near, dark = scores(shown(gl, scenario, pixels), truth)
        for within, share, goal in zip(("10 %", "5 %"), near, (0.97, 0.90), strict=True):
            row = Row(
                case=f"{name}, pixels within {within}",
                truth=1.0,
                simgl=share,
                error=share - 1.0,
                goal=1.0 - goal,
            )
            rows.append(row)
        if dark is not None:
            rows.append(relative(f"{name}, sum of dark pixels", dark[1], dark[0], 0.03))
    return Table(
        title="Light between the surfaces of a body",
        reference="paths of light through the same triangles; "
        f"{PIXELS} pixels of each scene, {PATHS} paths each",
        quantity="share of the pixels; sum of radiance [W m-2 sr-1]",
        error="of shares their distance to 1, of sums relative",
        rows=rows,
    )


def traced(state: SceneState) -> tuple[IndexArray, PixelLight]:
    """Pixels (n, 2), column and row, and their true light; kept as a file."""
    camera = state.cameras["cam"]
    paths = LightPaths(state)
    seen = np.argwhere(paths.seen(camera) > 0.9)[:, ::-1]
    rng = np.random.default_rng(20261123)
    pixels = seen[np.sort(rng.permutation(len(seen))[:PIXELS])]
    inputs = [str(state.sun), str(camera.camera), str((PATHS, _CERTAIN, _MORE))]
    inputs += [_hex(camera.R_camera_from_icrf), _hex(camera.position)]
    for body in state.bodies.values():
        inputs += [body.model.mesh.digest, str(body.model.materials)]
        inputs += [_hex(body.pose.position), _hex(body.pose.R_icrf_from_body)]
    if state.earth is not None:
        inputs += [str(state.earth.earth), _hex(state.earth.position)]
    path = cache_folder("truth") / f"{content_digest(tuple(inputs))}.npz"
    arrays = read_arrays(path)
    if arrays is None:
        light = paths.light(camera, pixels, PATHS, rng)
        unsure = np.flatnonzero(noise(light) > _CERTAIN)
        if len(unsure) > 0:
            again = paths.light(camera, pixels[unsure], _MORE * PATHS, rng)
            light = with_more(light, unsure, again, _MORE)
        arrays = asdict(light)
        write_arrays(path, arrays, "light is traced again next time")
    return pixels, PixelLight(**arrays)


def noise(truth: PixelLight) -> Array:
    """(n,) standard error of R, G and B together, which are as uncertain together, over what
    differences count relative to."""
    light = truth.radiance[:, :3].sum(axis=1)
    return np.asarray(truth.error[:, :3].sum(axis=1) / np.maximum(light, FLOOR * light.mean()))


def with_more(light: PixelLight, chosen: IndexArray, again: PixelLight, times: int) -> PixelLight:
    """Light with so many times more paths for some of its pixels."""
    share = times / (times + 1.0)

    def mixed(old: Array, new: Array) -> Array:
        values = old.copy()
        values[chosen] += share * (new - old[chosen])
        return values

    error = light.error.copy()
    error[chosen] = np.hypot((1.0 - share) * error[chosen], share * again.error)
    radiance = mixed(light.radiance, again.radiance)
    # Shares of the radiance mix by the light that they are of.
    first = mixed(
        light.direct * light.radiance.mean(axis=1), again.direct * again.radiance.mean(axis=1)
    )
    return PixelLight(
        radiance=radiance,
        error=error,
        coverage=mixed(light.coverage, again.coverage),
        direct=first / np.maximum(radiance.mean(axis=1), 1e-30),
    )


def _hex(values: Array) -> str:
    return values.tobytes().hex()


def shown(gl: moderngl.Context, scenario: Scenario, pixels: IndexArray) -> Array:
    """(n, 4) radiance of the pixels in the image of a frame loop."""
    with Simulator(scenario, gl) as simulator:
        capture = simulator.capture(
            scenario.at(scenario.epoch_tai_ns), "cam", frozenset({Product.RADIANCE})
        )
    assert capture.radiance is not None
    return capture.radiance.radiance[pixels[:, 1], pixels[:, 0]].astype(np.float64)


def relative_differences(got: Array, truth: PixelLight) -> Array:
    """(n,) of R, G and B together."""
    a, b = got[:, :3].sum(axis=1), truth.radiance[:, :3].sum(axis=1)
    return np.asarray((a - b) / np.maximum(b, FLOOR * b.mean()))


def scores(got: Array, truth: PixelLight) -> tuple[tuple[float, float], tuple[float, float] | None]:
    """Shares of pixels within 10 % and 5 %, and sums of the dark ones: simgl's and the truth."""
    off = np.abs(relative_differences(got, truth))
    dark = truth.direct < _DARK
    near = float((off <= 0.10).mean()), float((off <= 0.05).mean())
    if not np.any(dark):
        return near, None
    return near, (float(got[dark, :3].sum()), float(truth.radiance[dark, :3].sum()))
