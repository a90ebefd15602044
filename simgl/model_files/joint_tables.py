"""The ``[[joint]]`` tables of a model card: the parts that each joint moves, and its parent."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from simgl.config.validation import shown
from simgl.config.value_types import Table, Vector, direction
from simgl.errors import ConfigError, did_you_mean
from simgl.motion.joints import Joint
from simgl.scene.spacecraft import Branch, SpacecraftModel


class JointTable(Table, frozen=True, kw_only=True):
    """How a part can move; 0 is the position stored in the file.

    part : a node of the file, which moves with all that hangs under it
    kind : "revolute" turns about a line, with ``origin_body_m`` and ``range_deg``; "prismatic"
        slides along its axis, with ``range_m``
    parent : the joint that it sits on, where the file's nodes do not say
    keypoints : those that move with the part
    sunward_body : the side that a drive turns to the Sun, as stored
    """

    name: str
    part: str
    kind: Literal["revolute", "prismatic"]
    axis_body: Vector
    origin_body_m: Vector | None = None
    range_deg: tuple[float, float] | None = None
    range_m: tuple[float, float] | None = None
    parent: str | None = None
    keypoints: tuple[str, ...] = ()
    sunward_body: Vector | None = None


@dataclass(frozen=True, kw_only=True)
class _Place:
    """Where a joint sits in the file: the number of its branch, and the parts on that."""

    branch: int
    parts: frozenset[int]

    def under(self, other: _Place) -> bool:
        """Branches come after those that they hang under."""
        return other.branch < self.branch and other.parts >= self.parts


def read_joints(
    tables: Sequence[JointTable],
    model: SpacecraftModel,
    keypoints: Collection[str],
    where: str,
) -> tuple[Joint, ...]:
    """The joints of a model; raises ConfigError with one line.

    model : without joints
    """
    _check_names(tables, keypoints, where)
    places = [_place(table, model.branches, where) for table in tables]
    parents = [_parent(index, tables, places, where) for index in range(len(tables))]
    _check_ends(tables, parents, where)
    parts = _parts(tables, places, parents, len(model.parts), where)
    return tuple(
        _joint(table, parent, moved, where)
        for table, parent, moved in zip(tables, parents, parts, strict=True)
    )


def _check_names(tables: Sequence[JointTable], keypoints: Collection[str], where: str) -> None:
    owners: dict[str, str] = {}
    for index, table in enumerate(tables):
        key = f"joint {table.name}"
        if any(other.name == table.name for other in tables[:index]):
            raise ConfigError(where, key, "is defined twice")
        for name in table.keypoints:
            if name not in keypoints:
                raise ConfigError(where, key, f"names no keypoint: {did_you_mean(name, keypoints)}")
            if name in owners:
                problem = f"moves keypoint {shown(name)}, as joint {shown(owners[name])} does"
                raise ConfigError(where, key, problem)
            owners[name] = table.name


def _place(table: JointTable, branches: Sequence[Branch], where: str) -> _Place:
    matches = [i for i, branch in enumerate(branches) if branch.name == table.part]
    key = f"joint {table.name}"
    if not matches:
        problem = f"names no part: {did_you_mean(table.part, {b.name for b in branches})}"
        raise ConfigError(where, key, problem)
    if len(matches) > 1:
        problem = f"names part {shown(table.part)}, of which the file has {len(matches)}"
        raise ConfigError(where, key, problem)
    return _Place(branch=matches[0], parts=frozenset(branches[matches[0]].parts))


def _above(place: _Place, places: Sequence[_Place]) -> list[int]:
    """The joints on the nearest branch that a place hangs under."""
    nearest = max((other.branch for other in places if place.under(other)), default=-1)
    return [index for index, other in enumerate(places) if other.branch == nearest]


def _last(group: Sequence[int], tables: Sequence[JointTable]) -> int:
    """Of joints on one branch the one that none of the others names as its parent."""
    named = {tables[index].parent for index in group}
    return next((index for index in group if tables[index].name not in named), group[0])


def _parent(
    index: int, tables: Sequence[JointTable], places: Sequence[_Place], where: str
) -> int | None:
    names = [table.name for table in tables]
    given = tables[index].parent
    if given is None:
        above = _above(places[index], places)
        return _last(above, tables) if above else None
    if given not in names:
        problem = f"has a parent that is not a joint: {did_you_mean(given, names)}"
        raise ConfigError(where, f"joint {tables[index].name}", problem)
    return names.index(given)


def _check_ends(tables: Sequence[JointTable], parents: Sequence[int | None], where: str) -> None:
    """Raise ConfigError where joints sit on each other in a circle."""
    for start, parent in enumerate(parents):
        passed = [start]
        while parent is not None and parent not in passed:
            passed.append(parent)
            parent = parents[parent]
        if parent == start:
            circle = " on ".join(tables[index].name for index in (*passed, start))
            raise ConfigError(where, f"joint {tables[start].name}", f"carries itself: {circle}")


def _parts(
    tables: Sequence[JointTable],
    places: Sequence[_Place],
    parents: Sequence[int | None],
    count: int,
    where: str,
) -> list[tuple[int, ...]]:
    """Of each joint the parts that sit on it and on none that it carries."""
    carriers = [_chain(index, parents) for index in range(len(tables))]
    owner: list[int | None] = [None] * count
    for index in sorted(range(len(places)), key=lambda i: places[i].branch):
        key, table = f"joint {tables[index].name}", tables[index]
        group = [i for i, place in enumerate(places) if place.branch == places[index].branch]
        last = _last(group, tables)
        if index not in carriers[last]:
            problem = (
                f"moves part {shown(table.part)}, as joint {shown(tables[last].name)} does; "
                "parent must say which of them sits on the other"
            )
            raise ConfigError(where, key, problem)
        above = _above(places[index], places)
        if above and _last(above, tables) not in carriers[index]:
            holder = tables[_last(above, tables)]
            problem = (
                f"has a parent, {shown(table.parent)}, that contradicts the file: "
                f"{shown(table.part)} hangs under {shown(holder.part)}, "
                f"which joint {shown(holder.name)} moves"
            )
            raise ConfigError(where, key, problem)
        for part in places[index].parts:
            owner[part] = last
    return [
        tuple(part for part, of in enumerate(owner) if of == index) for index in range(len(tables))
    ]


def _chain(index: int, parents: Sequence[int | None]) -> list[int]:
    carriers = [index]
    while (parent := parents[carriers[-1]]) is not None:
        carriers.append(parent)
    return carriers


def _joint(table: JointTable, parent: int | None, parts: tuple[int, ...], where: str) -> Joint:
    key = f"joint {table.name}"
    slides = table.kind == "prismatic"
    wanted = ("range_m",) if slides else ("origin_body_m", "range_deg")
    for name in ("origin_body_m", "range_deg", "range_m"):
        given = getattr(table, name) is not None
        if given != (name in wanted):
            problem = f"requires {name}" if name in wanted else f"must not have {name}"
            raise ConfigError(where, key, f"is {table.kind}: it {problem}")
    limits = table.range_m if slides else np.radians(table.range_deg or ()).tolist()
    assert limits is not None
    low, high = limits
    if not low <= 0.0 <= high:
        problem = f"must have 0, the stored position, in its {wanted[-1]}"
        raise ConfigError(where, key, problem)
    sunward = table.sunward_body
    if slides and sunward is not None:
        raise ConfigError(where, key, "is prismatic: it must not have sunward_body")
    return Joint(
        name=table.name,
        parts=parts,
        axis_body=direction(table.axis_body, where, f"{key} axis_body"),
        origin_body=np.array(table.origin_body_m or (0.0, 0.0, 0.0)),
        limits=(low, high),
        keypoints=table.keypoints,
        sunward_body=(
            None if sunward is None else direction(sunward, where, f"{key} sunward_body")
        ),
        parent=parent,
        slides=slides,
    )
