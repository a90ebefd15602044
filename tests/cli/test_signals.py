"""A signal ends the command line with its own status and at most one line; nothing half is left."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from simgl.sequence.journal import rows_written
from tests.orphans import Guard
from tests.patience import limit, run_to_end

# Sends itself a signal at the n-th function call: any moment of the imports and of the work.
SIGNAL_AT_CALL = """
import os, sys
from simgl.cli import main
left, number = int(sys.argv[1]), int(sys.argv[2])
sys.argv = ["simgl", *sys.argv[3:]]
def count(frame, event, argument):
    global left
    left -= 1
    if left == 0:
        sys.setprofile(None)
        os.kill(os.getpid(), number)
sys.setprofile(count)
main()
"""
# Sends itself a signal within a thousand function calls after there is the folder for its results.
SIGNAL_WITH_FOLDER = """
import os, sys
from simgl.cli import main
folder, number = sys.argv[1], int(sys.argv[2])
sys.argv = ["simgl", *sys.argv[3:]]
calls = 0
def look(frame, event, argument):
    global calls
    calls += 1
    if calls % 1000 == 0 and os.path.isdir(folder):
        sys.setprofile(None)
        os.kill(os.getpid(), number)
sys.setprofile(look)
main()
"""
ENDED = {
    signal.SIGINT: (130, "simgl: interrupted"),
    signal.SIGTERM: (143, "simgl: ended by SIGTERM"),
    signal.SIGHUP: (129, "simgl: ended by SIGHUP"),
}


def signalled(
    moment: int | Path, number: signal.Signals, *arguments: object
) -> subprocess.CompletedProcess[str]:
    """The command line, sent a signal; checked for its one line.

    moment : the number of a function call, or a folder whose first moment it is
    """
    script = SIGNAL_WITH_FOLDER if isinstance(moment, Path) else SIGNAL_AT_CALL
    command = [sys.executable, "-c", script, str(moment), str(int(number))]
    ended = run_to_end([*command, *map(str, arguments)], check=False)
    status, line = ENDED[number]
    assert ended.returncode == status, ended.stderr
    assert ended.stderr.startswith(line)
    assert ended.stderr.count("\n") == 1
    return ended


# The signal module itself, typer, numpy, ..., OpenGL, and the work: 2.5 million calls in all.
@pytest.mark.parametrize(
    ("call", "number"),
    [
        (30, signal.SIGINT),
        (300, signal.SIGINT),
        (2_000, signal.SIGINT),
        (10_000, signal.SIGINT),
        (50_000, signal.SIGTERM),
        (150_000, signal.SIGHUP),
        (400_000, signal.SIGINT),
        (1_200_000, signal.SIGTERM),
        (1_700_000, signal.SIGINT),
        (2_200_000, signal.SIGINT),
    ],
)
def test_a_signal_at_any_moment_is_one_line(
    call: int, number: signal.Signals, scene: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    assert not signalled(call, number, "render", scene, "--out", out).stdout
    assert not out.exists()


@pytest.mark.parametrize(
    "command",
    [
        ("render", "SCENE"),
        ("sequence", "SCENE", "--duration", "60", "--count", "2"),
        ("assess", "SCENE", "--target", "block", "--duration", "60", "--count", "2"),
        ("thermal", "SCENE", "--duration", "60"),
        ("model", "turntable", "wedge"),
        ("camera", "test", "ideal"),
    ],
)
def test_a_command_that_ends_before_its_first_result_leaves_no_folder(
    command: tuple[str, ...], scene: Path, tmp_path: Path
) -> None:
    scene.write_text(scene.read_text().replace("position_icrf_m = [7.0e6, 0.0, 20.0]", PLACED))
    outer = tmp_path / "new"
    out = outer / "out"
    arguments = [str(scene) if word == "SCENE" else word for word in command]
    signalled(out, signal.SIGINT, *arguments, "--out", out, "--quiet")
    assert not outer.exists()


def test_an_interrupted_sequence_says_what_there_is_and_how_to_go_on(
    scene: Path, tmp_path: Path
) -> None:
    scene.write_text(scene.read_text().replace("position_icrf_m = [7.0e6, 0.0, 20.0]", PLACED))
    out = tmp_path / "out"
    arguments = ["sequence", scene, "--out", out, "--duration", "60", "--count", "400"]
    arguments.append("--quiet")
    # The start takes 2.6 million calls, a frame 6,000.
    line = signalled(4_000_000, signal.SIGINT, *arguments).stderr
    match = re.fullmatch(
        r"simgl: interrupted; (\d+) of 400 frames are kept in (\S+), "
        r"the same command goes on from there\n",
        line,
    )
    assert match, line
    assert match[2] == str(out)
    assert 0 < int(match[1]) < 400
    assert int(match[1]) == rows_written(out)
    assert not list(out.rglob(".*"))


PLACED = "position_icrf_m = [7.0e6, 0.0, 20.0]"


def python(script: str, **options: Any) -> subprocess.CompletedProcess[str]:
    """A short program."""
    return run_to_end([sys.executable, "-c", script], check=False, **options)


def test_a_signal_that_a_destructor_would_swallow_ends_the_process() -> None:
    ended = python(
        "import os, signal\n"
        "from simgl.interruption import end_by_signals\n"
        "end_by_signals()\n"
        "class Last:\n"
        "    def __del__(self):\n"
        "        os.kill(os.getpid(), signal.SIGINT)\n"
        "        sum(range(10))\n"
        "Last()\n"
        "print('went on')\n"
    )
    assert (ended.returncode, ended.stdout) == (130, "")
    assert ended.stderr == "simgl: interrupted\n"


def test_a_second_signal_does_not_wait_for_the_clean_up(tmp_path: Path) -> None:
    half = tmp_path / "half.png"
    half.write_text("half")
    ended = python(
        "import os, signal, time, pathlib\n"
        "from simgl import interruption\n"
        "interruption.end_by_signals()\n"
        f"interruption.unfinished_files.add(pathlib.Path({str(half)!r}))\n"
        "try:\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n"
        "    time.sleep(1.0)\n"
        "finally:\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n"
        "    time.sleep(1000.0)\n"
    )
    assert (ended.returncode, ended.stderr) == (130, "simgl: interrupted\n")
    assert not half.exists()


def test_a_clean_up_without_end_is_ended() -> None:
    ended = python(
        "import os, signal, threading\n"
        "from simgl import interruption\n"
        "interruption.end_by_signals()\n"
        "work = threading.Event()\n"
        "try:\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n"
        "finally:\n"
        "    work.wait()\n"
    )
    assert (ended.returncode, ended.stderr) == (130, "simgl: interrupted\n")


def test_a_signal_that_was_ignored_stays_so() -> None:
    ended = python(
        "import os, signal\n"
        "from simgl.interruption import end_by_signals\n"
        "end_by_signals()\n"
        "os.kill(os.getpid(), signal.SIGHUP)\n"
        "print('went on')\n",
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN),
    )
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "went on\n", "")


def test_a_fault_of_native_code_prints_the_stack() -> None:
    ended = python(
        "import os, signal\n"
        "from simgl.interruption import end_by_signals\n"
        "end_by_signals()\n"
        "os.kill(os.getpid(), signal.SIGSEGV)\n"
    )
    assert ended.returncode == -signal.SIGSEGV
    assert "Fatal Python error: Segmentation fault" in ended.stderr


@pytest.mark.parametrize(
    "command",
    ["--version", "--help", "render --help", "camera", "doctor --json", "model check wedge"],
)
def test_a_reader_that_leaves_is_no_error(command: str) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as pipe:
        ended = subprocess.run(
            [sys.executable, "-m", "simgl", *command.split()],
            stdout=pipe,
            stderr=subprocess.PIPE,
            timeout=limit(60.0),
            check=False,
        )
    assert ended.returncode == 128 + signal.SIGPIPE
    assert ended.stderr == b""


@pytest.mark.parametrize("command", ["--version", "doctor --json"])
def test_a_full_disk_behind_stdout_is_one_line(command: str) -> None:
    with Path("/dev/full").open("w") as full:
        ended = subprocess.run(
            [sys.executable, "-m", "simgl", *command.split()],
            stdout=full,
            stderr=subprocess.PIPE,
            timeout=limit(60.0),
            check=False,
        )
    assert ended.returncode == 2
    assert ended.stderr == b"simgl: standard output: cannot be written (No space left on device)\n"


def test_what_a_killed_test_run_leaves_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SIMGL_TEST_RUN", "")
    guard = Guard()
    with subprocess.Popen(["sleep", "1000"], start_new_session=True) as left:
        guard.end()
        assert left.wait(limit(10.0)) == -signal.SIGKILL
