"""Camera images of spacecraft in low Earth orbit, in physical units.

The public interface: every name in ``__all__`` is documented in docs/python.md and may be imported
from here. A name is loaded from its module at first use, so ``import simgl`` itself takes
milliseconds. Units are SI, angles radians; R_a_from_b turns components in frame b into those in a.

To add a public name: one entry in ``_MODULES``, one import below ``TYPE_CHECKING`` for type
checkers, one entry on the page with an example.
"""

from __future__ import annotations

# Without the module typing, whose import takes as long as the interpreter's start.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from simgl.assess.emva1288 import camera_under_test as camera_under_test
    from simgl.assess.emva1288 import measure_camera as measure_camera
    from simgl.assess.target_background import tangent_heights as tangent_heights
    from simgl.assess.target_light import FrameAssessment as FrameAssessment
    from simgl.assess.target_light import assess_frame as assess_frame
    from simgl.assess.verdict import Verdict as Verdict
    from simgl.assess.verdict import verdict as verdict
    from simgl.camera.camera import Camera as Camera
    from simgl.camera.camera_equation import exposure_time as exposure_time
    from simgl.camera.camera_equation import exposure_value as exposure_value
    from simgl.camera.detector import Detector as Detector
    from simgl.camera.lens import Lens as Lens
    from simgl.display_images import contact_sheet as contact_sheet
    from simgl.display_images import display_from_dn as display_from_dn
    from simgl.display_images import display_from_radiance as display_from_radiance
    from simgl.display_images import display_gain as display_gain
    from simgl.errors import AssetError as AssetError
    from simgl.errors import BridgeError as BridgeError
    from simgl.errors import ConfigError as ConfigError
    from simgl.errors import ContextError as ContextError
    from simgl.errors import OutputError as OutputError
    from simgl.errors import ShaderError as ShaderError
    from simgl.errors import SimglError as SimglError
    from simgl.gpu.context import open_context as open_context
    from simgl.images import display_from_layers as display_from_layers
    from simgl.model_files.model_from_mesh import model_from_mesh as model_from_mesh
    from simgl.model_files.model_library import load_model as load_model
    from simgl.model_files.model_library import shipped_models as shipped_models
    from simgl.model_files.surface_tables import load_finish as load_finish
    from simgl.model_files.surface_tables import shipped_finishes as shipped_finishes
    from simgl.output import write_capture as write_capture
    from simgl.physics.ephemeris import tai_ns_from_utc as tai_ns_from_utc
    from simgl.physics.ephemeris import utc_from_tai_ns as utc_from_tai_ns
    from simgl.physics.frames import Pose as Pose
    from simgl.physics.frames import lvlh_from_icrf as lvlh_from_icrf
    from simgl.physics.frames import matrix_from_quaternion as matrix_from_quaternion
    from simgl.physics.frames import quaternion_from_matrix as quaternion_from_matrix
    from simgl.scenario.loader import load_scenario as load_scenario
    from simgl.scenario.loader import scenario_from_dict as scenario_from_dict
    from simgl.scenario.scenario import Scenario as Scenario
    from simgl.scene.materials import Material as Material
    from simgl.scene.spacecraft import SpacecraftModel as SpacecraftModel
    from simgl.scene.state import SceneState as SceneState
    from simgl.sequence.epoch_options import Event as Event
    from simgl.sequence.epochs import event_epochs as event_epochs
    from simgl.simulator import ALL_PRODUCTS as ALL_PRODUCTS
    from simgl.simulator import Capture as Capture
    from simgl.simulator import Product as Product
    from simgl.simulator import Simulator as Simulator

    __version__: str

# Public names by the module that defines them.
_MODULES = {
    "assess.emva1288": "camera_under_test measure_camera",
    "assess.target_background": "tangent_heights",
    "assess.target_light": "FrameAssessment assess_frame",
    "assess.verdict": "Verdict verdict",
    "camera.camera": "Camera",
    "camera.detector": "Detector",
    "camera.camera_equation": "exposure_time exposure_value",
    "camera.lens": "Lens",
    "errors": "AssetError BridgeError ConfigError ContextError OutputError ShaderError SimglError",
    "gpu.context": "open_context",
    "display_images": "contact_sheet display_from_dn display_from_radiance display_gain",
    "images": "display_from_layers",
    "model_files.model_from_mesh": "model_from_mesh",
    "model_files.model_library": "load_model shipped_models",
    "model_files.surface_tables": "load_finish shipped_finishes",
    "output": "write_capture",
    "physics.ephemeris": "tai_ns_from_utc utc_from_tai_ns",
    "physics.frames": "Pose lvlh_from_icrf matrix_from_quaternion quaternion_from_matrix",
    "scenario.loader": "load_scenario scenario_from_dict",
    "scenario.scenario": "Scenario",
    "scene.materials": "Material",
    "scene.spacecraft": "SpacecraftModel",
    "scene.state": "SceneState",
    "sequence.epochs": "event_epochs",
    "sequence.epoch_options": "Event",
    "simulator": "ALL_PRODUCTS Capture Product Simulator",
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names.split()}

__all__ = sorted([*_MODULE_OF, "__version__"])


def __getattr__(name: str) -> Any:
    """Load a public name from its module (PEP 562) and keep it."""
    if name == "__version__":
        from importlib.metadata import PackageNotFoundError, version

        try:
            value: Any = version("simgl")
        except PackageNotFoundError:
            value = "0+checkout"
    elif name in _MODULE_OF:
        from importlib import import_module

        value = getattr(import_module(f"simgl.{_MODULE_OF[name]}"), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
