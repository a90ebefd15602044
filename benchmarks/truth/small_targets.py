"""Light of bodies of any size in the image."""

from __future__ import annotations

import moderngl
import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.truth.rows import Row, Table, relative, worst
from simgl.simulator import Simulator
from tests.radiometry.far_bodies import (
    BOX,
    FOCAL_PX,
    SPHERE,
    at,
    box_light,
    centre_of_light,
    facet_light,
    light,
    place,
    sphere_light,
    view,
)

_GOAL, _CENTRE_GOAL = 0.01, 0.02
_PLACES = ((0.5, 0.5), (0.29, -0.27))
_TURN = Rotation.from_euler("yx", [25.0, -20.0], degrees=True)
_SMALL, _LARGE = (0.01, 0.036, 0.36, 0.9, 1.6, 3.6, 10.0, 36.0), (100.0, 300.0, 1000.0)
_IMAGE = 1792


def _image_size(size_px: float) -> int:
    return 64 if size_px <= _SMALL[-1] else _IMAGE


def _of_size(simulator: Simulator, size_px: float, phase_deg: float, kind: str) -> list[Row]:
    """Light and place of the centre, over places and samplings."""
    rows, pixels, phase = [], _image_size(size_px), float(np.radians(phase_deg))
    distance = FOCAL_PX / size_px
    for x, y in _PLACES:
        centre = place(x, y, distance)
        if kind == "sphere":
            its_light = sphere_light if size_px <= _SMALL[-1] else facet_light
            (flux, middle), body = its_light(centre, phase), at(SPHERE, x, y, distance)
        else:
            (flux, middle), body = box_light(centre, _TURN, phase), at(BOX, x, y, distance)
            body |= {"quaternion_icrf_from_body_xyzw": _TURN.as_quat().tolist()}
        scenario = view({"body": body}, phase, size=pixels)
        for samples in (5, 64, None) if pixels == 64 else (5, 16, None):
            image = light(simulator, scenario, samples)
            case = f"{kind} of {size_px:g} px, phase angle {phase_deg:g} deg, "
            case += "samples by cost" if samples is None else f"{samples} samples per pixel"
            rows.append(relative(f"light, {case}", flux, float(image.sum()), _GOAL))
            off = float(np.hypot(*(centre_of_light(image) - middle)))
            rows.append(
                Row(
                    case=f"centre, {case}",
                    truth=0.0,
                    simgl=off,
                    error=off,
                    goal=_CENTRE_GOAL,
                )
            )
    return rows


def table(gl: moderngl.Context) -> Table:
    """The worst sampling and place of each size and phase angle."""
    rows: list[Row] = []
    for sizes in (_SMALL, _LARGE):
        first = view({"body": at(SPHERE, 0.0, 0.0, 100.0)}, size=_image_size(sizes[0]))
        with Simulator(first, gl) as simulator:
            for kind, phases in (("sphere", (0.0, 60.0, 120.0, 150.0)), ("box", (0.0, 60.0))):
                for phase in phases:
                    for size_px in sizes:
                        shown = _of_size(simulator, size_px, phase, kind)
                        rows += [worst(shown[::2]), worst(shown[1::2])]
    return Table(
        title="Bodies of 0.01 to 1000 pixels",
        reference="closed form of the Lambertian sphere and box at their distance, from 100 px on "
        "quadrature over the sphere's mesh; the worst of three samplings and two places",
        quantity="sum of the radiance [W m-2 sr-1 px2]; distance of the centre of light [px]",
        error="relative; of the centre in pixels",
        rows=rows,
    )
