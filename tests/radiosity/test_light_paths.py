"""The truth that ``benchmarks.truth`` holds images against: paths of light."""

from __future__ import annotations

import numpy as np

from benchmarks.truth.light_paths import LightPaths
from tests.radiosity.boxes import C6, c6_scene
from tests.scenes import IN_BANDS, TOTAL


def test_paths_find_the_floor_of_the_open_box_with_all_bounces() -> None:
    """Pixels of ``c6_scene`` in the shadow and in the light."""
    scenario = c6_scene(0.8, on=True)
    state = scenario.at(scenario.epoch_tai_ns)
    paths, camera = LightPaths(state), state.cameras["cam"]
    assert paths.seen(camera)[64, 64] == 1.0
    assert paths.seen(camera)[2, 2] == 0.0
    columns, rows = np.meshgrid(np.arange(1, 127, 4), np.arange(36, 92, 8))
    x = (columns - 63.5) / (400.0 / 6.0) + 1.0
    for name, inside in {
        "shadow": (x > 0.0625) & (x < 0.9375),
        "lit": (x > 1.0625) & (x < 1.9375),
    }.items():
        pixels = np.stack([columns[inside], rows[inside]], axis=1)
        light = paths.light(camera, pixels, 128, np.random.default_rng(7))
        total = light.radiance.sum(axis=1) * (TOTAL / IN_BANDS)
        error = float(np.hypot.reduce(light.error.sum(axis=1))) * (TOTAL / IN_BANDS) / len(pixels)
        expected = C6[0][name]
        # The table is good to 0.2 %; pixels leave out the walls' feet, up to 1 % of the mean.
        assert abs(total.mean() - expected) < 0.012 * expected + 4.0 * error
        np.testing.assert_allclose(light.coverage, 1.0)
        assert (light.direct.max() == 0.0) == (name == "shadow")
