"""The first image: load a scene, say when, capture, write it to a folder."""

from pathlib import Path

from simgl import Product, Simulator, load_scenario
from simgl.output import write_exposure
from simgl.physics.ephemeris import tai_ns_from_utc

scenario = load_scenario(Path(__file__).with_name("approach.toml"))
state = scenario.at(tai_ns_from_utc("2026-03-20T12:05:00"))
with Simulator(scenario) as simulator:
    exposure = simulator.capture(state, "navcam", {Product.DN, Product.RADIANCE})
for path in write_exposure(exposure, Path("out/first_image"), "navcam"):
    print(path)
