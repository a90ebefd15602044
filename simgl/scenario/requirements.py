"""The table ``[requirements]``: what the images of a run must fulfil, as data.

A key names a quantity with its unit, and whether its value is the smallest or the largest allowed.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Literal

from msgspec import Meta

from simgl.config.value_types import Table
from simgl.errors import ConfigError


class When(StrEnum):
    """The epochs at which a requirement counts.

    ALWAYS : all of them
    IN_VIEW : those that show as much of the target as ``min_target_pixels`` of ``[assess]`` says
    SUNLIT : those of them at which at least half of the Sun's light reaches the target
    """

    ALWAYS = "always"
    IN_VIEW = "in_view"
    SUNLIT = "sunlit"


class LimitTable(Table, frozen=True, kw_only=True):
    """A limit with its conditions: ``{ limit = 10.0, share = 0.95, when = "sunlit" }``.

    limit : in the unit of the key
    share : of the epochs that count; so many must keep the limit
    when : which epochs count; default that of the key
    """

    limit: float
    share: Annotated[float, Meta(gt=0.0, le=1.0)] = 1.0
    when: Literal["always", "in_view", "sunlit"] | None = None


Limit = float | LimitTable | None


class RequirementsTable(Table, frozen=True, kw_only=True):
    """``[requirements]``: each key is a number, or a table of ``LimitTable``.

    docs/assessment.md says what each key limits. Those in ``KEYS`` with a column count at epochs,
    the others for the run as a whole.
    """

    min_target_size_px: Limit = None
    max_target_size_px: Limit = None
    min_target_pixels: Limit = None
    min_edge_distance_px: Limit = None
    max_saturated_share: Limit = None
    max_dark_share: Limit = None
    min_usable_share: Limit = None
    min_snr: Limit = None
    min_contrast: Limit = None
    min_range_m: Limit = None
    max_range_m: Limit = None
    min_phase_angle_deg: Limit = None
    max_phase_angle_deg: Limit = None
    min_sun_exclusion_deg: Limit = None
    min_earth_exclusion_deg: Limit = None
    min_beta_angle_deg: Limit = None
    max_beta_angle_deg: Limit = None
    min_sunlight_share: Limit = None
    min_good_share: Limit = None
    max_outage_s: Limit = None


@dataclass(frozen=True, kw_only=True)
class RequirementKey:
    """What a key of ``[requirements]`` limits.

    quantity : in words
    column : of the table of epochs; None for a quantity of the run
    unit : empty for shares and ratios
    allowed : range of the limit
    when : epochs that count unless the file says so
    """

    quantity: str
    column: str | None
    unit: str
    allowed: tuple[float, float]
    when: When = When.IN_VIEW


_ANY = (0.0, 1e18)
_SHARE = (0.0, 1.0)
_ANGLE = (0.0, 180.0)
KEYS = {
    "target_size_px": RequirementKey(
        quantity="longer side of the box around the target in the image",
        column="target_size_px", unit="px", allowed=_ANY, when=When.ALWAYS),
    "target_pixels": RequirementKey(
        quantity="pixels that show the target", column="target_pixels", unit="px", allowed=_ANY,
        when=When.ALWAYS),
    "edge_distance_px": RequirementKey(
        quantity="distance of the target from the edge of the image", column="edge_distance_px",
        unit="px", allowed=_ANY),
    "saturated_share": RequirementKey(
        quantity="saturated share of the target's pixels", column="saturated", unit="",
        allowed=_SHARE),
    "dark_share": RequirementKey(
        quantity="share of the target's pixels in the noise", column="dark", unit="",
        allowed=_SHARE),
    "usable_share": RequirementKey(
        quantity="share of the target's pixels neither saturated nor dark", column="usable",
        unit="", allowed=_SHARE),
    "snr": RequirementKey(
        quantity="median signal-to-noise ratio of the target's pixels", column="median_snr",
        unit="", allowed=_ANY),
    "contrast": RequirementKey(
        quantity="contrast of the target to what is behind it", column="contrast", unit="",
        allowed=_SHARE),
    "range_m": RequirementKey(
        quantity="range from the camera to the target's origin", column="range_m", unit="m",
        allowed=_ANY, when=When.ALWAYS),
    "phase_angle_deg": RequirementKey(
        quantity="phase angle Sun - target - camera", column="phase_angle_deg", unit="deg",
        allowed=_ANGLE),
    "sun_exclusion_deg": RequirementKey(
        quantity="angle from the boresight to the Sun, where the camera is not in full eclipse",
        column="sun_exclusion_deg", unit="deg", allowed=_ANGLE, when=When.ALWAYS),
    "earth_exclusion_deg": RequirementKey(
        quantity="angle from the Earth's limb out to the boresight", column="earth_limb_deg",
        unit="deg", allowed=(-90.0, 180.0), when=When.ALWAYS),
    "beta_angle_deg": RequirementKey(
        quantity="angle of the Sun over the target's orbit plane", column="beta_angle_deg",
        unit="deg", allowed=(-90.0, 90.0), when=When.ALWAYS),
    "sunlight_share": RequirementKey(
        quantity="share of the Sun's light that reaches the target", column="sunlight", unit="",
        allowed=_SHARE, when=When.ALWAYS),
    "good_share": RequirementKey(
        quantity="share of the epochs whose image is good", column=None, unit="", allowed=_SHARE,
        when=When.ALWAYS),
    "outage_s": RequirementKey(
        quantity="longest time without a good image", column=None, unit="s", allowed=_ANY,
        when=When.ALWAYS),
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Requirement:
    """One requirement.

    key : of ``[requirements]``, such as ``min_snr``
    limit : in the unit of the key
    share : of the epochs that count, which must keep the limit
    """

    key: str
    limit: float
    share: float
    when: When

    @property
    def is_minimum(self) -> bool:
        """Whether the limit is the smallest value allowed."""
        return self.key.startswith("min_")

    @property
    def of(self) -> RequirementKey:
        """What it limits."""
        return KEYS[self.key.partition("_")[2]]


def read_requirements(table: RequirementsTable, where: str) -> tuple[Requirement, ...]:
    """The requirements of a table, in its order; ConfigError for limits out of range."""
    read = []
    for key in table.__struct_fields__:
        given: Limit = getattr(table, key)
        if given is None:
            continue
        entry = given if isinstance(given, LimitTable) else LimitTable(limit=given)
        named = f"{key}.limit" if isinstance(given, LimitTable) else key
        limited = KEYS[key.partition("_")[2]]
        low, high = limited.allowed
        if not low <= entry.limit <= high:
            unit = f" {limited.unit}" if limited.unit else ""
            allowed = f"{low:g} or more" if high >= 1e18 else f"{low:g}..{high:g}{unit}"
            raise ConfigError(where, named, f"must be {allowed}, got {entry.limit:g}")
        if limited.column is None and (entry.share != 1.0 or entry.when is not None):
            raise ConfigError(where, key, "is of the run as a whole: write the number alone")
        read.append(
            Requirement(
                key=key,
                limit=entry.limit,
                share=entry.share,
                when=When(entry.when) if entry.when else limited.when,
            )
        )
    _check_order(read, where)
    return tuple(read)


def _check_order(requirements: list[Requirement], where: str) -> None:
    """A smallest value above the largest one can never be kept."""
    limits = {one.key: one.limit for one in requirements}
    for name in KEYS:
        low, high = limits.get(f"min_{name}"), limits.get(f"max_{name}")
        if low is not None and high is not None and low > high:
            problem = f"must not exceed max_{name} = {high:g}, got {low:g}"
            raise ConfigError(where, f"min_{name}", problem)
