"""A flash LIDAR on the navigation camera: the range error of one pulse."""

import tomllib
from pathlib import Path

import numpy as np

import simgl
from simgl import Product

tables = tomllib.loads(Path("examples/docking_lamp.toml").read_text())
tables["camera"]["navcam"]["lidar"] = {"pulse_energy_mj": 1.0, "range_noise_m": 0.02}
scenario = simgl.scenario_from_dict(tables)
with simgl.Simulator(scenario) as simulator:
    state = scenario.at(scenario.epoch_tai_ns)
    capture = simulator.capture(state, "navcam", {Product.LIDAR, Product.TRUTH})
assert capture.lidar is not None
assert capture.truth is not None
measured = (capture.lidar.range > 0.0) & (capture.truth.depth > 0.0)
error = (capture.lidar.range - capture.truth.range)[measured]
low, high = np.quantile(error, [0.16, 0.84])
print(f"{measured.sum()} ranges about {np.median(capture.lidar.range[measured]):.2f} m")
print(f"error {np.median(error):+.4f} m, two thirds within {0.5 * (high - low):.4f} m of that")
