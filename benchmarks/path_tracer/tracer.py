"""The scene in Mitsuba 3: the same triangles, normals, reflectances, camera, Sun and Earth.

The Sun is a disc 1 au away with the radiance that gives its irradiance; the Earth is a Lambertian
sphere. Places are relative to the first spacecraft, since Mitsuba works in float32. It has three
colours: N is traced by itself, in the place of all three.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from simgl.arrays import Array, UIntArray
from simgl.disk_cache import read_arrays, write_arrays
from simgl.physics.constants import ASTRONOMICAL_UNIT
from simgl.physics.frames import unit
from simgl.scene.materials import Material
from simgl.scene.state import BodyState, CameraState, SceneState, SunSeen

# The bands that the tracer's three colours stand for, picture by picture.
VISIBLE, NEAR_INFRARED = (0, 1, 2), (3, 3, 3)
# Of the picture's samples; their spread tells the noise.
PARTS = 16
# As many bounces as any light survives: Russian roulette begins after the sixteenth.
_ROULETTE_DEPTH = 16

_VERTEX = np.dtype([(name, "<f4") for name in ("x", "y", "z", "nx", "ny", "nz")])
_FACE = np.dtype([("count", "u1"), ("corner", "<i4", 3)])


@dataclass(frozen=True, kw_only=True, eq=False)
class Traced:
    """The tracer's picture.

    radiance : (height, width, 3) mean over each pixel [W m-2 sr-1]
    error : the same, standard error of that mean
    cpu_seconds : processor time, without loading
    """

    radiance: Array
    error: Array
    cpu_seconds: float


def mitsuba() -> Any:
    """The tracer; raises SystemExit with a hint where it is not installed."""
    try:
        import mitsuba as mi
    except ImportError:
        raise SystemExit("benchmarks.path_tracer needs Mitsuba 3: pip install mitsuba") from None
    mi.set_variant("scalar_rgb")
    return mi


def trace(
    state: SceneState,
    camera: CameraState,
    bands: Sequence[int],
    samples: int,
    kept: Path,
    tick: Callable[[], None],
) -> Traced:
    """The picture of a camera in three bands with about ``samples`` paths a pixel.

    kept : folder of pictures that were traced before; the same scene is not traced again
    tick : called after each of ``PARTS``
    """
    mi = mitsuba()
    each = max(samples // PARTS, 1)
    with TemporaryDirectory() as folder:
        described = _scene(mi, state, camera, bands, Path(folder))
        key = _key(described, Path(folder), each, str(mi.__version__))
        path = kept / f"traced_{key[:16]}.npz"
        found = read_arrays(path)
        if found is not None:
            seconds = float(found.pop("cpu_seconds"))
            return Traced(radiance=found["radiance"], error=found["error"], cpu_seconds=seconds)
        scene = mi.load_dict(described)
    size = (camera.camera.detector.height, camera.camera.detector.width, len(bands))
    total, squares = np.zeros(size), np.zeros(size)
    start = time.process_time()
    for part in range(PARTS):
        image = np.array(mi.render(scene, spp=each, seed=part), dtype=np.float64)
        total, squares = total + image, squares + image**2
        tick()
    seconds = time.process_time() - start
    mean = total / PARTS
    variance = np.maximum(squares / PARTS - mean**2, 0.0) / (PARTS - 1)
    traced = Traced(radiance=mean, error=np.sqrt(variance), cpu_seconds=seconds)
    write_arrays(path, asdict(traced), "the scene is traced again next time")
    return traced


def _key(scene: dict[str, Any], folder: Path, samples: int, version: str) -> str:
    """A name for the picture of a scene: all that goes into it, meshes by their bytes."""
    digest = hashlib.sha256(f"{PARTS} {samples} {version}".encode())
    digest.update(str(scene).replace(str(folder), "").encode())
    for path in sorted(folder.iterdir()):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def plate_error(sun: SunSeen) -> float:
    """Largest relative error of a Lambert plate's radiance, rho E cos / pi, at 0 and 60 deg."""
    mi = mitsuba()
    worst = 0.0
    for tilt in (0.0, np.radians(60.0)):
        towards = np.array([np.sin(tilt), 0.0, np.cos(tilt)])
        scene = {
            "type": "scene",
            "integrator": {"type": "path"},
            "plate": {"type": "rectangle", "bsdf": _lambert(np.array([0.2, 0.5, 0.9]))},
            "sun": _sun(mi, sun, towards, VISIBLE),
            "sensor": _sensor(mi, np.array([0.0, 0.0, 9.0]), -np.eye(3)[2], np.eye(3)[1], 8, 5.0),
        }
        found = np.array(mi.render(mi.load_dict(scene), spp=256)).mean(axis=(0, 1))
        expected = np.array([0.2, 0.5, 0.9]) * sun.irradiance[list(VISIBLE)] * np.cos(tilt) / np.pi
        worst = max(worst, float(np.abs(found / expected - 1.0).max()))
    return worst


def _scene(
    mi: Any, state: SceneState, camera: CameraState, bands: Sequence[int], folder: Path
) -> dict[str, Any]:
    origin = next(iter(state.bodies.values())).pose.position
    sun = state.sun.seen_from(origin)
    R = camera.R_camera_from_icrf
    detector = camera.camera.detector
    assert detector.width == detector.height
    # Camera axes x right, y down, z forward: up in the picture is -y.
    sensor = _sensor(
        mi,
        camera.position - origin,
        R[2],
        -R[1],
        detector.width,
        float(np.degrees(camera.camera.fields_of_view[0])),
    )
    scene: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": -1, "rr_depth": _ROULETTE_DEPTH},
        "sensor": sensor,
        "sun": _sun(mi, sun, sun.direction_icrf, bands),
    }
    for name, body in state.bodies.items():
        scene |= _body(name, body, bands, origin, folder)
    if state.earth is not None:
        earth = state.earth.earth
        assert earth.equatorial_radius == earth.polar_radius
        assert earth.albedo is not None
        scene["earth"] = {
            "type": "sphere",
            "center": [float(v) for v in state.earth.position - origin],
            "radius": earth.equatorial_radius,
            "bsdf": _lambert(np.asarray(earth.albedo)[list(bands)]),
        }
    return scene


def _sensor(
    mi: Any, place: Array, forward: Array, up: Array, width: int, fov_deg: float
) -> dict[str, Any]:
    look = mi.ScalarTransform4f().look_at(
        origin=[float(v) for v in place],
        target=[float(v) for v in place + forward],
        up=[float(v) for v in up],
    )
    return {
        "type": "perspective",
        "fov": fov_deg,
        "near_clip": 0.01,
        "to_world": look,
        "film": {
            "type": "hdrfilm",
            "width": width,
            "height": width,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "independent"},
    }


def _sun(mi: Any, sun: SunSeen, towards: Array, bands: Sequence[int]) -> dict[str, Any]:
    place = ASTRONOMICAL_UNIT * unit(towards)
    radius = ASTRONOMICAL_UNIT * np.tan(sun.angular_radius)
    up = np.eye(3)[int(np.argmin(np.abs(towards)))]
    turn = mi.ScalarTransform4f().look_at(
        origin=[float(v) for v in place], target=[0.0, 0.0, 0.0], up=[float(v) for v in up]
    )
    radiance = [float(v) for v in sun.radiance[list(bands)]]
    return {
        "type": "disk",
        "to_world": turn @ mi.ScalarTransform4f().scale([float(radius)] * 3),
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": radiance}},
    }


def _lambert(reflectance: Array) -> dict[str, Any]:
    value = [float(v) for v in reflectance]
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": value}}


def _body(
    name: str, body: BodyState, bands: Sequence[int], origin: Array, folder: Path
) -> dict[str, Any]:
    """One shape for each material of a body that some triangle wears."""
    mesh, R = body.model.posed_mesh.baked(), body.pose.R_icrf_from_body
    positions = mesh.positions @ R.T + (body.pose.position - origin)
    normals = mesh.normals @ R.T
    worn = mesh.material[mesh.triangles[:, 0]]
    shapes: dict[str, Any] = {}
    for index, material in enumerate(body.model.materials):
        chosen = mesh.triangles[worn == index]
        if len(chosen) == 0:
            continue
        path = folder / f"{name}_{index}.ply"
        _write_ply(path, positions, normals, chosen)
        shapes[f"{name}_{index}"] = _shape(path, material, bands, body.model.open_sheets)
    return shapes


def _shape(
    path: Path, material: Material, bands: Sequence[int], open_sheets: bool
) -> dict[str, Any]:
    bsdf = _lambert(np.asarray(material.reflectance)[list(bands)])
    shape: dict[str, Any] = {
        "type": "ply",
        "filename": str(path),
        "bsdf": {"type": "twosided", "bsdf": bsdf} if open_sheets else bsdf,
    }
    glow = np.asarray(material.emission)[list(bands)]
    if np.any(glow > 0.0):
        value = [float(v) for v in glow]
        shape["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": value}}
    return shape


def _write_ply(path: Path, positions: Array, normals: Array, triangles: UIntArray) -> None:
    used, corners = np.unique(triangles, return_inverse=True)
    vertices = np.empty(len(used), dtype=_VERTEX)
    for k, axis in enumerate("xyz"):
        vertices[axis] = positions[used, k]
        vertices[f"n{axis}"] = normals[used, k]
    faces = np.empty(len(triangles), dtype=_FACE)
    faces["count"] = 3
    faces["corner"] = corners.reshape(-1, 3)
    properties = "".join(f"property float {name}\n" for name in _VERTEX.names or ())
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n{properties}"
        f"element face {len(faces)}\nproperty list uchar int vertex_index\nend_header\n"
    )
    path.write_bytes(header.encode() + vertices.tobytes() + faces.tobytes())
