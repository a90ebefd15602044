"""Headless contexts: both backends draw, and every way to fail names its reason and its remedy."""

from __future__ import annotations

import ctypes.util
import os
import sys
from pathlib import Path

import pytest

from simgl.errors import ContextError
from simgl.gpu import context
from simgl.gpu.context import open_context, temporary_context
from tests.gpu.osmesa import needs_osmesa
from tests.patience import run_to_end

PROBE = """
import sys
from simgl.errors import ContextError
from simgl.gpu.context import open_context, temporary_context
from tests.gpu.osmesa import needs_osmesa
from tests.patience import limit
try:
    ctx = open_context(sys.argv[1])
    print("opened", ctx.version_code)
    ctx.release()
except ContextError as error:
    print(error.reason, "|", error.remedy)
"""


def probe(backend: str, **environment: str) -> str:
    """What opening a context says in a process with these environment variables."""
    run = run_to_end([sys.executable, "-c", PROBE, backend], env={**os.environ, **environment})
    return run.stdout.strip()


def test_egl_gives_at_least_opengl_33() -> None:
    with temporary_context("egl") as ctx:
        assert ctx.version_code >= 330


@needs_osmesa
def test_osmesa_stands_in_where_egl_has_no_vendor() -> None:
    assert probe("auto", __EGL_VENDOR_LIBRARY_FILENAMES="/nowhere.json").startswith("opened")


@needs_osmesa
def test_osmesa_renders_the_same_image() -> None:
    script = (
        "import hashlib; from tests.scenes import *; from simgl.gpu.context import open_context\n"
        "ball = {'sphere': {'radius_m': 1.0, 'material': lambert(0.5)}}\n"
        "s = scene({'b': {'model': ball, 'position_icrf_m': [0, 0, 0]}},\n"
        "          {'position_icrf_m': [0, -90, 9], 'look_at': 'b'})\n"
        "import sys; ctx = open_context(sys.argv[1]); image = radiance(ctx, s)\n"
        "assert image.max() > 20; print(hashlib.sha256(image.tobytes()).hexdigest())"
    )
    root = Path(__file__).resolve().parents[2]
    digests = {
        run_to_end([sys.executable, "-c", script, backend], cwd=root).stdout
        for backend in ("egl", "osmesa")
    }
    assert len(digests) == 1


def test_no_vendor_is_named() -> None:
    said = probe("egl", __EGL_VENDOR_LIBRARY_FILENAMES="/nowhere.json")
    assert said == (
        "EGL knows no vendor (no file in glvnd/egl_vendor.d) or no device | apt-get install "
        "libegl-mesa0, or install the GPU driver's EGL library"
    )


def test_missing_dri_drivers_are_named() -> None:
    said = probe("egl", LIBGL_DRIVERS_PATH="/nowhere", GBM_BACKENDS_PATH="/nowhere")
    if said.startswith("opened"):
        pytest.skip("this driver does not load from LIBGL_DRIVERS_PATH")
    assert "has no working driver" in said
    assert "apt-get install libgl1-mesa-dri" in said


def test_a_version_too_low_is_named() -> None:
    said = probe("egl", MESA_GL_VERSION_OVERRIDE="2.1")
    if said.startswith("opened"):
        pytest.skip("this driver does not obey MESA_GL_VERSION_OVERRIDE")
    assert "offers no OpenGL 3.3 core, its version is too low" in said
    assert "LIBGL_ALWAYS_SOFTWARE=1" in said


def test_a_wrong_device_is_named() -> None:
    with pytest.raises(
        ContextError, match=r"EGL device 99 does not exist, there are \d+ .*SIMGL_D"
    ):
        open_context("egl", 99)


def test_the_device_comes_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SIMGL_BACKEND", raising=False)
    monkeypatch.setenv("SIMGL_DEVICE", "0")
    with temporary_context() as ctx:
        assert ctx.version_code >= 330
    monkeypatch.setenv("SIMGL_DEVICE", "99")
    with pytest.raises(ContextError, match="EGL device 99 does not exist"):
        open_context()
    monkeypatch.setenv("SIMGL_DEVICE", "first")
    with pytest.raises(ContextError) as caught:
        open_context()
    assert caught.value.reason == 'SIMGL_DEVICE is not a device index: "first"'
    assert caught.value.remedy == "set it to 0, 1, ..."


def test_a_wrong_backend_is_named() -> None:
    with pytest.raises(ContextError, match='no backend "glx"; choose one of auto, egl, osmesa'):
        open_context("glx")


@pytest.mark.parametrize(
    ("missing", "package"), [("EGL", "libegl1"), ("GL", "libgl1"), ("OSMesa", "libosmesa6")]
)
def test_a_missing_library_is_named(
    monkeypatch: pytest.MonkeyPatch, missing: str, package: str
) -> None:
    if missing == "OSMesa":
        monkeypatch.setattr(ctypes.util, "find_library", lambda name: f"/nowhere/lib{name}.so")
        with pytest.raises(ContextError, match=f"cannot be loaded.*apt-get install {package}"):
            open_context("osmesa")
        return
    real = context._library
    monkeypatch.setattr(
        context, "_library", lambda name, file: None if name == missing else real(name, file)
    )
    error = context._why_egl_fails(0, ValueError("any"))
    assert error.reason == f"lib{missing}.so.1 is missing"
    assert error.remedy == f"apt-get install {package}"
