"""An exposure sweep: what each time, as an exposure value, does to the target's pixels."""

import simgl
from simgl.assess.target_light import assess_frame
from simgl.assess.trajectory_assessment import PRODUCTS
from simgl.camera.camera_equation import exposure_time, exposure_value

scenario = simgl.load_scenario("examples/approach.toml")
f_number = scenario.cameras["navcam"].lens.f_number
given = exposure_value(f_number, scenario.cameras["navcam"].exposure_time)
with simgl.Simulator(scenario) as simulator:
    for stops in (-4, -2, 0, 2, 4):
        times = {"navcam": exposure_time(given + stops, f_number)}
        poses = scenario.poses(scenario.epoch_tai_ns)
        state = scenario.with_poses(scenario.epoch_tai_ns, poses, exposure_times=times)
        found = assess_frame(simulator.capture(state, "navcam", PRODUCTS), state, "target")
        print(
            f"EV {given + stops:5.2f}  {1e6 * times['navcam']:7.1f} us  "
            f"saturated {found.saturated:6.1%}  dark {found.dark:6.1%}  usable {found.usable:6.1%}"
        )
