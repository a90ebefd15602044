"""Labels: box, pose and keypoints of the target in an image."""

import numpy as np

import simgl
from simgl import Product

scenario = simgl.load_scenario("examples/approach.toml")
with simgl.Simulator(scenario) as simulator:
    state = scenario.at(scenario.epoch_tai_ns)
    truth = simulator.capture(state, "navcam", {Product.TRUTH}).truth
assert truth is not None
rows, columns = np.nonzero(truth.instance == 1)
print(f"box      {columns.min()}..{columns.max()} x {rows.min()}..{rows.max()}")
body, camera = state.bodies["target"], state.cameras["navcam"]
R_camera_from_body = camera.R_camera_from_icrf @ body.pose.R_icrf_from_body
q = simgl.quaternion_from_matrix(R_camera_from_body)
print(f"pose     q_camera_from_body_xyzw {q.round(4)}")
origin = camera.R_camera_from_icrf @ (body.pose.position - camera.position)
for name, place in body.model.keypoints.items():
    x, y = camera.camera.project(origin + R_camera_from_body @ place)
    print(f"keypoint {name:<16} {x:7.2f} {y:7.2f}")
