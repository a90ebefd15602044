"""No cache, a full one and a full disk for results: the first costs time, the last is one line."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simgl.disk_cache import cache_folder, read_arrays, write_arrays
from simgl.gpu.driver_cache import protect_driver_cache
from tests.cli.small_scene import SCENE
from tests.patience import run_to_end

# Of Mesa 22: 2^16 keys of 20 bytes, and their number.
INDEX_BYTES = 65536 * 20 + 8


@pytest.fixture
def mesa(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache folder of Mesa that is not there yet."""
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setenv("MESA_SHADER_CACHE_DISABLE", "false")
    return tmp_path / "cache" / "mesa_shader_cache"


def test_the_blocks_of_the_index_are_allocated_and_its_content_stays(mesa: Path) -> None:
    mesa.mkdir(parents=True)
    with (mesa / "index").open("wb") as index:
        index.truncate(INDEX_BYTES)
        index.seek(700_000)
        index.write(b"a key")
    protect_driver_cache()
    status = (mesa / "index").stat()
    assert status.st_size == INDEX_BYTES
    assert status.st_blocks * 512 >= INDEX_BYTES
    assert (mesa / "index").read_bytes()[700_000:700_005] == b"a key"
    assert os.environ["MESA_SHADER_CACHE_DISABLE"] == "false"


@pytest.mark.parametrize("kind", ["file", "fifo", "link", "folder"])
def test_a_cache_that_is_none_is_not_used(
    kind: str, mesa: Path, caplog: pytest.LogCaptureFixture
) -> None:
    mesa.parent.mkdir()
    if kind == "file":
        mesa.write_text("mine")
    else:
        mesa.mkdir()
        index = mesa / "index"
        if kind == "fifo":
            os.mkfifo(index)
        elif kind == "link":
            index.symlink_to(mesa / "elsewhere")
        else:
            index.mkdir()
    protect_driver_cache()
    assert os.environ["MESA_SHADER_CACHE_DISABLE"] == "true"
    assert "OpenGL compiles its shaders again next time" in caplog.text


def test_a_user_without_a_home_has_no_cache(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def unknown(user: int) -> Any:
        raise KeyError(user)

    for name in ("HOME", "XDG_CACHE_HOME", "MESA_SHADER_CACHE_DIR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("MESA_SHADER_CACHE_DISABLE", "false")
    monkeypatch.setattr("pwd.getpwuid", unknown)
    protect_driver_cache()
    assert os.environ["MESA_SHADER_CACHE_DISABLE"] == "true"
    path = cache_folder("air") / "table.npz"
    assert read_arrays(path) is None
    write_arrays(path, {"table": np.zeros(3)}, "tables are made again")
    assert "no home folder" in caplog.text
    assert "tables are made again" in caplog.text


def test_a_quota_in_the_middle_of_a_cache_file_leaves_nothing(tmp_path: Path) -> None:
    script = (
        "import resource, sys, pathlib, numpy as np\n"
        "from simgl.disk_cache import write_arrays\n"
        "from simgl.gpu.driver_cache import protect_driver_cache\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))\n"
        "write_arrays(pathlib.Path('cache/a.npz'), {'a': np.ones(100_000)}, 'made again')\n"
        "protect_driver_cache()\n"
    )
    environment = {**os.environ, "MESA_SHADER_CACHE_DIR": str(tmp_path)}
    environment.pop("MESA_SHADER_CACHE_DISABLE", None)
    ended = run_to_end([sys.executable, "-c", script], cwd=tmp_path, env=environment)
    assert ended.stderr.splitlines() == [
        "cache: File too large; made again",
        f"{tmp_path}/mesa_shader_cache: File too large; "
        "OpenGL compiles its shaders again next time",
    ]
    assert list((tmp_path / "cache").iterdir()) == []


def small_disk(
    size: str, folder: Path, *arguments: object, **variables: str
) -> subprocess.CompletedProcess[str]:
    """``simgl`` with a file system of its own, so small, at a folder."""
    folder.mkdir()
    mount = f'mount -t tmpfs -o size={size} tmpfs "$0" || exit 99; exec "$@"'
    unshare = shutil.which("unshare")
    if unshare is None:
        pytest.skip("unshare is not installed (apt-get install util-linux)")
    command = [unshare, "--mount", "--map-root-user", "sh", "-c", mount, str(folder)]
    simgl = [sys.executable, "-m", "simgl", *map(str, arguments), "--quiet"]
    environment = {**os.environ, **variables}
    environment.pop("MESA_SHADER_CACHE_DISABLE", None)
    ended = run_to_end([*command, *simgl], env=environment, check=False)
    if ended.returncode == 99 or ended.stderr.startswith("unshare"):
        pytest.skip("this user may not mount a file system")
    return ended


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    return path


@pytest.mark.parametrize("size", ["64k", "1400k"])
def test_a_full_cache_disk_only_costs_time(size: str, scene: Path, tmp_path: Path) -> None:
    out, cache = tmp_path / "out", tmp_path / "cache"
    ended = small_disk(size, cache, "render", scene, "--out", out, MESA_SHADER_CACHE_DIR=str(cache))
    assert ended.returncode == 0, ended.stderr
    assert len(list(out.iterdir())) == 3
    full = f"simgl: {cache}/mesa_shader_cache: No space left on device; "
    # The index fits the larger one; what does not is Mesa's to notice.
    assert ended.stderr.startswith(full) if size == "64k" else not ended.stderr


@pytest.mark.parametrize(
    ("size", "command"),
    [
        ("4k", ["render"]),
        ("16k", ["sequence", "--duration", "60", "--count", "3"]),
    ],
)
def test_a_full_disk_for_results_is_one_line(
    size: str, command: list[str], scene: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    ended = small_disk(size, out, *command, scene, "--out", out / "run")
    assert ended.returncode == 2, ended.stderr
    assert ended.stderr.count("\n") == 1
    assert ended.stderr.startswith(f"simgl: {out}")
    assert "cannot be" in ended.stderr
    assert " full" in ended.stderr or "No space left on device" in ended.stderr
