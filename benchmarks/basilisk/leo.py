"""Basilisk flies over simgl's Earth, and its own image processing measures against truth.

With a Python that has ``bsk[opnav]``; docs/basilisk.md has the results:

    simgl run --scenario benchmarks/basilisk/earth.toml \
        --camera 1=benchmarks/basilisk/navcam.toml -- \
        python benchmarks/basilisk/leo.py --images 1000
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from Basilisk.architecture import messaging
from Basilisk.fswAlgorithms import horizonOpNav, houghCircles, limbFinding
from Basilisk.simulation import camera, simpleNav, spacecraft, vizInterface
from Basilisk.utilities import RigidBodyKinematics, SimulationBaseClass, macros, simIncludeGravBody
from numpy.typing import NDArray

Array = NDArray[np.float64]

MU = 3.986004418e14  # [m3 s-2]
AU = 149597870700.0  # [m]
WGS84 = np.array([6378137.0, 6378137.0, 6356752.314245])  # [m]
RANGE = 8378137.0  # [m] 2000 km above the equator
FOV = np.radians(115.0)
SIGMA_CB = np.array([0.1, -0.2, 0.3])
OFF_NADIR = np.radians(2.0)
# Basilisk's number of the Earth.
EARTH = 1


@dataclass
class Flight:
    """A scenario and what is recorded of it."""

    simulation: Any
    horizon: Any
    recorders: dict[str, Any] = field(default_factory=dict)


def planet(name: str, position: list[float]) -> Any:
    """Message with the place of a body."""
    payload = messaging.SpicePlanetStateMsgPayload()
    payload.PositionVector = position
    payload.VelocityVector = [0.0, 0.0, 0.0]
    payload.J20002Pfix = np.eye(3).tolist()
    payload.PlanetName = name
    return messaging.SpicePlanetStateMsg().write(payload)


def inspector() -> Any:
    """The spacecraft, its camera 2 deg off the nadir."""
    body = spacecraft.Spacecraft()
    body.ModelTag = "inspector"
    speed = np.sqrt(MU / RANGE)
    body.hub.r_CN_NInit = [[RANGE], [0.0], [0.0]]
    body.hub.v_CN_NInit = [[0.0], [speed], [0.0]]
    nadir = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
    c, s = np.cos(OFF_NADIR), np.sin(OFF_NADIR)
    tilt = np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
    BN = RigidBodyKinematics.MRP2C(SIGMA_CB).T @ tilt @ nadir
    body.hub.sigma_BNInit = np.array(RigidBodyKinematics.C2MRP(BN)).reshape(3, 1)
    # Once round in an orbit; a ball's inertia keeps it so.
    body.hub.IHubPntBc_B = (100.0 * np.eye(3)).tolist()
    body.hub.omega_BN_BInit = (BN @ [0.0, 0.0, speed / RANGE]).reshape(3, 1)
    return body


def fly(address: str, live: bool, size: int) -> Flight:
    """The scenario, ready to run."""
    simulation = SimulationBaseClass.SimBaseClass()
    process = simulation.CreateNewProcess("process")
    process.addTask(simulation.CreateNewTask("task", macros.sec2nano(1.0)))
    body = inspector()
    gravity = simIncludeGravBody.gravBodyFactory()
    gravity.createEarth().isCentralBody = True
    gravity.addBodiesTo(body)

    link = vizInterface.VizInterface()
    places = [planet("earth", [0.0] * 3), planet("sun", [0.9 * AU, 0.3 * AU, 0.3 * AU])]
    bodies = []
    for name, radius in (("earth", WGS84[0]), ("sun", 6.957e8)):
        info = vizInterface.GravBodyInfo()
        info.bodyName, info.mu, info.radEquator, info.radiusRatio = name, MU, float(radius), 1.0
        bodies.append(info)
    link.gravBodyInformation = vizInterface.GravBodyInfoVector(bodies)
    link.spiceInMsgs = messaging.SpicePlanetStateMsgInMsgsVector(
        [place.addSubscriber() for place in places]
    )
    shown = vizInterface.VizSpacecraftData()
    shown.spacecraftName = body.ModelTag
    shown.scStateInMsg.subscribeTo(body.scStateOutMsg)
    link.scData.push_back(shown)
    epoch = messaging.EpochMsgPayload()
    epoch.year, epoch.month, epoch.day, epoch.hours = 2026, 6, 1, 12
    epoch_message = messaging.EpochMsg().write(epoch)
    link.epochInMsg.subscribeTo(epoch_message)
    link.liveStream, link.noDisplay = live, not live
    link.reqComProtocol, rest = address.split("://")
    link.reqComAddress, link.reqPortNumber = rest.split(":")

    eye = camera.Camera()
    eye.cameraID, eye.cameraIsOn, eye.parentName = 1, 1, body.ModelTag
    eye.sigma_CB, eye.cameraPos_B = SIGMA_CB.tolist(), [0.0, 0.0, 0.0]
    eye.resolution, eye.fieldOfView = [size, size], FOV
    eye.renderRate = macros.sec2nano(1.0)
    link.addCamMsgToModule(eye.cameraConfigOutMsg)
    eye.imageInMsg.subscribeTo(link.opnavImageOutMsgs[0])

    circles = houghCircles.HoughCircles()
    circles.imageInMsg.subscribeTo(eye.imageOutMsg)
    circles.expectedCircles, circles.cannyThresh, circles.voteThresh = 1, 100, 15
    circles.houghMinDist, circles.blurrSize, circles.noiseSF = 50, 3, 1
    circles.houghMinRadius, circles.houghMaxRadius = size // 5, size * 3 // 5
    limb = limbFinding.LimbFinding()
    limb.imageInMsg.subscribeTo(eye.imageOutMsg)
    limb.cannyThreshLow, limb.cannyThreshHigh, limb.blurrSize = 60, 120, 3
    limb.limbNumThresh = 100
    attitude = simpleNav.SimpleNav()
    attitude.scStateInMsg.subscribeTo(body.scStateOutMsg)
    horizon = horizonOpNav.horizonOpNav()
    horizon.noiseSF = 1
    horizon.cameraConfigInMsg.subscribeTo(eye.cameraConfigOutMsg)
    horizon.limbInMsg.subscribeTo(limb.opnavLimbOutMsg)
    horizon.attInMsg.subscribeTo(attitude.attOutMsg)

    flight = Flight(simulation, horizon)
    flight.recorders = {
        "image": eye.imageOutMsg.recorder(),
        "circle": circles.opnavCirclesOutMsg.recorder(),
        "limb": limb.opnavLimbOutMsg.recorder(),
        "position": horizon.opNavOutMsg.recorder(),
        "truth": body.scStateOutMsg.recorder(),
    }
    modules = [body, link, eye, attitude, circles, limb, horizon, *flight.recorders.values()]
    for order, module in enumerate(modules):
        simulation.AddModelToTask("task", module, 100 - order)
    # Basilisk keeps no reference to what Python made.
    simulation.references = (
        gravity,
        places,
        epoch_message,
        circles,
        limb,
        attitude,
        eye,
        link,
        body,
    )
    return flight


def limb_ellipse(R_camera_from_icrf: Array, position: Array) -> tuple[Array, Array]:
    """Cone of sight lines that touch the Earth, (3, 3), and centre of its section at z = 1."""
    shape = R_camera_from_icrf @ np.diag(WGS84**-2.0) @ R_camera_from_icrf.T
    place = R_camera_from_icrf @ position
    towards = shape @ place
    cone = np.outer(towards, towards) - shape * (place @ towards - 1.0)
    centre = -np.linalg.solve(cone[:2, :2], cone[:2, 2])
    return np.asarray(cone), np.asarray(centre, dtype=np.float64)


def limb_residuals(points: Array, cone: Array, centre: Array, f: float) -> Array:
    """(n,) how far points (n, 2) at z = 1 lie outside the limb, from its centre [px]."""
    outward = points - centre
    radius = np.linalg.norm(outward, axis=1)
    direction = outward / radius[:, None]
    level = cone[2, 2] + cone[:2, 2] @ centre
    along = np.einsum("ni,ij,nj->n", direction, cone[:2, :2], direction)
    return f * (radius - np.sqrt(-level / along))


def report(flight: Flight, size: int, seconds: float) -> int:
    """Print what Basilisk measured against truth; returns how many images were valid."""
    records = flight.recorders
    f, half = 0.5 * size / np.tan(0.5 * FOV), 0.5 * size - 0.5
    circle, limb, shift, place = [], [], [], []
    for k in np.flatnonzero(np.array(records["image"].valid)):
        position = np.array(records["truth"].r_BN_N[k])
        BN = RigidBodyKinematics.MRP2C(records["truth"].sigma_BN[k])
        cone, centre = limb_ellipse(RigidBodyKinematics.MRP2C(SIGMA_CB) @ BN, position)
        if records["circle"].valid[k]:
            seen = np.array(records["circle"].circlesCenters[k][:2])
            circle.append(seen - (centre * f + half))
        if records["limb"].valid[k]:
            count = int(records["limb"].numLimbPoints[k])
            pixels = np.array(records["limb"].limbPoints[k]).reshape(-1, 2)[:count]
            points = (pixels - half) / f
            residual = limb_residuals(points, cone, centre, f)
            angle = np.arctan2(*(points - centre).T[::-1])
            terms = np.stack([np.ones(count), np.cos(angle), np.sin(angle)], axis=1)
            shift.append(np.linalg.lstsq(terms, residual, rcond=None)[0][1:])
            limb.append(residual)
        if records["position"].valid[k]:
            place.append(np.linalg.norm(np.array(records["position"].r_BN_N[k]) - position))
    valid = int(np.sum(records["image"].valid))
    print(f"{valid} valid images in {seconds:.1f} s")
    print(f"houghCircles [px]: mean {np.mean(circle, axis=0)}, std {np.std(circle, axis=0)}")
    every = np.concatenate(limb)
    print(f"limbFinding [px]: {every.size} points, median {np.median(every):.3f}, ", end="")
    print(f"std {every.std():.3f}, shift of the whole {np.mean(shift, axis=0)}")
    rms = float(np.sqrt(np.mean(np.square(place))))
    print(f"horizonOpNav: {rms / 1e3:.2f} km rms, {100.0 * rms / RANGE:.3f} % of the distance")
    return valid


def main() -> int:
    """Fly, and report; 1 where an image is missing."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--address", default="tcp://127.0.0.1:5556")
    parser.add_argument("--images", type=int, default=40)
    parser.add_argument("--size", type=int, default=640)
    parser.add_argument("--live", action="store_true", help="liveStream in place of noDisplay")
    given = parser.parse_args()
    flight = fly(given.address, given.live, given.size)
    start = time.perf_counter()
    flight.simulation.InitializeSimulation()
    for step in range(1, given.images + 1):
        # limbFinding calls every planet Mars, and horizonOpNav believes it.
        flight.horizon.planetTarget = EARTH
        flight.simulation.ConfigureStopTime(macros.sec2nano(float(step)))
        flight.simulation.ExecuteSimulation()
    valid = report(flight, given.size, time.perf_counter() - start)
    return int(valid != given.images)


if __name__ == "__main__":
    sys.exit(main())
