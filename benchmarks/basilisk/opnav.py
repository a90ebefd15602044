"""Basilisk's own optical navigation scenarios against simgl, their measurements against truth.

The scenarios and the kernels are Basilisk's and NAIF's, and not here; docs/basilisk.md says what to
put where, and has the results. With a Python that has ``bsk[opnav]``, and simgl on the path:

    python benchmarks/basilisk/opnav.py --sources OpNavScenarios --kernels EphemerisData

Nothing in the sources is changed. What is set from outside: where Basilisk looks for kernels and
gravity, simgl in the place of its viewer, recorders, a module without effect for the neural network
where its weights are missing, and the gateway message of ``houghCircles``, which bsk 2.12.1 copies
where the scenarios mean to share it.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import stat
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IndexArray = NDArray[np.int64]

NAMES = (
    "OpNavPoint",
    "OpNavPointLimb",
    "OpNavHeading",
    "OpNavOD",
    "OpNavODLimb",
    "OpNavAttOD",
    "OpNavAttODLimb",
    "faultDetOpNav",
)
KERNELS = ("de430.bsp", "naif0012.tls", "de-403-masses.tpc", "pck00010.tpc")
GRAVITY = "GGM2BData.txt"
# Mars's oblateness, normalised, where the file with all its field is missing.
J2_ONLY = """3396200.0, 4.2828375e13, 0.0, 2, 2, 1, 0.0, 0.0
0, 0, 1.0, 0.0, 0.0, 0.0
1, 0, 0.0, 0.0, 0.0, 0.0
1, 1, 0.0, 0.0, 0.0, 0.0
2, 0, -8.745e-04, 0.0, 0.0, 0.0
2, 1, 0.0, 0.0, 0.0, 0.0
2, 2, 0.0, 0.0, 0.0, 0.0
"""
ADDRESS = "tcp://127.0.0.1:5556"


@dataclass
class Watched:
    """A scenario's simulation and what is recorded of it."""

    recorders: dict[str, Any] = field(default_factory=dict)
    seconds: float = 0.0


def support_data(folder: Path, kernels: Path) -> Path:
    """A folder as Basilisk keeps its data, with links to the kernels."""
    ephemeris = folder / "supportData/EphemerisData"
    gravity = folder / "supportData/LocalGravData"
    for each in (ephemeris, gravity):
        each.mkdir(parents=True)
    for name in KERNELS:
        if not (kernels / name).is_file():
            sys.exit(f"{kernels / name} is missing")
        (ephemeris / name).symlink_to((kernels / name).resolve())
    if (kernels / GRAVITY).is_file():
        (gravity / GRAVITY).symlink_to((kernels / GRAVITY).resolve())
    else:
        (gravity / GRAVITY).write_text(J2_ONLY)
    return folder


def viewer(folder: Path, options: list[str]) -> str:
    """Path of a program that takes the viewer's place."""
    script = folder / "viewer.sh"
    command = " ".join(["simgl", "serve", *options, "--basilisk", ADDRESS])
    script.write_text(f"#!/bin/sh\nexec {command}\n")
    script.chmod(script.stat().st_mode | stat.S_IXUSR)
    return str(script)


def put_in_place(sources: Path, data: Path, program: str) -> Any:
    """The scenarios' modules, pointed to the data and the program; BSK_OpNav is given back."""
    for each in ("scenariosOpNav", "modelsOpNav", "plottingOpNav", "."):
        sys.path.insert(0, str(sources / each))
    base: Any = importlib.import_module("BSK_OpNav")
    base.appPath = program

    from Basilisk.architecture import messaging, sysModel
    from Basilisk.fswAlgorithms import centerRadiusCNN

    class NoNetwork(sysModel.SysModel):  # type: ignore[misc]
        """Takes what the scenarios set, and does nothing."""

        def __init__(self) -> None:
            super().__init__()
            self.imageInMsg = messaging.CameraImageMsgReader()

        def Reset(self, now: int) -> None:
            """Nothing to do."""

        def UpdateState(self, now: int) -> None:
            """Nothing to do."""

    if not list(sources.rglob("CAD.onnx")):
        centerRadiusCNN.CenterRadiusCNN = NoNetwork
    dynamics: Any = importlib.import_module("BSK_OpNavDynamics")
    dynamics.bskPath = str(data)
    flight_software: Any = importlib.import_module("BSK_OpNavFsw")
    flight_software.get_repo_root = lambda: sources
    setup = flight_software.BSKFswModels.setupGatewayMsgs

    def shared(self: Any) -> None:
        setup(self)
        self.opnavCirclesMsg = self.imageProcessing.opnavCirclesOutMsg

    flight_software.BSKFswModels.setupGatewayMsgs = shared
    return base


def watch(base: Any, images: Path | None) -> Watched:
    """Recorders come in where a scenario starts its viewer, after all is set."""
    watched = Watched()
    start, end = base.BSKScenario.run_vizard, base.BSKScenario.end_scenario

    def started(self: Any, mode: str) -> None:
        simulation = self.masterSim
        dynamics, software = simulation.get_DynModel(), simulation.get_FswModel()
        sources = {
            "camera 1": dynamics.cameraMod.imageOutMsg,
            "camera 3": dynamics.cameraMod2.imageOutMsg,
            "circles": software.imageProcessing.opnavCirclesOutMsg,
            "limb": software.limbFinding.opnavLimbOutMsg,
            "measured": software.opnavMsg,
            "filter": software.relativeOD.filtDataOutMsg,
            "truth": dynamics.scObject.scStateOutMsg,
        }
        watched.recorders = {name: message.recorder() for name, message in sources.items()}
        for recorder in watched.recorders.values():
            simulation.AddModelToTask(dynamics.taskName, recorder)
        if images is not None:
            images.mkdir(parents=True, exist_ok=True)
            dynamics.cameraMod.saveImages = 1
            dynamics.cameraMod.saveDir = str(images / "camera_1_")
        start(self, mode)
        watched.seconds = time.perf_counter()

    def ended(self: Any) -> Any:
        watched.seconds = time.perf_counter() - watched.seconds
        return end(self)

    base.BSKScenario.run_vizard, base.BSKScenario.end_scenario = started, ended
    return watched


def fresh(recorder: Any, valid: Array | None = None) -> IndexArray:
    """Indices where a recorder saw a message for the first time, among the valid ones."""
    written = np.array(recorder.timesWritten())
    _, first = np.unique(written, return_index=True)
    good = np.array(recorder.valid if valid is None else valid).astype(bool)
    # What was set before the start was written at no time.
    return np.array([k for k in first if good[k] and written[k] > 0], dtype=np.int64)


def result(watched: Watched) -> dict[str, Any]:
    """What a run measured."""
    records = watched.recorders
    times, truth = np.array(records["truth"].times()), np.array(records["truth"].r_BN_N)
    summary: dict[str, Any] = {}
    asked = 0
    for name in ("camera 1", "camera 3"):
        count = len(np.unique(np.array(records[name].timesWritten()))) - 1
        summary[f"{name}: images valid"] = f"{len(fresh(records[name]))} of {count}"
        asked += count
    summary["images per second"] = round(asked / watched.seconds, 1)
    summary["circles"] = len(fresh(records["circles"]))
    summary["limbs"] = len(fresh(records["limb"]))

    measured = records["measured"]
    rows = fresh(measured)
    if rows.size:
        at = np.searchsorted(times, np.array(measured.timesWritten())[rows])
        error = np.array(measured.r_BN_N)[rows] - truth[at]
        distance = np.linalg.norm(truth[at], axis=1)
        size = np.linalg.norm(error, axis=1)
        summary["measurements"] = int(rows.size)
        summary["position error, median [km]"] = round(float(np.median(size)) * 1e-3, 1)
        summary["position error, median [%]"] = round(100.0 * float(np.median(size / distance)), 2)
        summary["position error, 90 % below [%]"] = round(
            100.0 * float(np.quantile(size / distance, 0.9)), 2
        )
        along = np.linalg.norm(np.array(measured.r_BN_N)[rows], axis=1) - distance
        summary["of it along the range, median [km]"] = round(float(np.median(along)) * 1e-3, 1)
    state = np.array(records["filter"].state)[:, :3]
    if np.any(state[-1]):
        off = np.linalg.norm(state - truth, axis=1)
        half = len(off) // 2
        summary["filter: error in the second half, median [km]"] = round(
            float(np.median(off[half:])) * 1e-3, 1
        )
    return summary


def fly(given: argparse.Namespace, name: str) -> dict[str, Any]:
    """One scenario, in this process."""
    with tempfile.TemporaryDirectory() as folder:
        data = support_data(Path(folder), given.kernels)
        os.environ["BSK_SUPPORT_DATA_CACHE"] = str(data)
        options = [option for each in given.camera for option in ("--camera", each)]
        if given.scenario is not None:
            options.insert(0, str(given.scenario.resolve()))
        base = put_in_place(given.sources.resolve(), data, viewer(data, options))
        images = None if given.pictures is None else given.pictures.resolve() / name
        watched = watch(base, images)
        module = importlib.import_module(f"scenario_{name}")
        minutes = () if given.minutes is None else (given.minutes,)
        module.run(False, *minutes)
        return result(watched)


def main() -> None:
    """Fly each scenario in a process of its own, and report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=NAMES, help=", ".join(NAMES))
    parser.add_argument("--sources", type=Path, required=True, help="Basilisk's OpNavScenarios")
    parser.add_argument("--kernels", type=Path, required=True, help=", ".join(KERNELS))
    parser.add_argument("--scenario", type=Path, help="scenario file of simgl")
    parser.add_argument("--camera", action="append", default=[], help="ID=FILE, as in simgl serve")
    parser.add_argument(
        "--minutes", type=float, help="of simulation; the scenario's own by default"
    )
    parser.add_argument("--pictures", type=Path, help="folder for the images of camera 1")
    parser.add_argument("--json", type=Path, help="where the results go")
    parser.add_argument("--alone", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.alone:
        result = fly(given, given.names[0])
        given.json.write_text(json.dumps(result))
        return
    results = {}
    for name in given.names:
        with tempfile.TemporaryDirectory() as folder:
            answer = Path(folder) / "result.json"
            mine = [a for a in sys.argv[1:] if a not in given.names]
            command = [sys.executable, "-W", "ignore", __file__, name, *mine, "--alone"]
            log = subprocess.run(
                [*command, "--json", str(answer)], stdout=subprocess.PIPE, text=True, check=False
            )
            if not answer.is_file():
                sys.exit(f"{log.stdout}\n{name} ended with {log.returncode}")
            results[name] = json.loads(answer.read_text())
        print(name)
        for key, value in results[name].items():
            print(f"  {key}: {value}")
    if given.json is not None:
        given.json.write_text(json.dumps(results, indent=2) + "\n")


if __name__ == "__main__":
    main()
