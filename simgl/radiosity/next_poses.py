"""Light between parts on the move: what their next pose needs is made before they are there.

With quick light, joints take poses in steps. A frame that comes to a new one would trace all pairs
of rigid groups that have moved to each other, twenty times what another frame does; while a joint
nears a step, each frame traces a few.
"""

from __future__ import annotations

from dataclasses import dataclass
from threading import Lock

from simgl.next_step import NextStep, StepWatch, parts_due
from simgl.radiosity.patch_light import PatchLight
from simgl.radiosity.transport_store import STEPS, TransportStore
from simgl.scene.spacecraft import SpacecraftModel

# Frames left to what follows when all pairs are traced: the pose's matrices, and its reflectors.
_LAST = 2


@dataclass(frozen=True, kw_only=True, eq=False)
class _NextPose:
    """A model at the steps that its joints take next.

    frames : left to make what it needs
    """

    model: SpacecraftModel
    frames: int


class NextPoses:
    """Follows the joints of spacecraft, and makes quick light ahead of them.

    Results are those of a frame that makes all by itself. Any thread may use it.

    light : of the patches, whose precomputed surfaces a pose needs
    """

    def __init__(self, transports: TransportStore, light: PatchLight) -> None:
        self._transports, self._light = transports, light
        self._watches: dict[tuple[int, str], StepWatch] = {}
        # Spacecraft of one model have one transport, whose pairs are traced once.
        self._lock = Lock()

    def make_ahead(self, instance: int, model: SpacecraftModel) -> None:
        """Do what is due in this frame.

        instance : of the spacecraft in the scene
        model : at its pose in this frame
        """
        with self._lock:
            self._make_due(instance, model)

    def _make_due(self, instance: int, model: SpacecraftModel) -> None:
        pose = self._next_pose(instance, model)
        if pose is None:
            return
        untraced = self._transports.untraced_pairs(pose.model)
        if untraced:
            due = parts_due(untraced, max(pose.frames - _LAST, 1))
            self._transports.trace_pairs(pose.model, due)
            return
        cached = self._transports.has_pose(pose.model)
        transport = self._transports.of(pose.model, "quick")
        if cached and transport is not None:
            self._light.prepare(pose.model, transport)

    def _next_pose(self, instance: int, model: SpacecraftModel) -> _NextPose | None:
        """The first step that a joint enters next; None where none does so soon."""
        sizes = model.step_sizes(STEPS["quick"])
        values = model.angles or (0.0,) * len(model.joints)
        first: tuple[int, NextStep] | None = None
        for index, (joint, value) in enumerate(zip(model.joints, values, strict=True)):
            watch = self._watches.setdefault((instance, joint.name), StepWatch())
            step = watch.next_step(value / sizes[index])
            if step is not None and (first is None or step.frames < first[1].frames):
                first = index, step
        if first is None:
            return None
        index, step = first
        low, high = model.joints[index].limits
        coming = sizes[index] * step.index
        if not low <= coming <= high:
            return None
        coarse = model.coarsely_posed(STEPS["quick"], near_stay=False)
        rounded = list(coarse.angles or (0.0,) * len(model.joints))
        rounded[index] = coming
        names = [joint.name for joint in model.joints]
        pose = model.posed(dict(zip(names, rounded, strict=True)))
        # As stored, all light is that of a bake.
        return None if pose.stored is None else _NextPose(model=pose, frames=step.frames)
