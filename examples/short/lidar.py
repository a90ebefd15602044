"""A flash LIDAR on the navigation camera: one pulse, and how far its ranges are off."""

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
    exposure = simulator.capture(state, "navcam", {Product.LIDAR, Product.TRUTH})
assert exposure.lidar is not None
assert exposure.truth is not None
found = (exposure.lidar.range > 0.0) & (exposure.truth.depth > 0.0)
error = (exposure.lidar.range - exposure.truth.range)[found]
low, high = np.quantile(error, [0.16, 0.84])
print(f"{found.sum()} ranges about {np.median(exposure.lidar.range[found]):.2f} m")
print(f"error {np.median(error):+.4f} m, two thirds within {0.5 * (high - low):.4f} m of that")
