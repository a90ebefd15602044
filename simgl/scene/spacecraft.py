"""A spacecraft as something to draw: a mesh with named parts, materials and keypoints."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from simgl.scene.materials import Material
from simgl.scene.mesh import Mesh
from simgl.scene.textures import SurfaceTextures


@dataclass(frozen=True, kw_only=True, eq=False)
class SpacecraftModel:
    """Shape and surface of one spacecraft, in its body axes.

    parts : names, indexed by ``mesh.part``
    materials : indexed by ``mesh.material``
    textures : the images that the materials wear
    keypoints : name to (3,) position [m]
    open_sheets : some surfaces are seen from both sides, so none may be culled
    notes : what the file asks for and does not get, one line each
    """

    name: str
    mesh: Mesh
    parts: tuple[str, ...]
    materials: tuple[Material, ...]
    keypoints: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    open_sheets: bool = False
    notes: tuple[str, ...] = ()
    textures: SurfaceTextures = field(default_factory=SurfaceTextures)

    @property
    def variant(self) -> tuple[str, ...]:
        """What drawing it needs beyond materials that are the same all over.

        ``DETAILED``: images or vertex colours; ``CUT_OUT``: they say also where no surface is;
        ``LAYERED``: coats, solar cells, crinkles, lobes that conserve energy.
        """
        found = []
        if self.mesh.uv is not None or self.mesh.colour is not None:
            found.append("DETAILED")
            if any(material.cutoff is not None for material in self.materials):
                found.append("CUT_OUT")
        if any(material.layered for material in self.materials):
            found.append("LAYERED")
        return tuple(found)

    @cached_property
    def outline(self) -> str:
        """Hash of what it hides, the key of anything that shows only where it is."""
        if "CUT_OUT" not in self.variant:
            return self.mesh.digest
        cuts = [(m.coverage, m.cutoff, m.maps.base_colour) for m in self.materials]
        content = f"{self.mesh.digest} {self.textures.digest} {cuts}"
        return hashlib.sha256(content.encode()).hexdigest()
