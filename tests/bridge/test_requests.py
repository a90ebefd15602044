"""One request, one state: several cameras, their settings and times, the Sun; what is refused."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from simgl_bridge import Client, DelayLine, RemoteError, Shot
from simgl_bridge.basilisk.camera_overrides import load_camera_files
from simgl_bridge.commands import serve
from simgl_bridge.describe_scene import served_scene
from simgl_bridge.framing import BadMessageError
from simgl_bridge.message_parts import SentPose
from simgl_bridge.messages import Render
from simgl_bridge.render_request import requested_state
from simgl_bridge.validate_request import check_request

from simgl import Scenario, scenario_from_dict
from simgl.camera.presets import read_camera
from simgl.errors import AssetError, BridgeError
from simgl.physics.constants import ASTRONOMICAL_UNIT
from tests.bridge.harness import Gate, RawLink, Running, header_of
from tests.patience import limit

Starter = Callable[..., Running]
Connect = Callable[[Running], RawLink]
SECOND = 1_000_000_000
HELLO = {"type": "hello", "client": "raw", "versions": ["simgl/1"]}


def request(scenario: Scenario, id: int, **changes: Any) -> dict[str, Any]:
    """A render request as a plain object."""
    shot = {"camera": "nav"}
    start = scenario.epoch_tai_ns
    return {"type": "render", "id": id, "tai_ns": start, "cameras": [shot], **changes}


def packed(message: dict[str, Any]) -> list[bytes]:
    return [b"simgl/1", msgspec.msgpack.encode(message)]


def test_images_of_one_time_have_independent_noise_if_their_draws_differ(
    client: Client, scenario: Scenario
) -> None:
    now = scenario.epoch_tai_ns
    images = [
        client.render(now, "nav", exposure_time_s=2e-5, draw=draw)
        for draw in (0, 1, 2, 2**32 - 1, 1)
    ]
    assert images[1].dn.tobytes() == images[4].dn.tobytes()
    assert len({image.state_hash for image in images}) == 4
    # Differences hold no light and no fixed pattern, and their signs weigh bright and dark pixels
    # alike: the mean product of N independent ones has a standard deviation of 1 / sqrt(N) at most.
    dn = [image.dn.astype(np.int64) for image in images]
    for a, b, c, d in ((0, 1, 2, 3), (0, 2, 1, 3), (0, 3, 1, 2)):
        products = np.sign(dn[a] - dn[b]) * np.sign(dn[c] - dn[d])
        assert np.abs(products).mean() > 0.3
        assert abs(products.mean()) < 4.0 / np.sqrt(products.size)


@pytest.mark.parametrize("draw", [-1, 2**32])
def test_a_draw_out_of_range_is_named(client: Client, scenario: Scenario, draw: int) -> None:
    with pytest.raises(RemoteError, match=r"draw must lie in 0\.\.4294967295, got") as caught:
        client.render(scenario.epoch_tai_ns, "nav", draw=draw)
    assert caught.value.code == "BAD_VALUE"


def test_cameras_of_one_request_show_one_state_as_if_asked_one_by_one(
    client: Client, scenario: Scenario
) -> None:
    now = scenario.epoch_tai_ns
    shots = [
        Shot(camera="side", products=("depth", "dn")),
        Shot(camera="nav", exposure_time_s=0.001, products=("dn",)),
    ]
    tick = client.render_all(now, shots)
    assert list(tick) == ["side", "nav"]
    assert tick["side"].sequence == tick["nav"].sequence == tick.sequence
    assert tick["side"].state_hash == tick["nav"].state_hash == tick.state_hash
    for shot in shots:
        alone = client.render(now, shot.camera, None, shot.exposure_time_s, shot.products)
        for product in shot.products:
            np.testing.assert_array_equal(tick[shot.camera].planes[product], alone.planes[product])
    assert tick["side"].units == {"depth": "m", "dn": "DN"}


def test_the_gain_asked_for_is_the_gain_used(client: Client, scenario: Scenario) -> None:
    now, own = scenario.epoch_tai_ns, scenario.cameras["nav"].detector
    plain = client.render(now, "nav")
    image = client.render(now, "nav", gain_dn_per_e=0.5 * own.gain_dn_per_e)
    assert plain.gain_dn_per_e == own.gain_dn_per_e
    assert image.gain_dn_per_e == 0.5 * own.gain_dn_per_e
    assert plain.saturated_pixels == 0
    # The same electrons and the same noise, floored to whole DN before and after: within 1 DN.
    signal = plain.dn.astype(float) - own.pedestal
    half = image.dn.astype(float) - own.pedestal
    assert signal.max() > 100.0
    np.testing.assert_allclose(half, 0.5 * signal, atol=1.0)


def test_a_sun_at_two_au_gives_a_quarter_of_the_light(start_server: Starter) -> None:
    # The fixed Sun of the small scenario takes a direction alone; here the Sun is the real one.
    box = {"box": {"size_m": [1.0, 1.0, 1.0], "material": {"reflectance": 0.5}}}
    scenario = scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "earth": {"shape": "none"},
            # Stars are as bright as ever.
            "sky": {"stars": False},
            "spacecraft": {"target": {"model": box, "position_icrf_m": [0.0, 0.0, 0.0]}},
            "camera": {
                "nav": {
                    "position_icrf_m": [0.0, 0.0, 10.0],
                    "look_at": "target",
                    "width_px": 16,
                    "height_px": 16,
                    "focal_length_mm": 0.3,
                }
            },
        }
    )
    running = start_server(scenario)
    with Client(running.address, timeout_s=limit(20.0)) as client:
        images = [
            client.render(
                scenario.epoch_tai_ns,
                "nav",
                products=("radiance",),
                sun_position_m=(0.0, 0.0, distance * ASTRONOMICAL_UNIT),
            )
            for distance in (1.0, 2.0)
        ]
    near, far = (i.planes["radiance"] for i in images)
    assert near.max() > 1.0
    # float32, and the camera's 10 m of 1 au
    np.testing.assert_allclose(far, near / 4.0, rtol=1e-5)
    assert images[0].sun_direction_icrf == (0.0, 0.0, 1.0)
    ratio = np.array(images[1].sun_irradiance_w_m2) / images[0].sun_irradiance_w_m2
    np.testing.assert_allclose(ratio, 0.25, rtol=1e-9)


def test_a_sent_sun_turns_a_fixed_one(client: Client, scenario: Scenario) -> None:
    image = client.render(scenario.epoch_tai_ns, "nav", sun_position_m=(0.0, -3e11, 0.0))
    assert image.sun_direction_icrf == (0.0, -1.0, 0.0)
    turned_back = client.render(scenario.epoch_tai_ns, "nav", sun_position_m=(0.9e11, 0.0, 1.2e11))
    plain = client.render(scenario.epoch_tai_ns, "nav")
    np.testing.assert_allclose(turned_back.sun_direction_icrf, (0.6, 0.0, 0.8), atol=1e-15)
    assert not np.array_equal(image.dn, plain.dn)


def test_every_pose_used_is_in_the_reply(client: Client, scenario: Scenario) -> None:
    image = client.render(scenario.epoch_tai_ns, "nav")
    assert set(image.bodies) == {"target", "chaser"}
    assert image.bodies["chaser"].position_m == (0.0, 0.0, 60.0)
    assert image.bodies["chaser"].q_icrf_from_body_xyzw == (0.0, 0.0, 0.0, 1.0)


def test_an_image_says_when_light_fell_and_when_flight_software_has_it(
    start_server: Starter, scenario: Scenario
) -> None:
    nav = replace(scenario.cameras["nav"], readout_time=0.02, transport_latency=0.1)
    running = start_server(replace(scenario, cameras={**scenario.cameras, "nav": nav}))
    now = scenario.epoch_tai_ns
    with Client(running.address, timeout_s=limit(20.0)) as client:
        assert client.welcome.cameras[0].readout_time_s == 0.02
        line = DelayLine()
        for step in range(4):
            # An image takes 0.5 ms of light after mid-exposure, 20 ms to read, 100 ms on the wire.
            tick = now + step * SECOND // 20
            line.post(client.render(tick, "nav", exposure_time_s=0.001))
            arrived = [image.tai_ns for image in line.due(tick)]
            assert arrived == ([now] if step == 3 else [])
        assert len(line) == 3
        image = line.due(now + SECOND)[0]
    assert image.exposure_start_tai_ns == image.tai_ns - 500_000
    assert image.exposure_end_tai_ns == image.tai_ns + 500_000
    assert image.readout_end_tai_ns == image.tai_ns + 20_500_000
    assert image.available_tai_ns == image.tai_ns + 120_500_000


def test_no_image_of_a_rolling_shutter_is_read_before_its_last_row_is_exposed(
    start_server: Starter, scenario: Scenario
) -> None:
    rows = scenario.cameras["nav"].detector.height
    slow = replace(scenario.cameras["nav"].detector, row_time=0.001)
    nav = replace(scenario.cameras["nav"], detector=slow)
    running = start_server(replace(scenario, cameras={**scenario.cameras, "nav": nav}))
    now = scenario.epoch_tai_ns
    with Client(running.address, timeout_s=limit(20.0)) as client:
        image = client.render(now, "nav", exposure_time_s=0.001)
    # Mid-exposure is that of the middle row; half of the others come after it.
    last_row = now + (rows - 1) * 500_000
    assert image.exposure_end_tai_ns == now + 500_000
    assert image.available_tai_ns == image.readout_end_tai_ns == last_row + 500_000


def test_time_goes_backwards_only_where_that_is_meant(client: Client, scenario: Scenario) -> None:
    now = scenario.epoch_tai_ns
    client.render(now + SECOND, "nav")
    with pytest.raises(RemoteError) as caught:
        client.render(now, "nav")
    assert (caught.value.code, caught.value.field) == ("TIME_BACKWARDS", "tai_ns")
    assert f'must not be before {now + SECOND}, the last request\'s, unless "seek" is true' in str(
        caught.value
    )
    assert client.render(now, "nav", seek=True).tai_ns == now
    # From there time goes on; and every client has its own.
    assert client.render(now + 1, "nav").tai_ns == now + 1


def test_requests_beyond_the_window_are_busy_and_those_within_are_answered(
    start_server: Starter, scenario: Scenario, connect: Connect
) -> None:
    running = start_server(scenario)
    running.simulator.hook = gate = Gate()
    raw = connect(running)
    assert raw.ask_map(HELLO)["window"] == 2
    # While the first is rendered, five more arrive for two places.
    raw.send(packed(request(scenario, 1)))
    gate.wait()
    for id in range(2, 7):
        raw.send(packed(request(scenario, id)))
    gate.open()
    replies = [header_of(raw.receive()) for _ in range(6)]
    busy = [r for r in replies if r["type"] == "error"]
    assert [r["id"] for r in replies if r["type"] == "images"] == [1, 2, 3]
    assert [(r["id"], r["code"], r["retryable"]) for r in busy] == [
        (id, "BUSY", True) for id in (4, 5, 6)
    ]
    assert busy[0]["detail"] == "2 requests of this client wait already, its window"
    # The same ids are welcome later.
    assert raw.ask_map(request(scenario, 4))["type"] == "images"


def test_clients_take_turns(start_server: Starter, scenario: Scenario, connect: Connect) -> None:
    running = start_server(scenario)
    running.simulator.hook = gate = Gate()
    greedy, modest = connect(running), connect(running)
    greedy.send(packed(request(scenario, 1)))
    gate.wait()
    greedy.send(packed(request(scenario, 2)))
    greedy.send(packed(request(scenario, 3)))
    modest.send(packed(request(scenario, 1)))
    gate.open()
    # Two of the first client wait: the second client's only one comes before the last of them.
    assert header_of(modest.receive())["sequence"] in (2, 3)
    assert [header_of(greedy.receive())["sequence"] for _ in range(3)][-1] == 4


def test_a_request_sent_again_while_it_waits_is_rendered_and_answered_once(
    start_server: Starter, scenario: Scenario, connect: Connect
) -> None:
    running = start_server(scenario)
    running.simulator.hook = gate = Gate()
    raw = connect(running)
    raw.send(packed(request(scenario, 1)))
    gate.wait()
    for _ in range(5):
        raw.send(packed(request(scenario, 2)))
    gate.open()
    assert [header_of(raw.receive())["id"] for _ in range(2)] == [1, 2]
    # What comes next is the answer to the ping, not another picture.
    assert raw.ask_map({"type": "ping", "id": 9})["type"] == "pong"
    assert running.simulator.captured == 2


def test_an_id_used_again_while_the_first_waits_is_refused_not_ignored(
    start_server: Starter, scenario: Scenario, connect: Connect
) -> None:
    running = start_server(scenario)
    running.simulator.hook = gate = Gate()
    raw = connect(running)
    raw.send(packed(request(scenario, 1)))
    gate.wait()
    raw.send(packed(request(scenario, 2)))
    raw.send(packed(request(scenario, 2, cameras=[{"camera": "side"}])))
    gate.open()
    assert [header_of(raw.receive())["type"] for _ in range(2)] == ["images", "images"]
    reply = header_of(raw.receive())
    assert (reply["code"], reply["field"], reply["id"]) == ("BAD_VALUE", "id", 2)
    assert running.simulator.captured == 2


def test_a_request_whose_deadline_is_over_is_not_rendered(
    start_server: Starter, scenario: Scenario, connect: Connect
) -> None:
    running = start_server(scenario)
    running.simulator.hook = gate = Gate()
    raw = connect(running)
    raw.send(packed(request(scenario, 1)))
    gate.wait()
    raw.send(packed(request(scenario, 2)))
    raw.send(packed(request(scenario, 3, deadline_ms=50)))
    # The third is answered at its deadline, while the first is in hand and the second waits.
    late = header_of(raw.receive())
    assert (late["code"], late["id"], late["retryable"]) == ("DEADLINE", 3, True)
    assert late["detail"] == "deadline_ms is over: too late, there was no image after 50 ms"
    running.simulator.hook = None
    gate.open()
    assert [header_of(raw.receive())["id"] for _ in range(2)] == [1, 2]
    assert running.simulator.captured == 2


POSE = {
    "position_m": [0.0, 0.0, 60.0],
    "velocity_m_s": [0.0, 0.0, 0.0],
    "q_icrf_from_body_xyzw": [0.0, 0.0, 0.0, 1.0],
}


@pytest.mark.parametrize(
    ("changes", "code", "field", "detail"),
    [
        ({"bodies": {"chaser": {**POSE, "joints": {"door": 0.5}}}}, "NO_JOINT",
         "bodies.chaser.joints",
         'bodies.chaser.joints "door" does not exist here; none is allowed here'),
        ({"bodies": {"chaser": {**POSE, "joints": {"door": "open"}}}}, "BAD_VALUE",
         "bodies.chaser.joints.door", 'must be a number, got "open"'),
        ({"sun": {"position_m": [0.0, 0.0, 1e8]}}, "BAD_VALUE", "sun.position_m",
         "sun.position_m must be at least 1e+09 m from the Earth, got 1e+08 m"),
        ({"sun": {"position_m": [0.0, 0.0, float("nan")]}}, "BAD_VALUE", "sun.position_m",
         "sun.position_m must be finite, got [0.0, 0.0, nan]"),
        ({"sun": {}}, "BAD_VALUE", "sun.position_m", "sun.position_m is missing"),
        ({"cameras": []}, "BAD_VALUE", "cameras", "cameras must name at least one camera"),
        ({"cameras": [{"camera": "nav"}, {"camera": "nav"}]}, "BAD_VALUE", "cameras[1].camera",
         'cameras[1].camera repeats "nav"'),
        ({"cameras": [{"camera": "nav"}, {"camera": "sid"}]}, "NO_CAMERA", "cameras[1].camera",
         'did you mean "side"?'),
        ({"cameras": [{"camera": "nav", "gain_dn_per_e": 0.0}]}, "BAD_VALUE",
         "cameras[0].gain_dn_per_e", "must lie above 0, up to 1e+06 DN/e-, got 0"),
        ({"cameras": [{"camera": "nav", "gain_dn_per_e": float("inf")}]}, "BAD_VALUE",
         "cameras[0].gain_dn_per_e", "got inf"),
        ({"deadline_ms": 0}, "BAD_VALUE", "deadline_ms",
         "deadline_ms must lie in 1..3600000 ms, got 0"),
        ({"seek": 1}, "BAD_VALUE", "seek", "must be true or false, got 1"),
    ],
)  # fmt: skip
def test_a_wrong_value_of_the_new_fields_is_named(
    raw: RawLink, scenario: Scenario, changes: dict[str, Any], code: str, field: str, detail: str
) -> None:
    reply = raw.ask_map(request(scenario, 1, **changes))
    assert (reply["type"], reply["code"], reply["field"]) == ("error", code, field)
    assert detail in reply["detail"]


def test_statistics_count_what_happened(
    start_server: Starter, scenario: Scenario, connect: Connect
) -> None:
    raw = connect(start_server(scenario))
    raw.ask_map(request(scenario, 1))
    raw.ask_map(request(scenario, 1))
    raw.ask_map({"type": "nonsense"})
    counts = raw.ask_map({"type": "stats", "id": 3})
    wanted = {"images": 1, "repeated": 1, "errors": 1, "busy": 0, "lost": 0, "waiting": 0}
    assert {k: counts[k] for k in wanted} == wanted
    assert counts["clients"] == 1
    assert 0.0 < counts["uptime_s"] < 60.0


def test_a_seed_chosen_over_the_link_is_the_seed_of_the_noise(
    start_server: Starter, scenario: Scenario
) -> None:
    running = start_server(scenario)
    now = scenario.epoch_tai_ns
    with Client(running.address, timeout_s=limit(20.0)) as client:
        seven = client.render(now, "nav")
        hash_before = client.welcome.scene_hash
        assert client.configure(seed=8).seed == 8
        eight = client.render(now, "nav", seek=True)
        assert client.welcome.scene_hash == hash_before
        assert not np.array_equal(seven.dn, eight.dn)
        client.configure(seed=7)
        np.testing.assert_array_equal(client.render(now, "nav", seek=True).dn, seven.dn)


def test_a_seed_that_the_noise_cannot_take_is_refused(raw: RawLink) -> None:
    for seed in (-1, 2**32, 2**63 - 1):
        reply = raw.ask_map({"type": "configure", "id": 3, "seed": seed})
        assert (reply["code"], reply["field"]) == ("BAD_VALUE", "seed")
        assert reply["detail"] == f"seed must lie in 0..4294967295, got {seed}"


def test_a_scenario_is_chosen_by_name_from_the_servers_folder_alone(
    start_server: Starter, scenario: Scenario, scenario_path: Any, tmp_path: Any
) -> None:
    root = tmp_path / "root"
    root.mkdir()
    text = scenario_path.read_text()
    (root / "wide.toml").write_text(text.replace("width_px = 64", "width_px = 80"))
    (root / "broken.toml").write_text("[epoch]\nutc = 3\n")
    (tmp_path / "outside.toml").write_text(text)
    (root / "link.toml").symlink_to(tmp_path / "outside.toml")
    running = start_server(scenario, root=root)
    now = scenario.epoch_tai_ns
    with Client(running.address, timeout_s=limit(20.0)) as client:
        assert client.welcome.scenarios == ("broken", "wide")
        for name in ("../outside", "link", "/etc/passwd", "wide.toml", ""):
            with pytest.raises(RemoteError) as caught:
                client.configure(name)
            assert (caught.value.code, caught.value.field) == ("NO_SCENARIO", "scenario")
        with pytest.raises(RemoteError) as caught:
            client.configure("broken")
        # Where the folder lies is the server's affair.
        assert caught.value.code == "BAD_SCENE"
        assert caught.value.detail == "scenario broken.toml [epoch]: utc must be a text, got 3"
        # The old scenario is still there.
        assert client.render(now, "nav").dn.shape == (48, 64)
        assert client.configure("wide").cameras[0].width == 80
        assert client.render(now, "nav").dn.shape == (48, 80)


def test_a_chosen_scenario_may_not_reach_out_of_the_servers_folder(
    start_server: Starter, scenario: Scenario, scenario_path: Any, tmp_path: Any
) -> None:
    root = tmp_path / "root"
    root.mkdir()
    (tmp_path / "secret.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (root / "link.obj").symlink_to(tmp_path / "secret.obj")
    text = scenario_path.read_text()
    box = "model = { box = { size_m = [2.0, 1.0, 1.0], material = { reflectance = 0.5 } } }"
    assert box in text
    for name, model in (("up", "../secret.obj"), ("linked", "link.obj")):
        (root / f"{name}.toml").write_text(text.replace(box, f'model = "{model}"'))
    running = start_server(scenario, root=root)
    with Client(running.address, timeout_s=limit(20.0)) as client:
        for name in ("up", "linked"):
            with pytest.raises(RemoteError, match=r"model: .* leads out of") as caught:
                client.configure(name)
            assert caught.value.code == "BAD_SCENE"
        # The old scenario is still there.
        assert client.render(scenario.epoch_tai_ns, "nav").dn.shape == (48, 64)


def test_the_servers_own_scenario_and_cameras_may_not_reach_out_either(
    scenario_path: Any, tmp_path: Any
) -> None:
    root = tmp_path / "root"
    root.mkdir()
    path = tmp_path / "psf.toml"
    path.write_text(scenario_path.read_text().replace(
        "[camera.nav]", '[camera.nav]\noptics = { psf_image = "psf.npy" }'
    ))  # fmt: skip
    overrides = tmp_path / "sheet.toml"
    overrides.write_text('optics = { psf_image = "psf.npy" }\n')
    np.save(tmp_path / "psf.npy", np.ones((3, 3)))
    with pytest.raises(BridgeError, match=r"optics\.psf_image: .* leads out of"):
        serve(path, root=root)
    found = load_camera_files([f"1={overrides}"], root)[1]
    with pytest.raises(AssetError, match=r"optics\.psf_image: .* leads out of"):
        read_camera(found.where, "1", found.table, found.sun_temperature, found.base)


def test_one_client_chooses_the_scene_and_another_is_told_so(
    start_server: Starter, scenario: Scenario
) -> None:
    running = start_server(scenario)
    now = scenario.epoch_tai_ns
    with Client(running.address, name="first") as first, Client(running.address) as second:
        first.configure(seed=11)
        with pytest.raises(RemoteError) as caught:
            second.configure(seed=12)
        assert caught.value.code == "NOT_OWNER"
        assert caught.value.detail == '"first" chose the scenario; it has not left'
        # Pictures are for both, but the second does not take another scene's for its own.
        assert first.render(now, "nav").seed == 11
        with pytest.raises(Exception, match="another scene now"):
            second.render(now, "nav")
        first.close()
        time.sleep(0.2)
        assert second.configure(seed=12).seed == 12


def satellite(**spacecraft: Any) -> Scenario:
    """A small satellite with solar wings, seen by a camera of its own."""
    return scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "earth": {"shape": "none"},
            "spacecraft": {
                "sat": {"model": "cubesat_12u", "position_icrf_m": [0.0, 0.0, 7e6], **spacecraft}
            },
            "camera": {"nav": {"on": "sat", "position_body_m": [5.0, 0.0, 0.0], "look_at": "sat"}},
        }
    )


def sat_request(scenario: Scenario, joints: dict[str, float], **changes: Any) -> Render:
    pose = SentPose(
        position_m=(0.0, 0.0, 7e6),
        velocity_m_s=(7500.0, 0.0, 0.0),
        q_icrf_from_body_xyzw=(0.0, 0.0, 0.0, 1.0),
        joints=joints,
    )
    shots = (Shot(camera="nav"),)
    start = scenario.epoch_tai_ns
    return Render(id=1, tai_ns=start, cameras=shots, bodies={"sat": pose}, **changes)


def check(scenario: Scenario, asked: Render) -> None:
    """As a server of the scenario checks it."""
    check_request(served_scene(scenario, "none"), asked)


def test_rails_are_told_their_limits_in_metres() -> None:
    scenario = satellite(model="servicer")
    with pytest.raises(BadMessageError) as caught:
        check(scenario, sat_request(scenario, {"finger_1": 0.2}))
    problem = "bodies.sat.joints.finger_1 must lie in 0..0.05 m, got 0.2"
    assert str(caught.value).startswith(problem)


def test_what_a_sent_joint_carries_follows_the_sun_from_where_that_stands() -> None:
    """The tilt alone: what is left is the Sun's height over the plane square to its axis."""
    drives = ["array_roll_left", "array_tilt_left"]
    scenario = satellite(model="servicer", sun_tracking=drives)
    names = [joint.name for joint in scenario.models["sat"].joints]
    free = requested_state(scenario, sat_request(scenario, {})).bodies["sat"].model
    sent = free.angles[names.index(drives[0])] + 0.2
    state = requested_state(scenario, sat_request(scenario, {drives[0]: sent}))
    body = state.bodies["sat"]
    roll, tilt = (body.model.angles[names.index(name)] for name in drives)
    assert roll == sent
    turn = Rotation.from_rotvec([0.0, roll, 0.0])
    face = (turn * Rotation.from_rotvec([tilt, 0.0, 0.0])).apply([0.0, 0.0, -1.0])
    sun = body.pose.R_icrf_from_body.T @ state.sun.seen_from(body.pose.position).direction_icrf
    left = np.arcsin(abs(np.dot(turn.apply([1.0, 0.0, 0.0]), sun)))
    assert left > 0.01
    assert np.arccos(np.dot(face, sun)) == pytest.approx(left, abs=1e-6)


def test_joints_are_turned_as_sent() -> None:
    scenario = satellite()
    names = [joint.name for joint in scenario.models["sat"].joints]
    low, high = scenario.models["sat"].joints[0].limits
    angle = 0.5 * (low + high) + 0.1
    asked = sat_request(scenario, {names[0]: angle})
    check(scenario, asked)
    model = requested_state(scenario, asked).bodies["sat"].model
    assert dict(zip(names, model.angles, strict=True)) == {names[0]: angle, names[1]: 0.0}


def test_a_joint_that_is_not_there_or_cannot_turn_so_far_is_named() -> None:
    scenario = satellite()
    joint = scenario.models["sat"].joints[0]
    with pytest.raises(BadMessageError) as caught:
        check(scenario, sat_request(scenario, {"panel_lef": 0.0}))
    assert caught.value.code == "NO_JOINT"
    assert str(caught.value).startswith(
        'bodies.sat.joints "panel_lef" does not exist here; did you mean "panel_left"?'
    )
    for value in (joint.limits[1] + 0.1, float("nan")):
        with pytest.raises(BadMessageError) as caught:
            check_request(
                served_scene(scenario, "none"), sat_request(scenario, {joint.name: value})
            )
        assert caught.value.code == "BAD_VALUE"
        assert caught.value.field == f"bodies.sat.joints.{joint.name}"
        assert f"must lie in {joint.limits[0]:g}..{joint.limits[1]:g} rad, got" in str(caught.value)
