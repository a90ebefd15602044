"""A closed loop: the chaser steers by what its camera sees of the target, and stops at 30 m."""

from pathlib import Path

import numpy as np
from PIL import Image
from simgl_bridge import BodyPose, Client, launched_server

from simgl import contact_sheet, display_from_dn, load_scenario, lvlh_from_icrf
from simgl import quaternion_from_matrix as quaternion

PATH = Path(__file__).with_name("scenario.toml")
STEP_S, SPEED_M_S, STOP_M = 2.0, 2.0, 30.0
scenario = load_scenario(PATH)
position_lvlh = np.array([-60.0, 4.0, -3.0])  # of the chaser [m]: 4 m beside the axis and 3 m above
seen: dict[str, np.ndarray] = {}
with launched_server(PATH) as (_, address), Client(address, timeout_s=60.0) as client:
    camera = next(c for c in client.welcome.cameras if c.name == "navcam")
    while (range_m := np.linalg.norm(position_lvlh)) > STOP_M:
        # The truth: the target flies on its orbit, the chaser keeps the attitude of its LVLH axes.
        tai_ns = scenario.epoch_tai_ns + round(len(seen) * STEP_S * 1e9)
        target = scenario.at(tai_ns).bodies["target"].pose
        R_icrf_from_lvlh = lvlh_from_icrf(target.position, target.velocity).T
        chaser = BodyPose(
            position_m=target.position + R_icrf_from_lvlh @ position_lvlh,
            velocity_m_s=target.velocity,
            q_icrf_from_body_xyzw=quaternion(R_icrf_from_lvlh),
        )
        # The sensor: exactly this state is rendered, and the loop waits for it.
        dn = client.render(tai_ns, "navcam", {"chaser": chaser}).dn
        # Navigation: the centre of the light above the noise, as angles to the right and down.
        light = np.maximum(dn - (camera.pedestal_dn + 100.0), 0.0)
        rows, columns = np.indices(dn.shape) + 0.5
        right = (np.average(columns, weights=light) - camera.cx) / camera.focal_length_px
        down = (np.average(rows, weights=light) - camera.cy) / camera.focal_length_px
        # Control: half of the error in each step; image right and down are LVLH y and z.
        velocity = np.array([SPEED_M_S, 0.25 * range_m * right, 0.25 * range_m * down])
        position_lvlh = position_lvlh + velocity * STEP_S
        print(f"range {range_m:5.1f} m  off axis {right:+.4f} {down:+.4f} rad")
        seen[f"{range_m:.0f} m"] = display_from_dn(dn, scenario.cameras["navcam"])
Image.fromarray(contact_sheet(seen, columns=4)).save("loop.png")
print(f"{len(seen)} images in loop.png")
