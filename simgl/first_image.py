"""What the first image of a scenario waits for, made before it: tables, maps, light, shaders."""

from __future__ import annotations

from functools import partial

from simgl.errors import SimglError
from simgl.progress import ProgressCallback
from simgl.renderer import Renderer
from simgl.scenario.scenario import Scenario
from simgl.view.frame_view import FrameView, frame_view


def prepare_first_image(
    renderer: Renderer, scenario: Scenario, progress: ProgressCallback | None
) -> None:
    """Make what no frame should wait for.

    Where light between surfaces is to be traced, one core would be left alone with it in the end:
    an image that nobody sees is drawn meanwhile, so that the shaders of the first one are compiled.
    """
    models = scenario.models_at_epoch() if scenario.inter_reflection else ()
    unseen = partial(_draw_unseen, renderer, scenario)
    renderer.prepare(models, scenario.earth, scenario.joint_light, progress, unseen)


def _draw_unseen(renderer: Renderer, scenario: Scenario) -> None:
    view = _first_view(renderer, scenario)
    if view is not None:
        renderer.radiance(view)


def _first_view(renderer: Renderer, scenario: Scenario) -> FrameView | None:
    """What the first camera for visible light sees at the epoch, without what rays find."""
    visible = (name for name, camera in scenario.cameras.items() if camera.thermal is None)
    camera = next(visible, None)
    if camera is None:
        return None
    try:
        return frame_view(
            scenario.at(scenario.epoch_tai_ns),
            camera,
            sample_budget=renderer.sample_budget,
            samples_per_pixel=scenario.samples_per_pixel,
            inter_reflection=False,
        )
    except SimglError:
        # Whoever asks for that image is told.
        return None
