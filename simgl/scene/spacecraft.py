"""A spacecraft as something to draw: a mesh with named parts, materials and keypoints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from simgl.scene.materials import Material
from simgl.scene.mesh import Mesh


@dataclass(frozen=True, kw_only=True, eq=False)
class SpacecraftModel:
    """Shape and surface of one spacecraft, in its body axes.

    parts : names, indexed by ``mesh.part``
    materials : indexed by ``mesh.material``
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
