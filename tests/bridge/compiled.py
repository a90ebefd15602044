"""Programs of the C++ and C client, built with the system's compiler and libzmq."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

CPP = Path(__file__).parents[2] / "bridge" / "cpp"
COMPILER = shutil.which(os.environ.get("CXX", "g++"))
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"]
_CPP = [str(COMPILER), "-std=c++17", "-O1", *WARNINGS, f"-I{CPP}"]


def what_is_missing(folder: Path) -> str:
    """What is missing to compile a client; empty where nothing is."""
    if COMPILER is None:
        return "no C++ compiler (Debian: g++)"
    probe = folder / "probe.cpp"
    probe.write_text("#include <zmq.h>\nint main() { zmq_ctx_term(zmq_ctx_new()); }\n")
    tried = subprocess.run([COMPILER, str(probe), "-o", str(folder / "p"), "-lzmq"], check=False)
    return "no libzmq to compile with (Debian: libzmq3-dev)" if tried.returncode else ""


def cpp_program(folder: Path, name: str, *sources: Path) -> Path:
    """A program of C++ sources and object files, linked with libzmq.

    folder : for the program, and for the client's own sources, which take seconds: compiled once
    """
    program = folder / name
    parts = [
        _compiled_once(source, folder) if source.parent == CPP else source for source in sources
    ]
    subprocess.run([*_CPP, *map(str, parts), "-o", str(program), "-lzmq"], check=True)
    return program


def _compiled_once(source: Path, folder: Path) -> Path:
    compiled = folder / f"{source.stem}.o"
    if not compiled.exists():
        subprocess.run([*_CPP, "-c", str(source), "-o", str(compiled)], check=True)
    return compiled


def c_object(source: Path, *options: str) -> Path:
    """A source in plain C, compiled."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    assert compiler is not None
    compiled = source.with_suffix(".o")
    command = [compiler, "-std=c99", *WARNINGS, f"-I{CPP}", *options]
    subprocess.run([*command, "-c", str(source), "-o", str(compiled)], check=True)
    return compiled


def c_program(build: Callable[..., Path], folder: Path, text: str) -> Path:
    """A program in plain C over the C interface."""
    source = folder / "user.c"
    source.write_text(text)
    return build("user", CPP / "simgl.cpp", c_object(source))
