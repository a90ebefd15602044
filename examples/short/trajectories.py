"""Motion from files: OEM, AEM and a table of offsets, or two-line elements; range over time."""

import numpy as np

import simgl

for file, target in (("files", "target"), ("tle", "station")):
    scenario = simgl.load_scenario(f"examples/trajectories/{file}.toml")
    for minute in (0, 15, 30, 45):
        poses = scenario.poses(scenario.epoch_tai_ns + minute * 60_000_000_000)
        offset = poses["chaser"].position - poses[target].position
        altitude = np.linalg.norm(poses[target].position) - 6378137.0
        print(
            f"{file:<6} +{minute:2d} min  {target} at {altitude / 1e3:6.1f} km  "
            f"chaser at {np.linalg.norm(offset):6.2f} m"
        )
