"""An FMU file: model description, sources, and a binary where one can be compiled."""

from __future__ import annotations

import hashlib
import re
import tempfile
import zipfile
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path

from simgl.errors import AssetError, ConfigError, did_you_mean
from simgl.output import check_writable, complete_file
from simgl.scenario.scenario import Scenario
from simgl_bridge.bind_address import DEFAULT_ADDRESS
from simgl_bridge.fmu.compiler import compile_fmu, find_compilers, fmi_platform
from simgl_bridge.fmu.model_description import build_description, model_description
from simgl_bridge.fmu.model_header import model_header
from simgl_bridge.fmu.variables import CameraModel, Variable, variables

C_FILES = ("simgl_fmu.c", "simgl_fmu_server.c", "simgl_fmu_unsupported.c")
CPP_FILES = ("simgl.cpp",)
_HEADERS = (
    "simgl.h",
    "simgl.hpp",
    "simgl_fmu_server.h",
    "fmi3Functions.h",
    "fmi3FunctionTypes.h",
    "fmi3PlatformTypes.h",
)
_MODEL_HEADER = "simgl_fmu_model.h"
# Equal FMUs have equal bytes.
_ZIP_DATE = (1980, 1, 1, 0, 0, 0)
_LICENSE = """\
simgl and the code of this FMU: Apache-2.0, Copyright 2026 the simgl founders.
The headers of FMI 3.0 in sources (fmi3*.h): 2-Clause BSD License, Copyright (C) 2008-2011 MODELISAR
consortium, 2012-2023 Modelica Association Project "FMI"; the text is at the head of each.
"""
_LIBRARIES_LICENSE = """\
libzmq beside the binary: Mozilla Public License 2.0, libsodium: ISC License, both as the Python
package pyzmq ships them; their texts follow.
"""


@dataclass(frozen=True, kw_only=True)
class WrittenFmu:
    """What was written.

    platform : of the binary; None for sources without one
    problem : why there is no binary; empty where there is one
    needs_libzmq : importers need a libzmq.so.5 of their own
    """

    variables: tuple[Variable, ...]
    platform: str | None
    problem: str
    needs_libzmq: bool


def camera_model(
    scenario: Scenario,
    *,
    camera: str | None = None,
    bodies: tuple[str, ...] | None = None,
    sends_sun: bool = False,
    address: str = DEFAULT_ADDRESS,
) -> CameraModel:
    """One camera of a scenario with its inputs.

    camera : may be None where the scenario has one
    bodies : spacecraft that the importer places; None for all

    Raises ConfigError for a name that the scenario does not have.
    """
    where = str(scenario.source or scenario.name)
    if not scenario.cameras:
        raise ConfigError(where, "camera", "is missing; an FMU needs a [camera.NAME]")
    if camera is None and len(scenario.cameras) > 1:
        problem = f"is missing; {where} has {', '.join(scenario.cameras)}"
        raise ConfigError("simgl fmu", "--camera", problem)
    chosen = next(iter(scenario.cameras)) if camera is None else camera
    placed = tuple(scenario.models) if bodies is None else tuple(dict.fromkeys(bodies))
    checks = [("--camera", (chosen,), scenario.cameras), ("--body", placed, scenario.models)]
    for option, names, allowed in checks:
        for name in names:
            if name not in allowed:
                problem = f'"{name}" is not in {where}; {did_you_mean(name, allowed)}'
                raise ConfigError("simgl fmu", option, problem)
    return CameraModel(
        scenario=scenario, camera=chosen, bodies=placed, sends_sun=sends_sun, address=address
    )


def write_fmu(model: CameraModel, path: Path) -> WrittenFmu:
    """Write an FMU file; an existing one is replaced once the new one is complete."""
    check_writable(path.parent)
    described = variables(model)
    identifier = re.sub(r"\W", "_", f"simgl_{model.scenario.name}_{model.camera}", flags=re.ASCII)
    with tempfile.TemporaryDirectory(prefix="simgl-fmu-") as folder:
        content = _sources()
        token = _token(model, described, content)
        content[f"sources/{_MODEL_HEADER}"] = model_header(model, described, token).encode()
        content["modelDescription.xml"] = model_description(model, described, identifier, token)
        license_text = _LICENSE
        platform, needs_libzmq = None, False
        compilers = find_compilers(Path(folder))
        if not isinstance(compilers, str):
            platform = fmi_platform()
            needs_libzmq = not compilers.libraries
            library = Path(folder) / f"{identifier}.so"
            for name in (n for n in content if n.startswith("sources/")):
                (Path(folder) / Path(name).name).write_bytes(content[name])
            compile_fmu(
                compilers,
                [Path(folder) / name for name in C_FILES],
                [Path(folder) / name for name in CPP_FILES],
                library,
            )
            for binary in (library, *compilers.libraries):
                content[f"binaries/{platform}/{binary.name}"] = binary.read_bytes()
            if compilers.libraries:
                license_text += _LIBRARIES_LICENSE + _library_licenses()
        content["sources/buildDescription.xml"] = build_description(
            identifier, C_FILES, CPP_FILES, platform
        )
        content["documentation/licenses/license.txt"] = license_text.encode()
        _write_zip(path, content)
    return WrittenFmu(
        variables=described,
        platform=platform,
        problem=compilers if isinstance(compilers, str) else "",
        needs_libzmq=needs_libzmq,
    )


def _sources() -> dict[str, bytes]:
    """The C and C++ files by their names in the archive."""
    folder = _cpp_folder()
    content = {}
    for name in (*C_FILES, *CPP_FILES, *_HEADERS):
        path = folder / name
        path = path if path.exists() else folder / "fmi" / name
        content[f"sources/{name}"] = path.read_bytes()
    return content


def _cpp_folder() -> Path:
    """The folder of the C client: in the installed package, or in a checkout."""
    package = Path(__file__).resolve().parents[1]
    for candidate in (package / "cpp", package.parent / "cpp"):
        if candidate.is_dir():
            return candidate
    raise AssetError(f'no folder "cpp" in {package} or {package.parent}; reinstall simgl')


def _token(model: CameraModel, described: tuple[Variable, ...], content: dict[str, bytes]) -> str:
    """Names all that the FMU is made of, so that a model description fits its binary."""
    digest = hashlib.sha256(model_header(model, described, "").encode())
    for name in sorted(content):
        digest.update(content[name])
    return digest.hexdigest()[:32]


def _library_licenses() -> str:
    """The licences that pyzmq ships for its libraries."""
    try:
        shipped = files("pyzmq") or []
    except PackageNotFoundError:
        return ""
    texts = [p for p in shipped if re.fullmatch(r"LICENSE\.(zeromq|libsodium)\.txt", p.name)]
    return "".join(f"\n{Path(str(p.locate())).read_text(encoding='utf-8')}" for p in texts)


def _write_zip(path: Path, content: dict[str, bytes]) -> None:
    with complete_file(path) as unfinished, zipfile.ZipFile(unfinished, "w") as archive:
        # The model description first, where importers look for it.
        for name in sorted(content, key=lambda n: (n != "modelDescription.xml", n)):
            info = zipfile.ZipInfo(name, _ZIP_DATE)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            archive.writestr(info, content[name])
