"""Which spacecraft that pass before one another are layers of their own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.physics.frames import rotation_about
from simgl.scene.state import SceneState
from simgl.view.depth_layers import DepthLayers, depth_layers
from tests.scenes import Table, lambert, scene

FOCAL, RANGE = 0.013 / 3.75e-6, 100.0
PLATE = {"box": {"size_m": [2.0, 2.0, 0.1], "material": lambert(0.5)}}
CAMERA: Table = {"position_icrf_m": [0, 0, RANGE], "look_at": "a", "up": [0.0, 1.0, 0.0]}


def layers_of(
    places: dict[str, tuple[float, float, float]],
    ways_px: dict[str, float],
    turn: float = 0.0,
) -> DepthLayers:
    """Plates at places [m] that go so far to the right in an exposure, all turned about y."""
    bodies = {name: {"model": PLATE, "position_icrf_m": list(at)} for name, at in places.items()}
    one = scene(bodies, CAMERA)
    rest = one.at(one.epoch_tai_ns)
    R, right = rotation_about(np.array([0.0, 1.0, 0.0]), turn), rest.cameras["cam"]

    def at(share: float) -> SceneState:
        moved = {}
        for name, body in rest.bodies.items():
            way = share * ways_px.get(name, 0.0) * RANGE / FOCAL * right.R_camera_from_icrf[0]
            pose = replace(body.pose, position=body.pose.position + way, R_icrf_from_body=R)
            moved[name] = replace(body, pose=pose)
        return replace(rest, bodies=moved)

    return depth_layers([at(share) for share in (-0.5, 0.0, 0.5)], "cam", 1.0)


def test_what_goes_together_is_one_layer() -> None:
    both = layers_of({"a": (0, 0, 0), "b": (0, 0, 5)}, {"a": 40.0, "b": 40.0})
    assert both.names == (frozenset("ab"),)


def test_layers_are_in_the_order_of_their_distance() -> None:
    places = {"a": (0.0, 0.0, 5.0), "b": (0.0, 0.0, -5.0), "c": (0.0, 0.0, 0.0)}
    three = layers_of(places, {"a": 30.0, "b": -20.0})
    assert three.names == (frozenset("b"), frozenset("c"), frozenset("a"))
    # Of a and b the slower one; a plate's bound is that of its nearest point.
    assert three.both_move == pytest.approx(20.0, rel=0.1)


def test_plates_that_are_turned_and_lie_before_each_other_are_layers() -> None:
    """Their depths overlap, but a plane along them lies between."""
    turn = np.radians(40.0)
    normal = 0.5 * np.array([np.sin(turn), 0.0, np.cos(turn)])
    places = {"a": (0.0, 0.0, 0.0), "b": tuple(normal.tolist())}
    assert layers_of(places, {"b": 4.0}, turn).names == (frozenset("a"), frozenset("b"))


def test_what_passes_through_another_is_no_layer() -> None:
    places = {"a": (0.0, 0.0, 0.0), "b": (0.0, 0.0, 0.0)}
    assert layers_of(places, {"b": 30.0}).names == (frozenset("ab"),)


def test_what_is_beside_others_takes_no_layer_of_its_own() -> None:
    places = {"a": (0.0, 0.0, 0.0), "b": (40.0, 0.0, 5.0)}
    assert layers_of(places, {"b": 10.0}).names == (frozenset("ab"),)
