"""Planes on the way: LIDAR and ranges, and compression that loses nothing."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import zstandard
from simgl_bridge import Client, RemoteError, Shot
from simgl_bridge.message_parts import Plane
from simgl_bridge.plane_compression import decompressed

from simgl import Product, Scenario, Simulator, load_scenario
from simgl.errors import BridgeError, ConfigError
from tests.bridge.harness import SCENARIO, RawLink, Running
from tests.patience import limit

Starter = Callable[..., Running]
EVERY = ("dn", "radiance", "electrons", "depth", "part_id", "range", "lidar_range",
         "lidar_electrons")  # fmt: skip
OF_THERMAL = ("thermal_radiance", "temperature")


@pytest.fixture(scope="module")
def with_lidar(tmp_path_factory: pytest.TempPathFactory) -> Scenario:
    path = tmp_path_factory.mktemp("lidar") / "lidar.toml"
    lidar = "lidar = { pulse_energy_mj = 1000.0 }\n"
    path.write_text(SCENARIO.replace("[camera.nav]\n", f"[camera.nav]\n{lidar}"))
    return load_scenario(path)


@pytest.fixture
def linked(start_server: Starter, with_lidar: Scenario) -> Client:
    return Client(start_server(with_lidar).address, timeout_s=limit(20.0))


def test_lidar_and_range_are_those_of_the_capture(linked: Client, with_lidar: Scenario) -> None:
    """Bit for bit, and told by camera."""
    now = with_lidar.epoch_tai_ns
    with linked as client:
        assert {c.name: c.lidar for c in client.welcome.cameras} == {"nav": True, "side": False}
        assert client.welcome.products == (*EVERY, *OF_THERMAL)
        image = client.render(now, "nav", products=EVERY)
    with Simulator(with_lidar) as simulator:
        products = {Product.LIDAR, Product.TRUTH}
        direct = simulator.capture(with_lidar.at(now), "nav", products)
    assert direct.lidar is not None
    assert direct.truth is not None
    assert np.count_nonzero(direct.lidar.range) > 5
    np.testing.assert_array_equal(image.planes["lidar_range"], direct.lidar.range)
    np.testing.assert_array_equal(image.planes["lidar_electrons"], direct.lidar.electrons)
    np.testing.assert_array_equal(image.planes["range"], direct.truth.range.astype(np.float32))
    assert (image.units["lidar_range"], image.units["lidar_electrons"]) == ("m", "e-")


def test_a_camera_without_a_lidar_is_refused(client: Client, scenario: Scenario) -> None:
    with pytest.raises(RemoteError) as caught:
        client.render(scenario.epoch_tai_ns, "nav", products=("dn", "lidar_range"))
    assert caught.value.field == "cameras[0].products[1]"
    assert str(caught.value).endswith('"lidar_range" needs a LIDAR, which camera "nav" has not')


def test_compressed_images_are_the_same(linked: Client, with_lidar: Scenario) -> None:
    """Of all products and cameras, in one reply."""
    now = with_lidar.epoch_tai_ns
    shots = [Shot(camera="nav", products=EVERY), Shot(camera="side", products=("dn", "depth"))]
    with linked as client:
        assert client.welcome.compressions == ("zstd",)
        plain = client.render_all(now, shots)
        packed = client.render_all(now, shots, compression="zstd")
    assert plain.state_hash == packed.state_hash
    for name, image in plain.items():
        assert list(packed[name].planes) == list(image.planes)
        for product, plane in image.planes.items():
            other = packed[name].planes[product]
            assert (other.dtype, other.tobytes()) == (plane.dtype, plane.tobytes())


def test_a_frame_on_the_wire_is_zstandards_and_said_to_be(
    raw: RawLink, scenario: Scenario, client: Client
) -> None:
    """Without the key a client that knows no compression gets pixels."""
    request: dict[str, Any] = {
        "type": "render",
        "tai_ns": scenario.epoch_tai_ns,
        "cameras": [{"camera": "nav"}],
    }

    def ask(**more: Any) -> tuple[dict[str, Any], bytes]:
        raw.send([b"simgl/1", msgspec.msgpack.encode({**request, **more})])
        _, header, plane = raw.receive()
        (image,) = msgspec.msgpack.decode(header)["images"]
        return image["planes"][0], plane

    announced, pixels = ask(id=1)
    assert announced["compression"] == ""
    assert pixels == client.render(scenario.epoch_tai_ns, "nav").dn.tobytes()
    announced, frame = ask(id=2, compression="zstd")
    assert announced["compression"] == "zstd"
    assert announced["shape"] == [48, 64]
    assert zstandard.ZstdDecompressor().decompress(frame) == pixels
    assert len(frame) < len(pixels)


def test_an_unknown_compression_is_refused_by_both_sides(
    client: Client, raw: RawLink, scenario: Scenario
) -> None:
    now = scenario.epoch_tai_ns
    with pytest.raises(ConfigError, match=r'compression must be "zstd" or empty, got "lzma"'):
        client.render(now, "nav", compression="lzma")
    request = {"type": "render", "id": 3, "tai_ns": now, "cameras": [{"camera": "nav"}]}
    reply = raw.ask_map({**request, "compression": "lzma"})
    assert (reply["code"], reply["field"]) == ("BAD_VALUE", "compression")
    assert reply["detail"].endswith('"lzma" does not exist here; allowed: zstd')


def test_a_plane_of_another_size_is_refused_before_it_is_unpacked() -> None:
    frame = memoryview(zstandard.ZstdCompressor().compress(bytes(1 << 20)))
    with pytest.raises(BridgeError, match='plane "dn" announces 100 bytes and brings 1048576'):
        decompressed("dn", frame, 100)
    with pytest.raises(BridgeError, match='plane "dn" cannot be decompressed'):
        decompressed("dn", memoryview(b"no frame of it"), 100)


def test_older_messages_have_no_compression() -> None:
    """Their planes are pixels."""
    old = {"product": "dn", "dtype": "<u2", "shape": [2, 2], "unit": "DN"}
    assert msgspec.convert(old, Plane).compression == ""


def test_a_client_without_the_package_says_how_to_install_it(tmp_path: Path) -> None:
    program = (
        "import sys; sys.modules['zstandard'] = None\n"
        "from simgl_bridge.plane_compression import available, check_wanted\n"
        "assert available() == ()\n"
        "check_wanted('')\n"
        "check_wanted('zstd')\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.stderr.strip().endswith('"zstd" needs zstandard: pip install "simgl[compression]"')
