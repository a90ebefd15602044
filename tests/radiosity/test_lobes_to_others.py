"""Metal sends sunlight to another spacecraft in lobes, against quadrature of the law."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.radiosity.between_spacecraft import PosedPath, light_path
from simgl.radiosity.convex_transport import convex_transport
from simgl.radiosity.near_body import NearBody, standing_rows
from simgl.radiosity.reflection_laws import reflection_laws
from simgl.radiosity.sunlit_patches import SunlitPatches
from simgl.scene.materials import Material
from simgl.scene.spacecraft import SpacecraftModel
from tests.radiosity.glossy_walls import BLACK, PLATE, WIDE, of_plate, towards
from tests.radiosity.shapes import Quad, quads

AWAY: Quad = ((-1.3, -1, 0.1), (-1.3, 1, 0.1), (-2, 1, 1.4), (-2, -1, 1.4))


def body(quad: Quad, material: Material) -> NearBody:
    model = SpacecraftModel(
        name="sheet", mesh=quads((quad,)), parts=("sheet",), materials=(material,), open_sheets=True
    )
    transport = convex_transport(model)
    return NearBody(
        model=model,
        transport=transport,
        laws=reflection_laws(model.materials),
        standing=standing_rows(transport),
    )


@pytest.mark.parametrize("name", ["alpha 0.2", "alpha 0.4", "foil"])
def test_another_spacecraft_gets_what_the_lobes_of_metal_send_to_it(name: str) -> None:
    """A sheet a metre away. Parts and blocks are a tenth of their distance wide or, as cells are
    of powers of two, up to a fifth, a quarter of such a lobe: a tenth of the light may come down
    beside its place. Even light puts a fifth to nine tenths there."""
    sender, receiver, pose = body(PLATE, WIDE[name]), body(AWAY, BLACK), np.eye(4)
    path = light_path(receiver, sender, pose)
    posed = PosedPath(path=path, sender_from_receiver=pose)
    assert path.lobes is not None
    for elevation, azimuth in ((20.0, 0.0), (45.0, 40.0), (70.0, 0.0)):
        sun = towards(elevation, azimuth)
        cosines = SunlitPatches(sender.transport).cosines_of_samples(sun, path.samples)
        lobes = path.lobes.light(sender.laws, pose, (sun, np.ones(4)), cosines)
        seen = posed.lobes_to_places @ lobes
        places, normals, _ = receiver.places
        facing = np.flatnonzero(normals[:, 0] > 0.1)
        true = of_plate(WIDE[name], places[facing].astype(float), normals[facing[0]], sun)
        np.testing.assert_allclose(seen[facing].sum(axis=0), true.sum(axis=0), rtol=0.05)
        assert np.abs(seen[facing] - true).sum() < 0.1 * true.sum()
        behind = np.flatnonzero(normals[:, 0] < -0.1)
        np.testing.assert_array_equal(seen[behind], 0.0)
