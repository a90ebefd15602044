"""Schema of a campaign file: every table, key, unit and limit."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, field

from simgl.config.value_types import Table

# Of one campaign.
MAX_FRAMES = 10_000_000


class DrawnTable(Table, frozen=True, kw_only=True):
    """Distribution of a value; exactly one of these.

    uniform, log_uniform : between two limits
    normal : mean and standard deviation
    choice : one of these, equally likely
    """

    uniform: tuple[float, float] | None = None
    log_uniform: tuple[float, float] | None = None
    normal: tuple[float, float] | None = None
    choice: Annotated[tuple[float, ...], Meta(min_length=1, max_length=100_000)] | None = None


# A number is the same in every frame.
Drawn = float | DrawnTable


class DrawTable(Table, frozen=True, kw_only=True):
    """``[draw]``: values that differ from frame to frame; all else is as in the scenario.

    epoch_offset_s : from the scenario's epoch
    range_m : of the camera from the origin of the target's body
    direction : "sphere", to the camera anywhere about the target; or ``azimuth_deg`` and
        ``elevation_deg`` in the target's LVLH axes, as of a camera ``about`` it; or
        ``phase_angle_deg`` between the directions to the Sun and to the camera
    attitude : of the target: "uniform" over all rotations; or ``attitude_error_deg``, a rotation
        by that angle about a random axis
    roll_deg : of the camera about its boresight
    offset_x, offset_y : of the target's origin from the middle of the image, in halves of its width
        and height; lens distortion is not considered
    target_rate_deg_s, camera_rate_deg_s : about random axes while the shutter is open
    relative_speed_m_s : of the camera past the target, in a random direction, likewise
    exposure_time_s, f_number : of the camera
    joints_deg, joints_m : of the target's hinges and sliders, by name
    lamp_power : factor on the power of lamps, by name
    """

    epoch_offset_s: Drawn | None = None
    range_m: Drawn | None = None
    direction: Literal["sphere"] | None = None
    azimuth_deg: Drawn | None = None
    elevation_deg: Drawn | None = None
    phase_angle_deg: Drawn | None = None
    attitude: Literal["uniform"] | None = None
    attitude_error_deg: Drawn | None = None
    roll_deg: Drawn | None = None
    offset_x: Drawn | None = None
    offset_y: Drawn | None = None
    target_rate_deg_s: Drawn | None = None
    camera_rate_deg_s: Drawn | None = None
    relative_speed_m_s: Drawn | None = None
    exposure_time_s: Drawn | None = None
    f_number: Drawn | None = None
    joints_deg: dict[str, Drawn] = field(default_factory=dict)
    joints_m: dict[str, Drawn] = field(default_factory=dict)
    lamp_power: dict[str, Drawn] = field(default_factory=dict)


class CampaignTable(Table, frozen=True, kw_only=True):
    """A campaign file.

    scenario : path, from the campaign file's folder
    frames : how many
    seed : of all random values, and of the noise
    camera, target : if omitted the scenario's first ones
    write : files of each frame; labels name the first kind, which is an image
    """

    scenario: str
    frames: Annotated[int, Meta(ge=1, le=MAX_FRAMES)]
    seed: Annotated[int, Meta(ge=0, le=2**32 - 1)] = 0
    camera: str | None = None
    target: str | None = None
    write: tuple[Literal["dn8", "dn16", "view", "exr", "truth"], ...] = ("dn8",)
    draw: DrawTable = field(default_factory=DrawTable)
