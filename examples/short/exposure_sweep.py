"""An exposure sweep: saturated, dark and usable pixels of the target by exposure value."""

import simgl
from simgl import Product

PRODUCTS = {Product.DN, Product.ELECTRONS, Product.RADIANCE, Product.TRUTH}
scenario = simgl.load_scenario("examples/approach.toml")
f_number = scenario.cameras["navcam"].lens.f_number
given = simgl.exposure_value(f_number, scenario.cameras["navcam"].exposure_time)
with simgl.Simulator(scenario) as simulator:
    for stops in (-4, -2, 0, 2, 4):
        times = {"navcam": simgl.exposure_time(given + stops, f_number)}
        poses = scenario.poses(scenario.epoch_tai_ns)
        state = scenario.with_poses(scenario.epoch_tai_ns, poses, exposure_times=times)
        capture = simulator.capture(state, "navcam", PRODUCTS)
        target = simgl.assess_frame(capture, state, "target")
        print(
            f"EV {given + stops:5.2f}  {1e6 * times['navcam']:7.1f} us  "
            f"saturated {target.saturated:6.1%}  dark {target.dark:6.1%}  "
            f"usable {target.usable:6.1%}"
        )
