"""A contact sheet of a model from eight sides, the Sun over the camera's shoulder."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np

from simgl.arrays import Array, Image8
from simgl.display_images import contact_sheet, display_from_radiance, png_bytes
from simgl.model_files.model_library import load_model
from simgl.output import complete_file
from simgl.physics.frames import unit
from simgl.scenario.loader import scenario_from_dict
from simgl.scene.mesh import Mesh
from simgl.scene.state import SunInDirection
from simgl.simulator import Product, Simulator

# Direction from the model to the camera, and up in the image; body axes (x forward, y starboard,
# z down).
_UP, _FORWARD = (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)
VIEWS = {
    "from ahead (+x)": ((1.0, 0.0, -0.15), _UP),
    "ahead, right, above": ((1.0, 1.0, -0.8), _UP),
    "from the right (+y)": ((0.0, 1.0, -0.15), _UP),
    "from behind (-x)": ((-1.0, 0.0, -0.15), _UP),
    "behind, left, below": ((-1.0, -1.0, 0.8), _UP),
    "from the left (-y)": ((0.0, -1.0, -0.15), _UP),
    "from above (-z)": ((0.0, 0.0, -1.0), _FORWARD),
    "from below (+z)": ((0.0, 0.0, 1.0), _FORWARD),
}

# In radii of the model's bounding sphere.
_RANGE = 5.0
# Share of the image's half width or height that the model fills from its largest side.
_FILLED = 0.94


def _right_and_above(side: Array, up: Any) -> Array:
    """(2, 3) unit directions of right and up in the image of a camera at a side."""
    right = unit(np.cross(up, side))
    return np.stack([right, np.cross(side, right)])


def _sun_direction(side: Array, up: Any) -> Array:
    """(3,) over the right shoulder of a camera at a side, at a phase angle of 45 deg.

    For a camera below the model, the Sun is below as well, so that lower faces are lit.
    """
    right, above = _right_and_above(side, up)
    lean = -0.8 if side[2] > 0.0 else 0.8
    return unit(side + lean * above + 0.6 * right)


def _half_angles(mesh: Mesh) -> Array:
    """(2,) tangents of the largest angles off the boresight, across and up, over all views."""
    offsets = mesh.hull - mesh.centre
    tangents = []
    for side, up in VIEWS.values():
        towards = unit(side)
        distance = _RANGE * mesh.radius - offsets @ towards
        across = np.abs(offsets @ _right_and_above(towards, up).T)
        tangents.append((across / distance[:, None]).max(axis=0))
    return np.max(tangents, axis=0)


def turntable(
    name: str,
    unit_m: float | None = None,
    size: tuple[int, int] = (320, 240),
    ctx: moderngl.Context | None = None,
    *,
    up_axis: str | None = None,
    forward_axis: str | None = None,
) -> Image8:
    """(rows, columns, 3) the sheet, four views per row.

    name, unit_m, up_axis, forward_axis : as `load_model` takes them
    size : width and height of a view [px]

    Interreflection is off: tracing it would take longer than the views.
    """
    mesh = load_model(name, unit_m=unit_m, up_axis=up_axis, forward_axis=forward_axis).mesh
    width, height = size
    pitch_um = 4.0
    half_sizes_mm = 0.5e-3 * pitch_um * np.array([width, height])
    lens = {
        "preset": "ideal",
        "width_px": width,
        "height_px": height,
        "pixel_pitch_um": pitch_um,
        "focal_length_mm": float(_FILLED * np.min(half_sizes_mm / _half_angles(mesh))),
    }
    spacecraft: dict[str, Any] = {"model": name, "position_icrf_m": [0.0, 0.0, 0.0]}
    file_frame = {"unit_m": unit_m, "up_axis": up_axis, "forward_axis": forward_axis}
    spacecraft |= {key: value for key, value in file_frame.items() if value is not None}
    cameras = {}
    for number, (side, up) in enumerate(VIEWS.values()):
        place = mesh.centre + _RANGE * mesh.radius * unit(side)
        pose = {"position_icrf_m": place, "boresight": -unit(side), "up": up}
        cameras[f"view_{number}"] = lens | pose
    scenario = scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "sun": {"direction_icrf": [1.0, 0.0, 0.0]},
            "earth": {"shape": "none"},
            "spacecraft": {"model": spacecraft},
            "camera": cameras,
            "render": {"inter_reflection": False, "samples_per_pixel": 16},
        },
        name="turntable",
    )
    state = scenario.at(scenario.epoch_tai_ns)
    assert isinstance(state.sun, SunInDirection)
    panels = {}
    with Simulator(scenario, ctx) as simulator:
        for camera, (title, (side, up)) in zip(cameras, VIEWS.items(), strict=True):
            lit = replace(state.sun, direction_icrf=_sun_direction(unit(side), up))
            capture = simulator.capture(replace(state, sun=lit), camera, {Product.RADIANCE})
            assert capture.radiance is not None
            panels[title] = display_from_radiance(capture.radiance.radiance)
    return contact_sheet(panels, columns=4)


def write_turntable(
    name: str,
    out: Path,
    unit_m: float | None = None,
    up_axis: str | None = None,
    forward_axis: str | None = None,
) -> Path:
    """Writes the sheet as `out`/NAME.turntable.png and returns that path."""
    sheet = turntable(name, unit_m, up_axis=up_axis, forward_axis=forward_axis)
    path = out / f"{Path(name).stem}.turntable.png"
    with complete_file(path) as temporary:
        temporary.write_bytes(png_bytes(sheet))
    return path
