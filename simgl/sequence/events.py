"""Names of what may begin along a trajectory."""

from __future__ import annotations

from enum import StrEnum


class Event(StrEnum):
    """What may begin along a trajectory.

    ECLIPSE_ENTRY : the Earth or its air takes the first hundredth of the target's sunlight
    UMBRA_ENTRY : the last hundredth is gone
    UMBRA_EXIT, ECLIPSE_EXIT : they come back
    SUN_IN_VIEW : the Sun's disc comes into the picture
    LIMB_BEHIND_TARGET : the Earth's limb comes behind the target, as the camera sees it
    """

    ECLIPSE_ENTRY = "eclipse_entry"
    UMBRA_ENTRY = "umbra_entry"
    UMBRA_EXIT = "umbra_exit"
    ECLIPSE_EXIT = "eclipse_exit"
    SUN_IN_VIEW = "sun_in_view"
    LIMB_BEHIND_TARGET = "limb_behind_target"
