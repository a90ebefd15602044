"""A client of the image service: it sends a pose and receives the image of that pose."""

import numpy as np
from simgl_bridge import BodyPose, Client, launched_server

with (
    launched_server("examples/approach.toml") as (_, address),
    Client(address, timeout_s=60.0) as client,
):
    now = client.welcome.epoch_tai_ns
    target = BodyPose(
        position_m=np.array([6.778e6, 0.0, 0.0]),
        velocity_m_s=np.array([0.0, 7668.0, 0.0]),
        q_icrf_from_body_xyzw=(0, 0, 0, 1),
    )
    image = client.render(now, "navcam", {"target": target})
    print(f"{image.dn.shape[1]} x {image.dn.shape[0]}, DN {image.dn.min()} to {image.dn.max()}")
    print(f"state {image.state_hash}")
