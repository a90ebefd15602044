"""A target from arrays: vertices and triangles made in Python stand in for a model file."""

import numpy as np

import simgl

corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
faces += [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
cube = simgl.model_from_mesh((corners, faces), name="cube", materials=["white_paint"])
scenario = simgl.load_scenario("examples/approach.toml", models={"target": cube})
with simgl.Simulator(scenario) as simulator:
    state = scenario.at(scenario.epoch_tai_ns)
    capture = simulator.capture(state, "navcam", {simgl.Product.RADIANCE, simgl.Product.TRUTH})
assert capture.radiance is not None
assert capture.truth is not None
on_cube = capture.truth.instance == 1
r, g, b, n = capture.radiance.radiance[on_cube].mean(axis=0)
print(f"{on_cube.sum()} pixels, mean radiance {r:.2f} {g:.2f} {b:.2f} {n:.2f} W/(m2 sr)")
