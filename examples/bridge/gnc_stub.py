"""A GNC loop that steers by brightness: python -m examples.bridge.gnc_stub [ADDRESS].

`simgl serve "examples/bridge/box.toml"` first, in another terminal.
"""

import sys

import numpy as np
from simgl_bridge import BodyPose, Client, DelayLine

with Client(sys.argv[1] if sys.argv[1:] else "tcp://127.0.0.1:5563") as client:
    camera = client.welcome.cameras[0]
    position, velocity = np.array([1.0, 0.0, 60.0]), np.array([0.0, 0.0, -0.5])
    columns = np.arange(camera.width) + 0.5
    delay_line = DelayLine()
    for step in range(20):
        now = client.welcome.epoch_tai_ns + step * 1_000_000_000
        chaser = BodyPose(
            position_m=position, velocity_m_s=velocity, q_icrf_from_body_xyzw=(0, 0, 0, 1)
        )
        delay_line.post(client.render(now, camera.name, {"chaser": chaser}))
        for image in delay_line.due(now):
            light = np.where(image.dn > camera.pedestal_dn + 50, image.dn, 0).sum(axis=0)
            if light.any():
                off_axis = (light @ columns / light.sum() - camera.cx) / camera.focal_length_px
                velocity[0] += 0.2 * off_axis
                print(step, image.state_hash, f"{off_axis:+.5f}")
        position = position + velocity
