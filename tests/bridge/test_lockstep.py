"""A client sends a state and gets back the image of exactly that state."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest
from msgspec import msgpack, structs
from simgl_bridge import BodyPose, Client, RemoteError
from simgl_bridge.framing import pack
from simgl_bridge.hashes import state_hash
from simgl_bridge.message_parts import SentPose, Shot
from simgl_bridge.messages import Message, Render
from simgl_bridge.render_request import requested_state

from simgl import Product, Scenario, Simulator, scenario_from_dict
from simgl.camera.camera import Detector
from simgl.errors import BridgeError
from simgl.images import saturated
from simgl.physics.frames import Pose, matrix_from_quaternion
from tests.bridge.harness import RawLink, Running
from tests.patience import limit

SECOND = 1_000_000_000
Q_SMALL_TURN = (0.0, np.sin(0.01), 0.0, np.cos(0.01))
CHASER = BodyPose(
    position_m=np.array([0.5, -0.25, 40.0]),
    velocity_m_s=(0.0, 0.0, -0.1),
    q_icrf_from_body_xyzw=Q_SMALL_TURN,
)
TARGET = BodyPose(
    position_m=[0.1, 0.2, 0.3],
    velocity_m_s=[0.0, 0.0, 0.0],
    q_icrf_from_body_xyzw=[0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)],
)


def plain_render(scenario: Scenario, id: int) -> dict[str, Any]:
    cameras = [{"camera": "nav"}]
    return {"type": "render", "id": id, "tai_ns": scenario.epoch_tai_ns, "cameras": cameras}


def as_pose(pose: BodyPose) -> Pose:
    return Pose(
        position=np.array(pose.position_m, dtype=np.float64),
        velocity=np.array(pose.velocity_m_s, dtype=np.float64),
        R_icrf_from_body=matrix_from_quaternion(pose.q_icrf_from_body_xyzw),
    )


def test_every_plane_equals_a_direct_capture_of_the_same_state_bit_for_bit(
    client: Client, scenario: Scenario, gl: moderngl.Context
) -> None:
    time = scenario.epoch_tai_ns + 3 * SECOND
    products = ("dn", "radiance", "electrons", "depth", "part_id")
    bodies = {"chaser": CHASER, "target": TARGET}
    image = client.render(time, "nav", bodies, exposure_time_s=0.0004, products=products)
    state = scenario.with_poses(
        time, {name: as_pose(pose) for name, pose in bodies.items()}, {"nav": 0.0004}
    )
    with Simulator(scenario, gl) as simulator:
        direct = simulator.capture(state, "nav", set(Product))
    assert direct.digital is not None
    assert direct.radiance is not None
    assert direct.electrons is not None
    assert direct.truth is not None
    np.testing.assert_array_equal(image.dn, direct.digital.dn)
    np.testing.assert_array_equal(image.planes["radiance"], direct.radiance.radiance)
    np.testing.assert_array_equal(image.planes["electrons"], direct.electrons.electrons)
    np.testing.assert_array_equal(image.planes["depth"], direct.truth.depth)
    np.testing.assert_array_equal(image.planes["part_id"], direct.truth.part_id)
    assert image.part_names == direct.truth.part_names
    assert list(image.planes) == list(products)
    # The target is in view: the equality above is not one of black frames.
    assert np.count_nonzero(image.planes["depth"]) > 50


def test_the_reply_says_what_was_used(client: Client, scenario: Scenario) -> None:
    time = scenario.epoch_tai_ns + SECOND
    image = client.render(time, "nav", {"chaser": CHASER}, exposure_time_s=0.001)
    pose = as_pose(CHASER)
    expected = pose.position + pose.R_icrf_from_body @ np.array([0.0, 0.0, -0.2])
    # float64 through one product: a few ulp of 40 m
    np.testing.assert_allclose(image.camera_position_m, expected, atol=1e-13)
    R_camera_from_icrf = matrix_from_quaternion(image.q_camera_from_icrf_xyzw)
    boresight_icrf = pose.R_icrf_from_body @ np.array([0.0, 0.0, -1.0])
    np.testing.assert_allclose(R_camera_from_icrf[2], boresight_icrf, atol=1e-14)
    np.testing.assert_array_equal(image.intrinsics, scenario.cameras["nav"].intrinsics)
    assert image.tai_ns == time
    assert image.camera == "nav"
    assert image.exposure_time_s == 0.001
    assert image.seed == 7
    assert image.render_time_s > 0.0
    assert image.dn.dtype == np.uint16
    assert image.dn.shape == (48, 64)
    assert not image.dn.flags.writeable


def test_the_state_hash_is_that_of_the_state_sent(client: Client, scenario: Scenario) -> None:
    time = scenario.epoch_tai_ns
    image = client.render(time, "nav", {"chaser": CHASER})
    expected = state_hash(
        tai_ns=time,
        bodies={"chaser": CHASER.as_sent()},
        sun=None,
        cameras=[("nav", 0.0002, scenario.cameras["nav"].detector.gain_dn_per_e)],
        seed=7,
    )
    assert image.state_hash == expected
    moved = client.render(time, "nav", {"target": TARGET}, exposure_time_s=0.0002)
    assert moved.state_hash != expected


def test_the_sequence_counts_pictures(client: Client, scenario: Scenario) -> None:
    time = scenario.epoch_tai_ns
    first = client.render(time, "nav").sequence
    client.ping()
    with pytest.raises(RemoteError):
        client.render(time, "no such camera")
    assert client.render(time + SECOND, "side").sequence == first + 1
    # A picture depends on its request alone, so time may run backwards where that is meant.
    assert client.render(time, "nav", seek=True).sequence == first + 2


def test_the_same_state_gives_the_same_bits_at_any_time(client: Client, scenario: Scenario) -> None:
    time = scenario.epoch_tai_ns
    first = client.render(time, "nav", {"chaser": CHASER})
    client.render(time + SECOND, "side", {"target": TARGET})
    np.testing.assert_array_equal(
        client.render(time, "nav", {"chaser": CHASER}, seek=True).dn, first.dn
    )


def test_spacecraft_left_out_follow_the_scenario(
    client: Client, scenario: Scenario, gl: moderngl.Context
) -> None:
    time = scenario.epoch_tai_ns
    image = client.render(time, "nav")
    assert image.camera_position_m == (0.0, 0.0, 59.8)
    with Simulator(scenario, gl) as simulator:
        direct = simulator.capture(scenario.at(time), "nav").digital
    assert direct is not None
    np.testing.assert_array_equal(image.dn, direct.dn)


def test_a_law_relative_to_a_sent_spacecraft_follows_it() -> None:
    box = {"box": {"size_m": [1.0, 1.0, 1.0], "material": {"reflectance": 0.5}}}
    scenario = scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "earth": {"shape": "none"},
            "spacecraft": {
                "lead": {"model": box, "orbit": {"altitude_km": 400.0}},
                "tail": {
                    "model": box,
                    "relative_to": "lead",
                    "position_lvlh_m": [-200.0, 0.0, 0.0],
                },
            },
            "camera": {
                "nav": {"on": "tail", "position_body_m": [2.0, 0.0, 0.0], "look_at": "lead"}
            },
        }
    )
    # Above the North Pole, flying along x: LVLH x is ICRF x.
    lead = BodyPose(
        position_m=(0.0, 0.0, 7e6),
        velocity_m_s=(7500.0, 0.0, 0.0),
        q_icrf_from_body_xyzw=(0.0, 0.0, 0.0, 1.0),
    )
    request = Render(
        id=1,
        tai_ns=scenario.epoch_tai_ns,
        cameras=(Shot(camera="nav"),),
        bodies={"lead": lead.as_sent()},
    )
    tail = requested_state(scenario, request).bodies["tail"].pose
    # float64 at 7000 km: steps of 1e-9 m
    np.testing.assert_allclose(tail.position, [-200.0, 0.0, 7e6], atol=1e-8)


def test_a_time_that_is_no_whole_number_is_refused(client: Client) -> None:
    problem = r"^tai_ns must be a whole number of nanoseconds, got 1\.774e\+18$"
    with pytest.raises(TypeError, match=problem):
        client.render(1.774e18, "nav")  # type: ignore[arg-type]


def test_a_sun_of_two_numbers_is_named(client: Client, scenario: Scenario) -> None:
    with pytest.raises(ValueError, match=r"^sun_position_m must be 3 numbers, got shape \(2,\)$"):
        client.render(scenario.epoch_tai_ns, "nav", sun_position_m=(1e11, 0.0))


def test_a_closed_client_says_so(running: Running) -> None:
    link = Client(running.address, timeout_s=limit(20.0))
    link.close()
    link.close()
    for call in (link.ping, lambda: link.send_state(0, [Shot(camera="nav")])):
        with pytest.raises(BridgeError, match=f"^{running.address}: this client is closed$"):
            call()


def test_the_welcome_describes_the_scenario(client: Client, scenario: Scenario) -> None:
    welcome = client.welcome
    assert welcome.scenario == "small"
    assert welcome.epoch_tai_ns == scenario.epoch_tai_ns
    assert welcome.seed == 7
    assert welcome.bodies == {"target": (), "chaser": ()}
    nav, side = welcome.cameras
    assert (nav.name, nav.width, nav.height, nav.exposure_time_s) == ("nav", 64, 48, 0.0002)
    assert (side.name, side.cx, side.cy) == ("side", 24.0, 20.0)
    assert nav.focal_length_px == scenario.cameras["nav"].focal_length_px


def test_a_request_sent_twice_is_answered_twice_with_the_same_bytes_and_rendered_once(
    raw: RawLink, running: Running, scenario: Scenario
) -> None:
    request = {
        "type": "render",
        "id": 5,
        "tai_ns": scenario.epoch_tai_ns,
        "cameras": [{"camera": "nav"}],
    }
    raw.ask_map({"type": "hello", "client": "raw", "versions": ["simgl/1"]})
    before = running.simulator.captured
    frames = [b"simgl/1", msgpack.encode(request)]
    raw.send(frames)
    first = raw.receive()
    raw.send(frames)
    assert raw.receive() == first
    assert len(first) == 3
    assert running.simulator.captured == before + 1


def test_an_id_used_again_for_another_state_is_refused(raw: RawLink, scenario: Scenario) -> None:
    request = {
        "type": "render",
        "id": 6,
        "tai_ns": scenario.epoch_tai_ns,
        "cameras": [{"camera": "nav"}],
    }
    assert raw.ask_map(request)["type"] == "images"
    reply = raw.ask_map({**request, "cameras": [{"camera": "side"}]})
    assert (reply["code"], reply["field"], reply["id"]) == ("BAD_VALUE", "id", 6)


def test_two_clients_of_one_name_get_their_own_images(running: Running, scenario: Scenario) -> None:
    time = scenario.epoch_tai_ns
    with Client(running.address, name="same") as a, Client(running.address, name="same") as b:
        for step in range(3):
            of_a = a.render(time + step, "nav")
            of_b = b.render(time + step, "side", {"chaser": CHASER})
            assert (of_a.camera, of_a.dn.shape) == ("nav", (48, 64))
            assert (of_b.camera, of_b.dn.shape) == ("side", (40, 48))
            assert of_a.tai_ns == of_b.tai_ns == time + step


def test_fields_of_a_newer_minor_version_are_ignored(raw: RawLink, scenario: Scenario) -> None:
    request = {
        "type": "render",
        "id": 1,
        "tai_ns": scenario.epoch_tai_ns,
        "cameras": [{"camera": "nav"}],
    }
    assert raw.ask_map({**request, "gain": 3})["type"] == "images"


def test_saturated_pixels_are_those_at_full_scale_or_full_well() -> None:
    converter_first = Detector(
        width=2,
        height=2,
        pixel_pitch=1e-6,
        quantum_efficiency=(1.0, 1.0, 1.0, 1.0),
        full_well=1e5,
        read_noise=4.0,
        bits=8,
        pedestal=10.0,
        gain_dn_per_e=0.1,
    )
    dn = np.array([[255, 254], [0, 255]], dtype=np.uint16)
    assert saturated(dn, converter_first).sum() == 2
    # Full well at 10 + 100 DN; three sigma of read noise are 1.2 DN.
    well_first = replace(converter_first, full_well=1000.0)
    dn = np.array([[110, 108], [107, 111]], dtype=np.uint16)
    assert saturated(dn, well_first).sum() == 3


def test_a_pose_says_which_field_has_the_wrong_shape() -> None:
    pose = BodyPose(
        position_m=[1.0, 2.0], velocity_m_s=(0, 0, 0), q_icrf_from_body_xyzw=(0, 0, 0, 1)
    )
    with pytest.raises(ValueError, match=r"position_m must be 3 numbers, got shape \(2,\)"):
        pose.as_sent()


def test_a_pose_made_from_a_pose_of_simgl_is_the_same() -> None:
    sent = BodyPose.from_pose(as_pose(CHASER)).as_sent()
    assert isinstance(sent, SentPose)
    # A quaternion through a matrix and back: a few ulp.
    np.testing.assert_allclose(sent.q_icrf_from_body_xyzw, Q_SMALL_TURN, atol=1e-15)
    assert sent.position_m == (0.5, -0.25, 40.0)


def test_a_picture_of_another_state_is_never_handed_over(
    client: Client, scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    honest = pack

    def later(message: Message) -> list[bytes]:
        # What reaches the server is another instant than the one that the client asked for.
        if isinstance(message, Render):
            message = structs.replace(message, tai_ns=message.tai_ns + 1)
        return honest(message)

    monkeypatch.setattr("simgl_bridge.client_protocol.pack", later)
    with pytest.raises(BridgeError, match="shows another state than request"):
        client.render(scenario.epoch_tai_ns, "nav")
