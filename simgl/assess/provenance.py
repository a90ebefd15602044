"""Who assessed what, when, and with what: the first lines of a report."""

from __future__ import annotations

import getpass
import hashlib
import platform
import shlex
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

from simgl import __version__
from simgl.assess.trajectory_assessment import Assignment
from simgl.scenario.scenario import Scenario

_PACKAGE = Path(__file__).resolve().parents[1]


def provenance(work: Assignment, renderer: str, by: str | None = None) -> dict[str, str]:
    """What a report needs to be traced and repeated, by name.

    renderer : of OpenGL
    by : who assessed; the login name if not given
    """
    scenario, camera = work.scenario, work.scenario.cameras[work.camera]
    version = __version__
    if commit := git_commit(_PACKAGE.parent):
        version += f", git {commit}"
    d, lens = camera.detector, camera.lens
    return {
        "Assessed by": by or _login(),
        "Date": f"{datetime.now(UTC):%Y-%m-%d %H:%M:%S} UTC",
        "simgl": version,
        "Renderer": renderer,
        "Python": f"{platform.python_version()}, {platform.platform(terse=True)}",
        "Command": shlex.join([_program(), *sys.argv[1:]]),
        "Scenario": str(scenario.source or scenario.name),
        "Camera": f"{work.camera}: {d.width} x {d.height} px of {1e6 * d.pixel_pitch:g} µm, "
        f"{1e3 * lens.focal_length:g} mm, f/{lens.f_number:g}, "
        f"{1e3 * camera.exposure_time:g} ms, {d.bits} bits",
        "Target": work.target,
        "Seed of the noise": str(scenario.seed),
        "SHA-256 of all inputs": scenario_digest(scenario),
    }


def input_files(scenario: Scenario) -> dict[str, str]:
    """SHA-256 of each file that a scenario was read from: itself, models, presets, trajectories."""
    return {_shown(path): digest for path, digest in sorted(scenario.inputs.items())}


def _program() -> str:
    name = Path(sys.argv[0]).name
    return "simgl" if name == "__main__.py" else name


def scenario_digest(scenario: Scenario) -> str:
    """One hash of all files that a scenario was read from, names left out."""
    digests = sorted(scenario.inputs.values())
    return hashlib.sha256("\n".join(digests).encode()).hexdigest()


def _shown(path: Path) -> str:
    resolved = path.resolve()
    for root in (_PACKAGE, _PACKAGE.parent, Path.cwd()):
        if resolved.is_relative_to(root):
            return resolved.relative_to(root).as_posix()
    return str(path)


def _login() -> str:
    try:
        return f"{getpass.getuser()} on {platform.node()}"
    except (KeyError, OSError):
        return f"an unnamed user on {platform.node()}"


def git_commit(folder: Path) -> str | None:
    """The commit of a checkout, marked where files differ from it; None outside a checkout."""
    if not (folder / ".git").exists():
        return None
    try:
        commit, changes = (
            subprocess.run(
                ["git", "-C", str(folder), *arguments],
                capture_output=True,
                text=True,
                timeout=10.0,
                check=True,
            ).stdout.strip()
            for arguments in (
                ["rev-parse", "--short=12", "HEAD"],
                ["status", "--porcelain", "--untracked-files=no"],
            )
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return f"{commit} with changes" if changes else commit
