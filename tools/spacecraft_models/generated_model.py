"""What a generator returns: parts, joints and keypoints of one spacecraft, in body axes.

Body axes: x forward, y starboard (right), z down. Metres, radians.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from scipy.spatial.transform import Rotation

from tools.spacecraft_models.shapes import Shape

Vec3 = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class Joint:
    """A hinge of one part, or a rail, with all that the part carries.

    axis_body : unit; origin_body : a point on the hinge line [m]
    angles : least and greatest angle from the stored position, right-handed [rad], or travel [m]
    keypoints : names of those that move with the part
    sunward_body : the side that a drive turns to the Sun, as stored; None where there is none
    """

    name: str
    part: str
    axis_body: Vec3
    origin_body: Vec3
    angles: tuple[float, float]
    keypoints: tuple[str, ...] = ()
    sunward_body: Vec3 | None = None
    slides: bool = False


@dataclass(frozen=True, kw_only=True)
class Part:
    """A named rigid piece of the craft.

    shapes : in the part's own frame [m]
    origin_body : where the part's origin lies in the body frame [m]
    R_body_from_part : how the part's frame is turned in the stored position
    parent : the part that carries it, listed before it; None for the body
    """

    name: str
    shapes: tuple[Shape, ...]
    origin_body: Vec3 = (0.0, 0.0, 0.0)
    R_body_from_part: Rotation = field(default_factory=Rotation.identity)
    parent: str | None = None


def _port(name: str) -> str:
    assert name.endswith("_right"), name
    return name.removesuffix("right") + "left"


def _mirrored(point: Vec3) -> Vec3:
    # Taken from zero: a negated zero would stand in a file as -0.0.
    return point[0], 0.0 - point[1], point[2]


def both_sides(part: Part, joint: Joint) -> tuple[list[Part], list[Joint]]:
    """A starboard part on its joint, and before it the mirror image of both to port.

    All names end with "_right", those of the mirror image with "_left".
    """
    # A turn's mirror image is the opposite turn about the axis' mirror image.
    quaternion = part.R_body_from_part.as_quat() * [-1.0, 1.0, -1.0, 1.0]
    x, y, z = joint.axis_body
    port_part = replace(
        part,
        name=_port(part.name),
        shapes=tuple(shape.mirrored() for shape in part.shapes),
        origin_body=_mirrored(part.origin_body),
        R_body_from_part=Rotation.from_quat(quaternion),
    )
    port_joint = replace(
        joint,
        name=_port(joint.name),
        part=port_part.name,
        axis_body=(0.0 - x, y, 0.0 - z),
        origin_body=_mirrored(joint.origin_body),
        keypoints=tuple(_port(name) for name in joint.keypoints),
        sunward_body=None if joint.sunward_body is None else _mirrored(joint.sunward_body),
    )
    return [port_part, part], [port_joint, joint]


@dataclass(frozen=True, kw_only=True)
class GeneratedModel:
    """A spacecraft: the text that goes with it, its parts and the points worth naming.

    keypoints : name to position in the body frame [m]
    """

    name: str
    description: str
    source: str
    parts: tuple[Part, ...]
    joints: tuple[Joint, ...]
    keypoints: Mapping[str, Vec3]
