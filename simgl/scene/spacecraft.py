"""Spacecraft models: a mesh with named parts, materials, keypoints and joints."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from simgl.arrays import Array
from simgl.content_digest import content_digest
from simgl.lru_cache import MANY, LruCache
from simgl.motion.joints import (
    Joint,
    body_from_stored,
    carried_parts,
    moved_keypoints,
    unknown_joint,
)
from simgl.scene.materials import Material
from simgl.scene.mesh import Mesh
from simgl.scene.posed_mesh import PosedMesh
from simgl.scene.textures import SurfaceTextures
from simgl.scene.thermal_surface import ThermalLink, ThermalNode, ThermalPart


@dataclass(frozen=True, kw_only=True)
class Branch:
    """A node of a model's file, with the indices of the parts at and below it."""

    name: str
    parts: tuple[int, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class SpacecraftModel:
    """Shape and surface of one spacecraft, in its body axes.

    name : in error messages and tables
    mesh : its shape with all joints as stored, whatever their values
    parts : names, indexed by ``mesh.part``
    materials : indexed by ``mesh.material``
    textures : the images of the materials
    keypoints : name to (3,) position at the present joint angles [m]
    open_sheets : some surfaces are visible from both sides; back faces are not culled
    notes : features of the file that are not drawn, and a size that is not a spacecraft's, one
        line each
    branches : branches of the tree of parts, parents first
    joints : joints of the moving parts
    angles : angles of the joints in their order [rad], travel [m] of sliding joints; empty if all
        are as stored
    stored : the model with all joints as stored, if the joints of this one are moved
    thermal : internal power and heat capacity of its parts, by part name
    thermal_nodes : internal nodes, by names that no part has
    thermal_links : heat paths between parts and internal nodes
    """

    name: str
    mesh: Mesh
    parts: tuple[str, ...]
    materials: tuple[Material, ...]
    keypoints: Mapping[str, Array] = field(default_factory=dict)
    open_sheets: bool = False
    notes: tuple[str, ...] = ()
    textures: SurfaceTextures = field(default_factory=SurfaceTextures)
    branches: tuple[Branch, ...] = ()
    joints: tuple[Joint, ...] = ()
    angles: tuple[float, ...] = ()
    stored: SpacecraftModel | None = None
    # Visible images do not depend on it.
    thermal: Mapping[str, ThermalPart] = field(default_factory=dict, compare=False)
    thermal_nodes: Mapping[str, ThermalNode] = field(default_factory=dict, compare=False)
    thermal_links: tuple[ThermalLink, ...] = field(default=(), compare=False)

    @cached_property
    def variant(self) -> tuple[str, ...]:
        """The shader features that it needs beyond uniform materials.

        ``DETAILED``: images or vertex colours; ``CUT_OUT``: alpha masks; ``LAYERED``: coats, solar
        cells, crinkles, energy-conserving lobes; ``JOINTED``: parts moved by joints.
        """
        variant = []
        if self.mesh.uv is not None or self.mesh.colour is not None:
            variant.append("DETAILED")
            if any(material.cutoff is not None for material in self.materials):
                variant.append("CUT_OUT")
        if any(material.layered for material in self.materials):
            variant.append("LAYERED")
        if self.angles:
            variant.append("JOINTED")
        return tuple(variant)

    @cached_property
    def surface_digest(self) -> str:
        """Hash of its materials and their images."""
        if self.stored is not None:
            return self.stored.surface_digest
        return content_digest((self.materials, self.textures.digest))

    @property
    def nbytes(self) -> int:
        """Size of its arrays."""
        return self.mesh.nbytes + self.textures.nbytes

    @cached_property
    def posed_mesh(self) -> PosedMesh:
        """Its shape at the present joint angles."""
        motion = body_from_stored(self.joints, self.angles) if self.angles else None
        return PosedMesh(mesh=self.mesh, joints=self.joints, motion=motion)

    def posed(self, angles: Mapping[str, float]) -> SpacecraftModel:
        """The model with moved joints.

        angles : joint name to angle [rad] or travel [m]; joints that are not listed are as stored

        Equal angles give the same object while it is among the model's last 16.

        Raises ValueError for an unknown joint.
        """
        for name in angles:
            if all(joint.name != name for joint in self.joints):
                raise ValueError(f"{name} {unknown_joint(name, self.joints)}")
        values = tuple(float(angles.get(joint.name, 0.0)) for joint in self.joints)
        stored = self.stored or self
        if not any(values):
            return stored
        poses = _poses.get(stored, lambda: LruCache(_MAX_POSES), stored.nbytes)
        return poses.get(values, lambda: _posed(stored, values))

    def coarsely_posed(self, step: float, *, near_stay: bool = True) -> SpacecraftModel:
        """The model with each joint at the nearest multiple of its step within its limits.

        step : of joints that turn [rad]
        near_stay : whether values within rounding of a multiple stay as they are
        """
        if self.stored is None:
            return self
        rounded = {}
        sizes = self.step_sizes(step)
        for joint, angle, size in zip(self.joints, self.angles, sizes, strict=True):
            low, high = joint.limits
            multiple = size * round(angle / size)
            multiple += size * (multiple < low - 1e-9) - size * (multiple > high + 1e-9)
            rounded[joint.name] = angle if near_stay and abs(multiple - angle) < 1e-6 else multiple
        return self.posed(rounded)

    def step_sizes(self, step: float) -> tuple[float, ...]:
        """Steps of each joint, [rad] or [m].

        step : of a joint that turns [rad]; what slides takes steps as long as that turn would move
            the rim of its largest part
        """
        return tuple(
            step * self.reach(index) if joint.slides else step
            for index, joint in enumerate(self.joints)
        )

    def reach(self, joint: int) -> float:
        """Radius of the largest part that moves with a joint [m].

        joint : its index
        """
        return float(self.mesh.part_spheres[carried_parts(self.joints, joint), 3].max())

    @cached_property
    def outline(self) -> str:
        """Hash of its opaque outline, the key of results that depend on that alone."""
        digest = self.posed_mesh.digest
        if "CUT_OUT" not in self.variant:
            return digest
        cuts = [(m.coverage, m.cutoff, m.maps.base_colour) for m in self.materials]
        content = f"{digest} {self.textures.digest} {cuts}"
        return hashlib.sha256(content.encode()).hexdigest()


# A scene with Sun-tracking arrays asks for the same poses several times a frame. Poses share the
# arrays of the stored model, whose size counts.
_MAX_POSES = 16
_poses = LruCache[SpacecraftModel, LruCache[tuple[float, ...], SpacecraftModel]](
    MANY, max_bytes=256 << 20
)


def _posed(stored: SpacecraftModel, values: tuple[float, ...]) -> SpacecraftModel:
    motion = body_from_stored(stored.joints, values)
    keypoints = moved_keypoints(stored.keypoints, stored.joints, motion)
    return replace(stored, keypoints=keypoints, angles=values, stored=stored)
