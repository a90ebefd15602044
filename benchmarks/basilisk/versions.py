"""Thirty images into whatever version of Basilisk runs this; its core is enough.

    simgl serve --basilisk tcp://127.0.0.1:5556
    python benchmarks/basilisk/versions.py
    python benchmarks/basilisk/versions.py --live     # liveStream in place of noDisplay

each by a Python that has the version to try. Prints one line, and ends with code 1 where an image
is missing. docs/basilisk.md has the results.
"""

from __future__ import annotations

import argparse
import sys
from importlib.metadata import version
from typing import Any

import numpy as np
from Basilisk.architecture import messaging
from Basilisk.simulation import spacecraft, vizInterface
from Basilisk.utilities import RigidBodyKinematics, SimulationBaseClass, macros

AU = 149597870700.0  # [m]
IMAGES = 30


def planet(name: str, position: list[float]) -> Any:
    """Message with the place of a body."""
    payload = messaging.SpicePlanetStateMsgPayload()
    payload.PositionVector, payload.VelocityVector = position, [0.0] * 3
    payload.J20002Pfix, payload.PlanetName = np.eye(3).tolist(), name
    return messaging.SpicePlanetStateMsg().write(payload)


def eye(parent: str) -> Any:
    """Message of a camera along the body's z axis."""
    payload = messaging.CameraConfigMsgPayload()
    payload.cameraID, payload.isOn, payload.parentName = 1, 1, parent
    payload.fieldOfView, payload.resolution = 0.7, [64, 48]
    payload.renderRate = int(1e9)
    payload.cameraPos_B = payload.sigma_CB = [0.0] * 3
    return messaging.CameraConfigMsg().write(payload)


def linked(link: Any, body: Any, config: Any, places: dict[str, Any]) -> Any:
    """Connect the link to its world; returns the message of its images."""
    infos = []
    for name in places:
        info = vizInterface.GravBodyInfo()
        info.bodyName, info.mu, info.radEquator, info.radiusRatio = name, 4e14, 6378137.0, 1.0
        infos.append(info)
    link.gravBodyInformation = vizInterface.GravBodyInfoVector(infos)
    link.spiceInMsgs = messaging.SpicePlanetStateMsgInMsgsVector(
        [place.addSubscriber() for place in places.values()]
    )
    shown = vizInterface.VizSpacecraftData()
    shown.spacecraftName = body.ModelTag
    shown.scStateInMsg.subscribeTo(body.scStateOutMsg)
    link.scData.push_back(shown)
    link.addCamMsgToModule(config)
    return link.opnavImageOutMsgs[0]


def main() -> int:
    """Fly thirty steps above the Earth's day side."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--address", default="tcp://127.0.0.1:5556")
    parser.add_argument("--live", action="store_true", help="liveStream in place of noDisplay")
    given = parser.parse_args()
    simulation = SimulationBaseClass.SimBaseClass()
    simulation.CreateNewProcess("process").addTask(
        simulation.CreateNewTask("task", macros.sec2nano(1.0))
    )
    body = spacecraft.Spacecraft()
    body.ModelTag = "inspector"
    body.hub.r_CN_NInit, body.hub.v_CN_NInit = [[9e6], [0.0], [0.0]], [[0.0]] * 3
    # z to the Earth, y to the south.
    axes = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
    body.hub.sigma_BNInit = np.array(RigidBodyKinematics.C2MRP(axes)).reshape(3, 1)
    link, config = vizInterface.VizInterface(), eye(body.ModelTag)
    places = {"earth": planet("earth", [0.0] * 3), "sun": planet("sun", [AU, 0.0, 0.0])}
    images = linked(link, body, config, places).recorder()
    link.liveStream, link.noDisplay = given.live, not given.live
    link.reqComProtocol, rest = given.address.split("://")
    link.reqComAddress, link.reqPortNumber = rest.split(":")
    for module in (body, link, images):
        simulation.AddModelToTask("task", module)
    simulation.InitializeSimulation()
    simulation.ConfigureStopTime(macros.sec2nano(float(IMAGES)))
    simulation.ExecuteSimulation()
    valid = int(np.sum(images.valid))
    mode = "liveStream" if given.live else "noDisplay"
    print(f"bsk {version('bsk')}, {mode}: {valid} of {IMAGES} images valid")
    return int(valid != IMAGES)


if __name__ == "__main__":
    sys.exit(main())
