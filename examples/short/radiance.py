"""Physical units: the mean radiance of each part of the target, red to near infrared."""

import simgl
from simgl import Product

scenario = simgl.load_scenario("examples/approach.toml")
with simgl.Simulator(scenario) as simulator:
    state = scenario.at(scenario.epoch_tai_ns)
    exposure = simulator.capture(state, "navcam", {Product.RADIANCE, Product.TRUTH})
assert exposure.radiance is not None
assert exposure.truth is not None
for number, part in exposure.truth.part_names.items():
    seen = exposure.radiance.radiance[exposure.truth.part_id == number]
    if len(seen):
        r, g, b, n = seen.mean(axis=0)
        print(f"{part:<32} {r:7.3f} {g:7.3f} {b:7.3f} {n:7.3f} W/(m2 sr)")
