"""Bad input to the command line: exit code 2, one line on stderr, and nothing left behind."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import moderngl
import pytest

from simgl import cli
from simgl.commands import application
from simgl.simulator import Simulator
from tests.cli.small_scene import PINHOLE, SCENE
from tests.patience import run_to_end

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs ``simgl ARGUMENTS`` here; returns exit code, stdout and stderr."""
    # Further commands belong to other packages.
    monkeypatch.setattr(application, "entry_points", lambda group: ())  # noqa: ARG005

    def run(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["simgl", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        code = ended.value.code
        assert isinstance(code, int | None)
        out, err = capsys.readouterr()
        return code or 0, out, err

    return run


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """An output folder with a picture of yesterday in it."""
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "nav.dn.png").write_bytes(b"yesterday")
    return folder


def untouched(folder: Path) -> bool:
    """Whether a folder holds yesterday's picture and nothing else, hidden files included."""
    return (
        os.listdir(folder) == ["nav.dn.png"]
        and (folder / "nav.dn.png").read_bytes() == b"yesterday"
    )


def refused(run: Run, *arguments: object) -> str:
    """The complaint about a command: one line on stderr, exit code 2, silent stdout."""
    code, stdout, stderr = run(*arguments)
    assert code == 2
    assert stdout == ""
    assert stderr.endswith("\n")
    assert stderr.count("\n") == 1
    assert stderr.startswith("simgl: ")
    return stderr.removeprefix("simgl: ").rstrip("\n")


def test_a_missing_scenario(run: Run, tmp_path: Path, out: Path) -> None:
    path = tmp_path / "no.toml"
    message = refused(run, "render", path, "--out", out)
    assert message == f"{path}: cannot be read (No such file or directory)"
    assert untouched(out)


def test_an_unknown_camera(run: Run, scene: Path, out: Path) -> None:
    message = refused(run, "render", scene, "--out", out, "--camera", "nab")
    assert message == (
        f'command line: --camera "nab" is not in {scene}; did you mean "nav"? (allowed: nav)'
    )
    assert untouched(out)


def test_a_bad_epoch(run: Run, scene: Path, out: Path) -> None:
    message = refused(run, "render", scene, "--out", out, "--at", "noon")
    assert message == (
        'command line: --at must be a UTC time such as "2026-03-20T12:00:00", got "noon"'
    )
    message = refused(run, "render", scene, "--out", out, "--at", "2150-01-01")
    assert message == 'command line: --at must lie in the years 1972 to 2099, got "2150-01-01"'
    assert untouched(out)


def test_a_pose_that_is_no_number(run: Run, scene: Path, out: Path) -> None:
    scene.write_text(SCENE.replace("[7.0e6, 0.0, 0.0]", "[7.0e6, nan, 0.0]"))
    message = refused(run, "render", scene, "--out", out)
    expected = f"{scene} [spacecraft.block]: position_icrf_m[1] must be finite, got nan"
    assert message == expected
    assert untouched(out)


def test_more_bits_than_are_packed(run: Run, scene: Path, out: Path) -> None:
    scene.write_text(SCENE.replace("[camera.nav]", "[camera.nav]\nbits = 14"))
    code, _, err = run("render", scene, "--out", out, "--packed")
    assert code == 2
    assert err == ('simgl: command line: --packed packs 12 bits or fewer, camera "nav" has 14\n')
    assert untouched(out)


def test_a_camera_test_of_an_unknown_preset(run: Run, out: Path) -> None:
    code, _, err = run("camera", "test", "mt9m043", "--out", out)
    assert code == 2
    assert err.startswith('simgl: command line: preset: no camera preset "mt9m043"; did you mean ')
    assert err.count("\n") == 1
    assert untouched(out)


def test_a_camera_test_of_a_missing_file(run: Run, out: Path, tmp_path: Path) -> None:
    code, _, err = run("camera", "test", tmp_path / "mine.toml", "--out", out)
    assert code == 2
    assert err == (
        f"simgl: command line: preset: {tmp_path / 'mine.toml'}: cannot be read "
        "(No such file or directory)\n"
    )
    assert untouched(out)


def test_a_scenario_without_a_camera(run: Run, scene: Path, out: Path) -> None:
    scene.write_text(SCENE[: SCENE.index("[camera.nav]")])
    message = refused(run, "render", scene, "--out", out)
    assert message == f"{scene}: camera is missing; an image needs a [camera.NAME]"
    assert untouched(out)


def test_options_of_a_trajectory_that_one_epoch_would_ignore(run: Run, scene: Path) -> None:
    for options in (["--duration", "60", "--count", "3"], ["--workers", "2"], ["--by", "me"]):
        message = refused(run, "assess", scene, *options)
        assert message == "command line: --out is needed for a trajectory and its report"


@pytest.mark.parametrize(
    ("camera", "target", "option"), [("nab", "block", "--camera"), ("nav", "blok", "--target")]
)
def test_an_exposure_for_what_is_not_there_is_refused_before_it_is_drawn(
    run: Run,
    scene: Path,
    monkeypatch: pytest.MonkeyPatch,
    camera: str,
    target: str,
    option: str,
) -> None:
    monkeypatch.setattr("simgl.simulator.Simulator.capture", None)
    message = refused(run, "exposure", scene, "--camera", camera, "--target", target)
    assert message.startswith(f"command line: {option} ")
    assert "did you mean" in message


def test_a_file_in_place_of_the_output_folder(run: Run, scene: Path, tmp_path: Path) -> None:
    file = tmp_path / "taken"
    file.write_text("mine")
    message = refused(run, "render", scene, "--out", file)
    assert message == f"{file}: cannot be written (File exists)"
    message = refused(run, "render", scene, "--out", file / "below")
    assert message == f"{file / 'below'}: cannot be written (Not a directory)"
    assert file.read_text() == "mine"
    assert sorted(os.listdir(tmp_path)) == ["scene.toml", "taken"]


@pytest.fixture
def shared_context(gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch) -> None:
    """Simulators draw in the tests' own context."""
    monkeypatch.setattr("simgl.simulator.Simulator", partial(Simulator, ctx=gl))


def test_a_model_in_the_wrong_unit_is_noted_beside_the_result(
    run: Run, scene: Path, tmp_path: Path
) -> None:
    """Its camera may be inside of it, or see nothing else."""
    corners = ("v 0 0 0", "v 2000 0 0", "v 0 2000 0", "v 0 0 2000")
    (tmp_path / "block.obj").write_text("\n".join([*corners, "f 1 3 2", "f 1 2 4", "f 1 4 3"]))
    box = "model.box = { size_m = [2.0, 2.0, 2.0], material = { reflectance = 0.5 } }"
    scene.write_text(SCENE.replace(box, 'model = "block.obj"'))
    file = tmp_path / "nav.yaml"
    words = ("camera", "export", scene, "--camera", "nav", "--out", file)
    note = '2000 m is not a spacecraft\'s size; 2 m if in millimetres: unit = "mm"'
    assert run(*words) == (0, f"{file}\n", f"simgl: note: block: {note}\n")
    assert run(*words, "--quiet") == (0, f"{file}\n", "")


@pytest.mark.usefixtures("shared_context")
def test_a_camera_inside_a_body(run: Run, scene: Path, out: Path) -> None:
    scene.write_text(SCENE.replace(PINHOLE, "position_icrf_m = [7000000.0, 0.25, 0.5]"))
    message = refused(run, "render", scene, "--out", out)
    assert message.endswith(
        '[camera.nav]: position is inside the body of "block" '
        "(at 0.000, 0.250, 0.500 m in its axes)"
    )
    assert untouched(out)


@pytest.mark.usefixtures("shared_context")
def test_a_sequence_without_a_frame_leaves_no_folder_and_may_be_another_next_time(
    run: Run, scene: Path, tmp_path: Path
) -> None:
    inside = SCENE.replace(PINHOLE, "position_icrf_m = [7000000.0, 0.25, 0.5]")
    moved = "velocity_icrf_m_s = [0.0, 0.0, 1.0]\nmodel.box"
    scene.write_text(inside.replace("model.box", moved))
    out = tmp_path / "new" / "out"
    for duration in (60, 40):
        message = refused(
            run, "sequence", scene, "--out", out, "--duration", duration, "--count", 2
        )
        assert 'position is inside the body of "block"' in message
        assert not out.parent.exists()


@pytest.mark.usefixtures("shared_context")
def test_a_camera_below_the_ground(run: Run, scene: Path, out: Path) -> None:
    text = SCENE.replace('shape = "none"', 'shape = "sphere"\nradius_km = 6371.0\nalbedo = 0.3')
    scene.write_text(text.replace(PINHOLE, "position_icrf_m = [6.37e6, 0.0, 20.0]"))
    message = refused(run, "render", scene, "--out", out)
    assert message.endswith("[camera.nav]: position is 1000 m below the Earth's surface")
    assert untouched(out)


@pytest.mark.parametrize(
    ("arguments", "mentions"),
    [
        ("render", ["missing argument", "simgl render --help"]),
        ("render scene.toml", ["missing option '--out'", "simgl render --help"]),
        ("rendre", ["no such command 'rendre'", "simgl --help"]),
        ("render scene.toml --out x --fps 3", ["no such option: --fps", "simgl render --help"]),
        ("render scene.toml --out", ["'--out' requires an argument"]),
        ("render scene.toml --out x --draw -1", ["--draw", "0", "4294967295", "-1"]),
        ("render scene.toml --out x --draw few", ["--draw", "few"]),
        ("bench --frames 2", ["--frames", "5", "2"]),
        ("sequence scene.toml --out x --duration long", ["--duration", "long"]),
        ("sequence scene.toml --out x --event noon", ["--event", "noon", "umbra_entry"]),
    ],
)
def test_wrong_words_are_told_in_one_line_with_what_is_allowed(
    run: Run, arguments: str, mentions: list[str]
) -> None:
    message = refused(run, *arguments.split())
    assert message.startswith("command line: ")
    for mention in mentions:
        assert mention in message


def test_no_word_at_all_prints_the_help_alone(run: Run) -> None:
    # The exit status is that of the installed version of Typer.
    _, stdout, stderr = run()
    assert "Usage: simgl" in stdout
    assert stderr == ""


@pytest.mark.parametrize("command", ["doctor", "render", "bench", "view", "camera test"])
def test_every_command_has_help_with_an_example(run: Run, command: str) -> None:
    code, stdout, _ = run(*command.split(), "--help")
    assert code == 0
    assert f"Example: simgl {command}" in stdout


def test_the_module_runs_as_a_program_and_fails_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "no.toml"
    ended = run_to_end(
        [sys.executable, "-m", "simgl", "render", str(path), "--out", str(tmp_path / "out")],
        check=False,
    )
    assert ended.returncode == 2
    assert ended.stdout == ""
    assert ended.stderr == f"simgl: {path}: cannot be read (No such file or directory)\n"
    assert not (tmp_path / "out").exists()
