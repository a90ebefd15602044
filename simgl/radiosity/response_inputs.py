"""What the light that vertices get of a body's sunlit surfaces depends on, for its file."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

from scipy import sparse

from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.solver import Reflectors
from simgl.scene.mesh import Mesh

MADE_BY = (
    "simgl.radiosity.precomputed_response",
    "simgl.radiosity.lobe_sunlight",
    "simgl.radiosity.lobe_pairs",
    "simgl.radiosity.glossy_places",
    "simgl.radiosity.gather_points",
    "simgl.radiosity.light_grids",
    "simgl.radiosity.near_means",
    "simgl.radiosity.reflection_laws",
    "simgl.radiosity.solver",
    "simgl.radiosity.sunlit_patches",
    "simgl.rays",
    "numpy",
    "scipy",
    "embreex",
)


def response_inputs(transport: LightTransport, surface: Reflectors) -> tuple[object, object]:
    """Equal for equal bodies, for ``content_digest``."""
    return _content(transport), _content(surface)


def _content(value: Any) -> object:
    """Matrices as their arrays, and of a mesh its digest."""
    if isinstance(value, Mesh):
        return value.digest
    if sparse.issparse(value):
        return value.shape, value.data, value.indices, value.indptr
    if is_dataclass(value):
        return tuple(_content(getattr(value, field.name)) for field in fields(value))
    return value
