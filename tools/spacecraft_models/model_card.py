"""Writes the text file that stands beside a model: axes, joints and keypoints."""

import json
from collections.abc import Iterable

import numpy as np

from tools.spacecraft_models.generated_model import GeneratedModel, Joint


def _numbers(values: Iterable[float]) -> str:
    return "[" + ", ".join(repr(round(float(v), 6) + 0.0) for v in values) + "]"


def _joint(joint: Joint) -> list[str]:
    lines = [
        "",
        "[[joint]]",
        f'name = "{joint.name}"',
        f'part = "{joint.part}"',
        f'kind = "{"prismatic" if joint.slides else "revolute"}"',
        f"axis_body = {_numbers(joint.axis_body)}",
    ]
    if joint.slides:
        lines.append(f"range_m = {_numbers(joint.angles)}  # 0 = as stored in the file")
    else:
        lines += [
            f"origin_body_m = {_numbers(joint.origin_body)}",
            f"range_deg = {_numbers(np.degrees(joint.angles))}  # 0 = as stored in the file",
        ]
    if joint.keypoints:
        lines.append(f"keypoints = {json.dumps(joint.keypoints)}")
    if joint.sunward_body is not None:
        lines.append(f"sunward_body = {_numbers(joint.sunward_body)}")
    return lines


def record_text(model: GeneratedModel) -> str:
    """The model.toml of a model."""
    # JSON strings of plain text are TOML basic strings.
    lines = [
        f'name = "{model.name}"',
        f'file = "{model.name}.glb"',
        f"description = {json.dumps(model.description)}",
        f"source = {json.dumps(model.source)}",
        "unit_m = 1.0",
        "",
        "[axes]  # body axis = axis of the file; body: x forward, y starboard, z down",
        'x = "+z"',
        'y = "-x"',
        'z = "-y"',
    ]
    for joint in model.joints:
        lines += _joint(joint)
    lines += ["", "[keypoints]  # body frame, metres"]
    lines += [f"{name} = {_numbers(point)}" for name, point in model.keypoints.items()]
    return "\n".join(lines) + "\n"
