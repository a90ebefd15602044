"""Clients for Node, Java, Julia and MATLAB (in Octave), written from the page of the protocol."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from simgl_bridge import BodyPose, Client

from simgl import Scenario
from tests.patience import run_to_end

ROOT = Path(__file__).parents[2]
CLIENTS = ROOT / "examples" / "bridge" / "clients"
NODE_MODULES = ROOT / ".venv" / "node" / "node_modules"
JARS = [
    Path("/usr/share/java") / f"{name}.jar"
    for name in (
        "jeromq",
        "msgpack-core",
        "msgpack-jackson",
        "jackson-core",
        "jackson-annotations",
        "jackson-databind",
    )
]


def node_command(folder: Path) -> list[str]:
    if shutil.which("node") is None or not (NODE_MODULES / "zeromq").is_dir():
        line = "npm install --prefix .venv/node zeromq@6 @msgpack/msgpack@3"
        pytest.skip(f"needs Node with its modules: {line}")
    # Node looks for modules from a program's folder upwards.
    (folder / "node_modules").symlink_to(NODE_MODULES)
    return ["node", str(shutil.copy(CLIENTS / "client.mjs", folder))]


def java_command(folder: Path) -> list[str]:
    if shutil.which("javac") is None or not all(jar.exists() for jar in JARS):
        pytest.skip("needs Debian's default-jdk-headless, libjeromq-java and libmsgpack-java")
    class_path = ":".join(map(str, JARS))
    source = str(CLIENTS / "SimglClient.java")
    run_to_end(["javac", "-Xlint:all", "-Werror", "-cp", class_path, "-d", str(folder), source])
    return ["java", "-cp", f"{class_path}:{folder}", "SimglClient"]


def octave_command(folder: Path) -> list[str]:
    if shutil.which("octave-cli") is None or not all(jar.exists() for jar in JARS):
        pytest.skip("needs Debian's octave, default-jdk-headless, libjeromq-java, libmsgpack-java")
    lines = [f"javaaddpath('{jar}');" for jar in JARS]
    lines += [f"addpath('{CLIENTS}');", "words = argv();", "simgl_client(words{end});"]
    (folder / "run.m").write_text("\n".join(lines))
    return ["octave-cli", "--norc", "--quiet", str(folder / "run.m")]


def julia_command(folder: Path) -> list[str]:
    loads = ["julia", "-e", "using MsgPack, ZMQ"]
    if shutil.which("julia") is None or subprocess.run(loads, capture_output=True).returncode:
        pytest.skip('needs Julia with its packages: using Pkg; Pkg.add(["ZMQ", "MsgPack"])')
    return ["julia", str(shutil.copy(CLIENTS / "client.jl", folder))]


@pytest.mark.parametrize("command", [node_command, java_command, octave_command, julia_command])
def test_other_languages_get_the_native_image(
    command: Callable[[Path], list[str]], client: Client, scenario: Scenario, tmp_path: Path
) -> None:
    program = command(tmp_path)
    pose = BodyPose(
        position_m=(0.5, -0.25, 40.0),
        velocity_m_s=(0.0, 0.0, -0.1),
        q_icrf_from_body_xyzw=(0.0, 0.0, 0.0, 1.0),
    )
    image = client.render(scenario.epoch_tai_ns, "nav", {"chaser": pose})
    total = image.dn.sum(dtype=np.int64)
    shown = run_to_end([*program, client.address]).stdout.strip()
    assert shown == f"64 x 48, sum {total}, {image.state_hash}"
