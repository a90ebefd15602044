"""The S-function over the C client, run with stub headers of Simulink; never in MATLAB itself."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from simgl_bridge import BodyPose, Client

from simgl import Scenario
from tests.bridge.compiled import CPP, c_object
from tests.patience import run_to_end

STUB = Path(__file__).parent / "simulink_stub"
SOURCE = CPP / "simulink" / "simgl_sfun.c"
POSE = (0.5, -0.25, 40.0, 0.0, 0.0, -0.1, 0.0, 0.0, 0.0, 1.0, 0.25, -0.5, 0.125)


@pytest.fixture(scope="module")
def block(build: Callable[..., Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The S-function as a program, as a mex file would be compiled."""
    source = tmp_path_factory.mktemp("simulink") / SOURCE.name
    shutil.copy(SOURCE, source)
    compiled = c_object(source, "-DMATLAB_MEX_FILE", f"-I{STUB}")
    return build("block", CPP / "simgl.cpp", compiled)


def run(block: Path, address: str, camera: str, height: int, width: int) -> list[str]:
    words = [address, camera, "chaser", str(height), str(width), *map(str, POSE)]
    return run_to_end([str(block), *words]).stdout.splitlines()


def test_the_s_function_gives_the_native_image(
    block: Path, client: Client, scenario: Scenario
) -> None:
    pose = BodyPose(
        position_m=POSE[:3],
        velocity_m_s=POSE[3:6],
        q_icrf_from_body_xyzw=POSE[6:10],
        angular_velocity_rad_s=POSE[10:],
    )
    images = [
        client.render(scenario.epoch_tai_ns + sample * 500_000_000, "nav", {"chaser": pose})
        for sample in range(3)
    ]
    hashes = [image.plane_hash() for image in images]
    assert run(block, client.address, "nav", 48, 64) == hashes
    assert len(set(hashes)) == 3


def test_the_s_function_stops_the_simulation_with_the_reason(block: Path, client: Client) -> None:
    wrong_size = run(block, client.address, "nav", 64, 48)
    assert wrong_size == ["error: [height width] is not the size of the camera"]
    (no_camera,) = run(block, client.address, "nva", 48, 64)
    assert 'NO_CAMERA: cameras[0].camera "nva" does not exist here' in no_camera
