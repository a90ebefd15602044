"""Pointing laws: what the cameras of one spacecraft look at, and their angle to the Sun."""

import numpy as np

import simgl

scenario = simgl.load_scenario("examples/pointing.toml")
state = scenario.at(scenario.epoch_tai_ns)
assert state.earth is not None
for name, camera in state.cameras.items():
    boresight = camera.R_camera_from_icrf[2]
    sun = state.sun.seen_from(camera.position).direction_icrf
    height = simgl.tangent_heights(state.earth, camera.position, boresight[None])[0] / 1e3
    meets = "in view" if height < 0.0 else f"passed at {height:.1f} km"
    angle = np.degrees(np.arccos(boresight @ sun))
    print(f"{name:<9} Earth {meets:<18}  Sun at {angle:5.1f} deg")
