"""ROS 2 in an environment of its own: python -m tools.ros_environment FOLDER

Its Python packages are wheels. The type of /tf is not among them; it is generated and compiled as
ROS does it (needs g++). Tests of the node on rclpy look for the environment in ``.venv/ros``.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
# What a machine that built the wheels wrote into their CMake files.
_FOREIGN = re.compile(r'/opt/python/[^";]*?/(?:include/python[\d.]+|numpy/_core/include)')


def main() -> None:
    """Make the environment that the command line names."""
    (folder,) = (Path(word).resolve() for word in sys.argv[1:])
    venv.create(folder, with_pip=True)
    python = folder / "bin" / "python"
    pip = [str(python), "-m", "pip", "install", "-q", "--disable-pip-version-check"]
    # Tests run with simgl's packages and these: one numpy for both.
    wanted = ["-r", str(HERE / "requirements.txt"), "-c", str(ROOT / "constraints.txt")]
    subprocess.run([*pip, *wanted, "numpy"], check=True)
    _mend_paths(folder, python)
    _compile_frames(folder, python)


def _mend_paths(folder: Path, python: Path) -> None:
    """Let the CMake files of the wheels name this machine's headers."""
    folders = "sysconfig.get_path('include'), numpy.get_include()"
    program = f"import numpy, sysconfig; print(*({folders}), sep='\\n')"
    said = subprocess.run([python, "-c", program], check=True, capture_output=True, text=True)
    of_python, of_numpy = said.stdout.splitlines()

    def local(matched: re.Match[str]) -> str:
        return of_numpy if "numpy" in matched[0] else of_python

    for path in (folder / "share").rglob("*.cmake"):
        text = path.read_text()
        if (mended := _FOREIGN.sub(local, text)) != text:
            path.write_text(mended)


def _compile_frames(folder: Path, python: Path) -> None:
    """Generate, compile and install tf2_msgs."""
    # The generators run as programs of the environment.
    path = f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}"
    variables = os.environ | {"PATH": path, "AMENT_PREFIX_PATH": str(folder)}
    cmake = str(folder / "bin" / "cmake")
    settings = {
        "CMAKE_INSTALL_PREFIX": folder,
        "CMAKE_PREFIX_PATH": folder,
        "Python3_EXECUTABLE": python,
        "BUILD_TESTING": "OFF",
    }
    with tempfile.TemporaryDirectory() as build:
        commands = (
            [cmake, "-G", "Ninja", "-S", str(HERE / "tf2_msgs"), "-B", build]
            + [f"-D{name}={value}" for name, value in settings.items()],
            [cmake, "--build", build, "--target", "install"],
        )
        for command in commands:
            done = subprocess.run(
                command, check=False, env=variables, capture_output=True, text=True
            )
            if done.returncode:
                raise SystemExit(f"{done.stdout[-2000:]}\n{done.stderr[-2000:]}")


if __name__ == "__main__":
    main()
