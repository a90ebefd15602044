"""Physical units: the mean radiance of each part of the target, red to near infrared."""

import simgl
from simgl import Product

scenario = simgl.load_scenario("examples/approach.toml")
with simgl.Simulator(scenario) as simulator:
    state = scenario.at(scenario.epoch_tai_ns)
    capture = simulator.capture(state, "navcam", {Product.RADIANCE, Product.TRUTH})
assert capture.radiance is not None
assert capture.truth is not None
for number, part in capture.truth.part_names.items():
    pixels = capture.radiance.radiance[capture.truth.part_id == number]
    if len(pixels):
        r, g, b, n = pixels.mean(axis=0)
        print(f"{part:<32} {r:7.3f} {g:7.3f} {b:7.3f} {n:7.3f} W/(m2 sr)")
