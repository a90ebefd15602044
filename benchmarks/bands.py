"""The Earth in bands of a scenario, by images: ``python -m benchmarks.bands``; one to two minutes.

Each row: what was measured, what it should be, and by how much it may differ.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from simgl.arrays import Array
from simgl.scenario.loader import scenario_from_dict
from simgl.simulator import Product, Simulator
from tests.passes.band_scenes import ORBIT, over_earth
from tests.reference.gas_lines import gas_transmittance


def _image(boresight: list[float], bands: list[list[float]] | None, **earth: Any) -> Array:
    """(72, 96, 4) radiance over that of a white surface in sunlight straight on."""
    ball = {"sphere": {"radius_m": 1.0, "material": {"reflectance": 0.5}}}
    scene = over_earth(
        boresight,
        [0.0, 0.0, 1.0],
        bands,
        earth=earth,
        sun={"direction_icrf": [1.0, 0.0, 0.0]},
        spacecraft={"ball": {"model": ball, "position_icrf_m": [ORBIT + 99.0, 0.0, 0.0]}},
    )
    scenario = scenario_from_dict(scene)
    with Simulator(scenario) as simulator:
        state = scenario.at(scenario.epoch_tai_ns)
        taken = simulator.capture(state, "cam", {Product.RADIANCE}).radiance
        assert taken is not None
        white = (
            np.maximum(state.sun.seen_from(np.array([ORBIT, 0.0, 0.0])).irradiance, 1e-30) / np.pi
        )
        return np.asarray(taken.radiance / white)


def _rows() -> Iterator[tuple[str, float, float, float]]:
    slanted = [-0.8, 0.6, 0.2]
    default = _image(slanted, None)
    bands = [[545.0, 555.0], [640.0, 660.0], [759.0, 771.0], [745.0, 757.0]]
    other = _image(slanted, bands)
    green = other[..., 0].mean() / default[..., 1].mean()
    yield "Earth with maps and clouds: 545-555 nm over G", green, 1.0, 0.02
    cloud = default[..., 0] > np.percentile(default[..., 0], 95)
    red = other[cloud][:, 1].mean() / default[cloud][:, 0].mean()
    yield "its brightest clouds: 640-660 nm over R", red, 1.0, 0.03
    nadir = _image([-1.0, 0.0, 0.0], bands, albedo=0.5)[36, 48]
    oxygen = gas_transmittance("oxygen", np.array([762e-9, 767e-9]), np.array([2.0]))[:, 0]
    # 759 to 760, to 765, to 770 and to 771 nm; what the air scatters, 4 % of it, passes less.
    edges = gas_transmittance("oxygen", np.array([759.5e-9, 770.5e-9]), np.array([2.0]))[:, 0]
    expected = (edges.sum() + 5.0 * oxygen.sum()) / 12.0
    yield (
        "oxygen at nadir over grey ground: 759-771 over 745-757 nm",
        nadir[2] / nadir[3],
        expected,
        0.03,
    )


def main() -> None:
    """Print the table."""
    print(f"{'':62}{'measured':>9}{'expected':>9}{'within':>8}")
    for name, measured, expected, within in _rows():
        mark = "" if abs(measured / expected - 1.0) <= within else "  MISSED"
        print(f"{name:62}{measured:9.4f}{expected:9.4f}{100 * within:7.1f} %{mark}")


if __name__ == "__main__":
    main()
