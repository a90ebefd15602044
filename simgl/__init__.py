"""Camera images of spacecraft in low Earth orbit, in physical units."""

from importlib.metadata import PackageNotFoundError, version

from simgl.errors import SimglError
from simgl.scenario.loader import load_scenario, scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.simulator import ALL_PRODUCTS, Capture, Product, Simulator

try:
    __version__ = version("simgl")
except PackageNotFoundError:
    __version__ = "0+checkout"

__all__ = [
    "ALL_PRODUCTS",
    "Capture",
    "Product",
    "Scenario",
    "SimglError",
    "Simulator",
    "__version__",
    "load_scenario",
    "scenario_from_dict",
]
