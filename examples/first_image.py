"""The first image: load a scene, choose the time, capture, write it to a folder."""

from pathlib import Path

from simgl import Product, Simulator, load_scenario, tai_ns_from_utc, write_capture

scenario = load_scenario(Path(__file__).with_name("approach.toml"))
state = scenario.at(tai_ns_from_utc("2026-03-20T12:05:00"))
with Simulator(scenario) as simulator:
    capture = simulator.capture(state, "navcam", {Product.DN, Product.RADIANCE})
for path in write_capture(capture, Path("out/first_image"), "navcam"):
    print(path)
