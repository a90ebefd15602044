"""Light transports of bodies none of whose surfaces see each other, for light from elsewhere."""

from __future__ import annotations

from simgl.radiosity.bake import BakeSettings, traced
from simgl.radiosity.light_transport import LightTransport
from simgl.radiosity.remesh import subdivided
from simgl.radiosity.transport_store import STEPS
from simgl.scene.spacecraft import SpacecraftModel

# Nothing hides the sky, and what other bodies send changes over their distance.
_SETTINGS = BakeSettings(patches=600, gather_rays=32, sun_rays=32, added_triangles=0, grids=0)
# Of the body's radius.
_EDGE = 1.0 / 6.0


def convex_transport(model: SpacecraftModel) -> LightTransport:
    """Patches and gather points of a body, its joints where they are; it takes about a second."""
    mesh = model.coarsely_posed(STEPS["exact"]).posed_mesh.baked()
    sides = 2 if model.open_sheets else 1
    return traced(subdivided(mesh, _EDGE * mesh.radius), sides=sides, settings=_SETTINGS)
