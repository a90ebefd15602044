"""The shared library of an FMU, where a C++ compiler and ZeroMQ's header are installed.

The library is linked with the libzmq that pyzmq brings, which is then packed beside it: importers
need none of their own.
"""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import zmq

from simgl.errors import OutputError

# Longer than any compiler takes for two thousand lines [s].
_PATIENCE = 300.0
# Architectures as FMI 3.0 calls them, from what Linux calls them.
_ARCHITECTURES = {"x86_64": "x86_64", "aarch64": "aarch64"}


@dataclass(frozen=True, kw_only=True)
class Compilers:
    """The compilers for C and C++, and the libraries that the FMU brings along.

    libraries : libzmq first; empty where the system's is linked, which importers then need
    """

    c: str
    cpp: str
    libraries: tuple[Path, ...]


def fmi_platform() -> str | None:
    """The name of this platform in FMI 3.0; None where no binary is made."""
    architecture = _ARCHITECTURES.get(platform.machine())
    return f"{architecture}-linux" if sys.platform == "linux" and architecture else None


def find_compilers(folder: Path) -> Compilers | str:
    """The compilers, or in one line what is missing.

    folder : for a program to try them with
    """
    if fmi_platform() is None:
        return "binaries are made on Linux for x86-64 and aarch64 only"
    c = shutil.which(os.environ.get("CC", "cc")) or shutil.which("gcc")
    cpp = shutil.which(os.environ.get("CXX", "c++")) or shutil.which("g++")
    if c is None or cpp is None:
        return "no C++ compiler (Debian: g++)"
    probe = folder / "probe.cpp"
    probe.write_text("#include <string>\n#include <zmq.h>\nint main() { return 0; }\n")
    if _run([cpp, "-std=c++17", "-c", str(probe), "-o", str(folder / "probe.o")]).returncode:
        return "no header of ZeroMQ to compile with (Debian: libzmq3-dev)"
    return Compilers(c=c, cpp=cpp, libraries=_bundled_libraries())


def compile_fmu(
    compilers: Compilers, c_files: Sequence[Path], cpp_files: Sequence[Path], library: Path
) -> None:
    """Compile the sources, which include each other from their own folder, and link them.

    Raises OutputError with the compiler's first error.
    """
    objects = []
    for compiler, standard, sources in (
        (compilers.c, "c99", c_files),
        (compilers.cpp, "c++17", cpp_files),
    ):
        for source in sources:
            objects.append(str(library.parent / f"{source.stem}.o"))
            command = [compiler, f"-std={standard}", "-O3", "-fPIC", "-fvisibility=hidden"]
            _check(_run([*command, "-c", str(source), "-o", objects[-1]]))
    link = [compilers.cpp, "-shared", *objects, "-o", str(library)]
    # C++ as it is here, also for importers with an older one; ZeroMQ from beside the library.
    link += ["-static-libstdc++", "-static-libgcc", "-Wl,--exclude-libs,ALL"]
    link += ["-Wl,-rpath,$ORIGIN", "-Wl,--no-undefined", "-lm"]
    link += [str(compilers.libraries[0])] if compilers.libraries else ["-lzmq"]
    # What libzmq needs itself lies in its own folder, too.
    link += [f"-Wl,-rpath-link,{path.parent}" for path in compilers.libraries[:1]]
    _check(_run(link))


def _bundled_libraries() -> tuple[Path, ...]:
    """What the wheel of pyzmq brings: libzmq and the libraries that only it needs."""
    folder = Path(zmq.__file__).resolve().parents[1] / "pyzmq.libs"
    ours = sorted(folder.glob("libzmq*.so*"))
    return (*ours, *sorted(set(folder.glob("*.so*")) - set(ours))) if len(ours) == 1 else ()


def _run(command: Sequence[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, capture_output=True, text=True, timeout=_PATIENCE, check=False, errors="replace"
    )


def _check(run: subprocess.CompletedProcess[str]) -> None:
    if run.returncode:
        lines = [line for line in run.stderr.splitlines() if "error" in line] or ["no message"]
        raise OutputError(f"{run.args[0]} does not compile the FMU: {lines[0]}")
