"""Tables of the air that hold for every camera: made on the GPU at first use, then kept as a file.

``transmittance`` to space by height and angle, six moments of the diffuse light by height and the
Sun's angle, and its irradiance from above (``down``). shaders/air says what each holds.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from simgl import assets
from simgl.cache import cache_folder, read_arrays, write_arrays
from simgl.gpu.blocks import Block, UniformBuffer
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.state import State
from simgl.gpu.targets import Format, ImageTarget
from simgl.physics.air import AIR_TOP, OZONE_FOOT, OZONE_PEAK, OZONE_TOP, Atmosphere
from simgl.physics.constants import ASTRONOMICAL_UNIT, SOLAR_RADIUS

Progress = Callable[[int, int], None]
Floats = NDArray[np.float32]

AIR = Block(
    "Air",
    20,
    np.dtype(
        [
            # At sea level [km-1]; of the ozone at its peak.
            ("rayleigh_scattering", "f4", 4),
            ("aerosol_scattering", "f4", 4),
            ("aerosol_extinction", "f4", 4),
            ("ozone_absorption", "f4", 4),
            ("aerosol_asymmetry", "f4", 4),
            ("mean_albedo", "f4", 4),
            # Foot, top [km], and one over the way from either to the peak.
            ("ozone_layer", "f4", 4),
            # Of Rayleigh and aerosol [km].
            ("scale_heights", "f4", 2),
            ("ground_radius", "f4"),
            ("air_top", "f4"),
            ("sun_half_angle", "f4"),
            ("air_padding", "f4"),
            ("air_padding2", "f4", 2),
        ]
    ),
)



@dataclass(frozen=True)
class _Sampling:
    """Gauss' points for directions above and below the horizon, azimuths on half a circle, and
    cells of a ray."""

    above: int
    below: int
    around: int
    steps: int

    @property
    def defines(self) -> dict[str, int]:
        sizes = {"ABOVE": self.above, "BELOW": self.below, "AROUND": self.around}
        return sizes | {"STEPS": self.steps}

    @property
    def nodes(self) -> Floats:
        """Places and weights on 0..1."""
        nodes = np.zeros((_NODES, 4), np.float32)
        first = 0
        for count in (self.above, self.below):
            x, weight = np.polynomial.legendre.leggauss(count)
            nodes[first : first + count, 0] = 0.5 * (x + 1.0)
            nodes[first : first + count, 1] = 0.5 * weight
            first += count
        return nodes


# Sunlight scattered once has the aerosol's peak in it, all further light is smooth.
_FIRST, _NEXT = _Sampling(16, 10, 16, 24), _Sampling(8, 6, 8, 8)
_NODES = 26

# Of scattering and reflection; what the next would add is below 1e-4 of the whole.
ORDERS = 9

_TABLE = Block(
    "AirTable",
    21,
    np.dtype([("table_size", "f4", 2), ("table_padding", "f4", 2), ("nodes", "f4", (_NODES, 4))]),
)

_SIZES = {"transmittance": (256, 128), "diffuse": (64, 32)}
DIFFUSE = ("diffuse_j", "diffuse_fx", "diffuse_fz", "diffuse_mxx", "diffuse_mzz", "diffuse_mxz")
TABLES = {
    "transmittance_table": _SIZES["transmittance"],
    **dict.fromkeys((*DIFFUSE, "diffuse_down"), _SIZES["diffuse"]),
}
_SHADERS = ("medium", "places", "transmittance", "diffuse_place", "diffuse", "march")


@dataclass(frozen=True, kw_only=True)
class AirKind:
    """What the tables depend on.

    radius : of the ground [m]
    albedo : mean of the ground, per band
    """

    air: Atmosphere
    radius: float
    albedo: tuple[float, float, float, float]


def air_values(kind: AirKind) -> dict[str, object]:
    """The block AIR."""
    air = kind.air
    rayleigh = np.array(air.rayleigh) / air.rayleigh_scale_height * 1e3
    aerosol = np.array(air.aerosol) / air.aerosol_scale_height * 1e3
    # A tent of unit peak holds as much as half its width at the peak.
    ozone = np.array(air.ozone) / (0.5 * (OZONE_TOP - OZONE_FOOT)) * 1e3
    slope = 1e3 / (OZONE_PEAK - OZONE_FOOT)
    return {
        "rayleigh_scattering": rayleigh,
        "aerosol_scattering": aerosol * np.array(air.aerosol_albedo),
        "aerosol_extinction": aerosol,
        "ozone_absorption": ozone,
        "aerosol_asymmetry": air.aerosol_asymmetry,
        "mean_albedo": kind.albedo,
        "ozone_layer": (OZONE_FOOT / 1e3, OZONE_TOP / 1e3, slope, 0.0),
        "scale_heights": (air.rayleigh_scale_height / 1e3, air.aerosol_scale_height / 1e3),
        "ground_radius": kind.radius / 1e3,
        "air_top": AIR_TOP / 1e3,
        "sun_half_angle": np.arcsin(SOLAR_RADIUS / ASTRONOMICAL_UNIT),
    }


class AirTables:
    """The tables as textures, and the block that goes with them."""

    def __init__(self, ctx: moderngl.Context, kind: AirKind, arrays: dict[str, Floats]) -> None:
        self.block = UniformBuffer(ctx, AIR)
        self.block.write(air_values(kind))
        self.textures = {name: _texture(ctx, arrays[name]) for name in TABLES}

    def release(self) -> None:
        """Free everything."""
        self.block.release()
        for texture in self.textures.values():
            texture.release()


def tables_of(
    ctx: moderngl.Context, kind: AirKind, progress: Progress | None = None
) -> dict[str, Floats]:
    """(rows, columns, 4) of each of ``TABLES``, from the file of an earlier run where there is one.

    A folder that cannot be written only costs the next making; a damaged file is made anew.
    """
    path = cache_folder("air") / f"{_key(ctx, kind)}.npz"
    found = read_arrays(path)
    if found is not None and _whole(found):
        return found
    made = make_tables(ctx, kind, progress=progress)
    write_arrays(path, made, "tables of the air are made again next time")
    return made


def _key(ctx: moderngl.Context, kind: AirKind) -> str:
    shaders = assets.shaders() / "air"
    texts = [(shaders / f"{name}.glsl").read_text("utf-8") for name in _SHADERS]
    texts += [(shaders / f"{name}.frag").read_text("utf-8") for name in ("transmittance", "diffuse")]
    what = (_FIRST, _NEXT, ORDERS, TABLES, astuple(kind), AIR.dtype.descr)
    driver = ctx.info["GL_RENDERER"], ctx.info["GL_VERSION"]
    return hashlib.sha256(repr((what, driver, texts)).encode()).hexdigest()


def _whole(arrays: dict[str, Floats]) -> bool:
    """Whether every table is there, of its size, and finite."""
    return set(arrays) == set(TABLES) and all(
        arrays[name].shape == (*size[::-1], 4)
        and arrays[name].dtype == np.float32
        and bool(np.isfinite(arrays[name]).all())
        for name, size in TABLES.items()
    )


def make_tables(
    ctx: moderngl.Context,
    kind: AirKind,
    *,
    orders: int = ORDERS,
    progress: Progress | None = None,
) -> dict[str, Floats]:
    """The tables, drawn; of no orders, the diffuse ones are zero.

    About 3 s on two cores of a CPU renderer, nearly all of it in the diffuse light.
    """
    air = UniformBuffer(ctx, AIR)
    air.write(air_values(kind))
    air.bind()
    maker = _Maker(ctx)
    try:
        transmittance = maker.drawn("transmittance", ())
        once = diffuse = [np.zeros_like(t) for t in maker.read("diffuse")]
        for order in range(orders):
            if order == 0:
                once = diffuse = maker.drawn("first", transmittance)
            else:
                more = maker.drawn("next", diffuse)
                diffuse = [a + b for a, b in zip(once, more, strict=True)]
            if progress is not None:
                progress(order + 1, orders)
        return dict(zip(TABLES, (*transmittance, *diffuse), strict=True))
    finally:
        ctx.detect_framebuffer(0).use()
        maker.release()
        air.release()


class _Maker:
    """The programs and targets that draw tables; each table comes back as an array."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._targets = {
            name: ImageTarget(ctx, size, (Format("f4", 4),) * count)
            for (name, size), count in zip(_SIZES.items(), (1, len(DIFFUSE) + 1), strict=True)
        }

        def program(
            name: str, samplers: list[str], sampling: _Sampling, without: str
        ) -> FullscreenProgram:
            defines = {**sampling.defines, without: 1}
            return FullscreenProgram(ctx, name, _TABLE, samplers, shared=[AIR], defines=defines)

        everything = list(TABLES)
        self._programs = {
            "transmittance": program("air/transmittance", [], _FIRST, "WITHOUT_DIFFUSE"),
            "first": program("air/diffuse", everything[:1], _FIRST, "WITHOUT_DIFFUSE"),
            "next": program("air/diffuse", everything[1:], _NEXT, "WITHOUT_SUN"),
        }

    def read(self, name: str) -> list[Floats]:
        target = self._targets[name]
        return [np.array(target.read(i)) for i in range(len(target.formats))]

    def drawn(self, name: str, sources: Sequence[Floats]) -> list[Floats]:
        target = "transmittance" if name == "transmittance" else "diffuse"
        size = _SIZES[target]
        textures = [_texture(self._ctx, array) for array in sources]
        State().apply(self._ctx, self._targets[target].framebuffer, (0, 0, *size))
        nodes = (_NEXT if name == "next" else _FIRST).nodes
        self._programs[name].draw({"table_size": size, "nodes": nodes}, textures)
        drawn = self.read(target)
        for texture in textures:
            texture.release()
        return drawn

    def release(self) -> None:
        for owner in (*self._programs.values(), *self._targets.values()):
            owner.release()


def _texture(ctx: moderngl.Context, array: Floats) -> moderngl.Texture:
    height, width = array.shape[:2]
    texture = ctx.texture((width, height), 4, array.tobytes(), dtype="f4")
    texture.repeat_x = texture.repeat_y = False
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    return texture
