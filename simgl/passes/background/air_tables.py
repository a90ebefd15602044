"""Look-up tables of the air for all cameras: made on the GPU at first use, then cached in a file.

``transmittance`` to space by height and angle, six moments of the diffuse light by height and the
Sun's angle, and its irradiance from above (``down``). shaders/air says what each holds.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace

import moderngl
import numpy as np

from simgl import assets
from simgl.arrays import Array, Array32
from simgl.disk_cache import arrays_once, cache_folder
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing, release_all
from simgl.gpu.render_targets import Format, ImageTarget
from simgl.gpu.uniform_blocks import Block, UniformBuffer
from simgl.physics.air_profile import AIR_TOP, PROFILE_PLACES
from simgl.physics.atmosphere import Atmosphere, absorption, profiles
from simgl.physics.constants import ASTRONOMICAL_UNIT, SOLAR_RADIUS
from simgl.physics.skylight import (
    HEIGHTS,
    LOOKS,
    SUNS,
    Rings,
    aureole_strength,
    skylight,
)
from simgl.progress import ProgressCallback

Texture = moderngl.Texture | moderngl.Texture3D

AIR = Block(
    "Air",
    20,
    np.dtype(
        [
            # Vertical optical depths.
            ("rayleigh_scattering", "f4", 4),
            ("aerosol_scattering", "f4", 4),
            ("aerosol_extinction", "f4", 4),
            ("ozone_absorption", "f4", 4),
            ("aerosol_asymmetry", "f4", 4),
            ("mean_albedo", "f4", 4),
            # Of the Rayleigh phase function: even part, and part by the squared cosine.
            ("rayleigh_shape", "f4", 2),
            ("ground_radius", "f4"),
            ("air_top", "f4"),
            ("sun_half_angle", "f4"),
            # Refractive index less 1, over the molecules' density [km].
            ("refraction", "f4"),
            ("air_padding", "f4", 2),
            # Of terms (columns) in the light of bands (rows).
            ("band_shares", "f4", (4, 4)),
        ]
    ),
)


# Sunlight scattered once has the aerosol's peak in it, all further light is smooth.
_FIRST, _NEXT = Rings(12, 8, 12, 20), Rings(8, 6, 6, 8)
_NODES = 20

# Of scattering and reflection; what the next would add is below 1e-4 of the whole.
ORDERS = 9

_TABLE = Block(
    "AirTable",
    21,
    np.dtype([("table_size", "f4", 2), ("table_padding", "f4", 2), ("nodes", "f4", (_NODES, 4))]),
)

_TRANSMITTANCE = (256, 128)
_LOOK_SHAPE = (HEIGHTS, LOOKS, SUNS, 4)
# The samplers of the medium's profiles, and of gases besides ozone where there are any.
PROFILE, ABSORPTION = "air_profile", "air_absorption"
# What a march through the air reads besides, in the order of its samplers, and the shapes.
SCATTERING = {
    "diffuse_mean": (HEIGHTS, SUNS, 4),
    "diffuse_mxx": (HEIGHTS, SUNS, 4),
    "diffuse_mzz": (HEIGHTS, SUNS, 4),
    "diffuse_mxz": (HEIGHTS, SUNS, 4),
    "diffuse_aureole": (HEIGHTS, SUNS, 4),
    "diffuse_by_look": _LOOK_SHAPE,
    "diffuse_by_look_x": _LOOK_SHAPE,
}
TABLES = {
    "transmittance_table": (*_TRANSMITTANCE[::-1], 4),
    "diffuse_down": (HEIGHTS, SUNS, 4),
} | SCATTERING
_SHADERS = ("medium", "profile", "places", "transmittance", "diffuse_place", "diffuse", "march")


@dataclass(frozen=True, kw_only=True)
class AirKind:
    """What one set of tables depends on: air in which light falls exponentially.

    albedo : mean of the ground, per term
    """

    air: Atmosphere
    radius: float
    albedo: tuple[float, float, float, float]


def medium_defines(air: Atmosphere) -> dict[str, int]:
    """Of the variant that marches through an air."""
    return {"ABSORBERS": 1} if air.absorbers else {}


def air_values(kind: AirKind, shares: Array) -> dict[str, object]:
    """The block AIR."""
    air = kind.air
    aerosol = np.array(air.aerosol)
    # With King's correction for the molecules' anisotropy (Chandrasekhar 1950, section 18).
    even = 2.0 / (2.0 + air.depolarisation)
    return {
        "rayleigh_scattering": air.rayleigh,
        "aerosol_scattering": aerosol * np.array(air.aerosol_albedo),
        "aerosol_extinction": aerosol,
        "ozone_absorption": air.ozone,
        "aerosol_asymmetry": air.aerosol_asymmetry,
        "mean_albedo": kind.albedo,
        "rayleigh_shape": (even * (1.0 + air.depolarisation), even * (1.0 - air.depolarisation)),
        "ground_radius": kind.radius / 1e3,
        "air_top": AIR_TOP / 1e3,
        "sun_half_angle": np.arcsin(SOLAR_RADIUS / ASTRONOMICAL_UNIT),
        "refraction": air.refractivity[1] / (1e3 * profiles(air)[0, 0]),
        "band_shares": shares,
    }


def profile_table(air: Atmosphere) -> Array32:
    """(1, PROFILE_PLACES, 4) of molecules, aerosol and ozone, the column's share in a kilometre."""
    table = np.zeros((1, PROFILE_PLACES, 4), np.float32)
    table[0, :, :3] = 1e3 * profiles(air)[:, :3]
    return table


def medium_textures(ctx: moderngl.Context, air: Atmosphere) -> dict[str, Texture]:
    """What tells the densities of an air, by its samplers."""
    textures = {PROFILE: texture_of(ctx, profile_table(air))}
    if air.absorbers:
        textures[ABSORPTION] = texture_of(ctx, absorption_table(air))
    return textures


def absorption_table(air: Atmosphere) -> Array32:
    """(1, PROFILE_PLACES, 4) absorption of gases besides ozone in a kilometre, per term."""
    return (1e3 * absorption(air)[None]).astype(np.float32)


def tables_of(
    ctx: moderngl.Context, kind: AirKind, progress: ProgressCallback | None = None
) -> dict[str, Array32]:
    """(rows, columns, 4) of each of ``TABLES``, from the file of an earlier run where there is one.

    A folder that cannot be written only costs the next making; a damaged file is made anew.
    """
    path = cache_folder("air") / f"{_key(ctx, kind)}.npz"
    return arrays_once(
        path,
        lambda: make_tables(ctx, kind, orders=ORDERS, progress=progress),
        _is_complete,
        "tables of the air are made again next time",
    )


def _key(ctx: moderngl.Context, kind: AirKind) -> str:
    shaders = assets.shaders() / "air"
    texts = [(shaders / f"{name}.glsl").read_text("utf-8") for name in _SHADERS]
    texts += [
        (shaders / f"{name}.frag").read_text("utf-8") for name in ("transmittance", "diffuse")
    ]
    air = replace(kind.air, absorbers=())
    what = (_FIRST, _NEXT, ORDERS, TABLES, astuple(replace(kind, air=air)), AIR.dtype.descr)
    driver = ctx.info["GL_RENDERER"], ctx.info["GL_VERSION"]
    digest = hashlib.sha256(repr((what, driver, texts)).encode())
    digest.update(profile_table(kind.air).tobytes())
    digest.update(absorption_table(kind.air).tobytes())
    return digest.hexdigest()


def _is_complete(arrays: dict[str, Array32]) -> bool:
    """Whether every table is there, of its size, and finite."""
    return set(arrays) == set(TABLES) and all(
        arrays[name].shape == shape
        and arrays[name].dtype == np.float32
        and bool(np.isfinite(arrays[name]).all())
        for name, shape in TABLES.items()
    )


def make_tables(
    ctx: moderngl.Context,
    kind: AirKind,
    *,
    orders: int,
    progress: ProgressCallback | None = None,
) -> dict[str, Array32]:
    """The tables, drawn; of no orders, the diffuse ones are zero.

    About 3 s on two cores of a CPU renderer, nearly all of it in the diffuse light.
    """
    air = UniformBuffer(ctx, AIR)
    air.write(air_values(kind, np.eye(4)))
    air.bind()
    maker = _Maker(ctx, kind.air)
    g = np.array(kind.air.aerosol_asymmetry)
    try:
        tables = {name: np.zeros(shape, np.float32) for name, shape in TABLES.items()}
        tables["transmittance_table"] = maker.transmittance()
        for order in range(orders):
            if order == 0:
                peak = maker.rings("aureole", tables)[0]
                aureole = aureole_strength(_FIRST, kind.radius, g, peak)
                once = skylight(
                    _FIRST, kind.radius, g, maker.rings("first", tables), aureole
                ).tables
                light = once
            else:
                field = maker.rings("next", tables)
                more = skylight(_NEXT, kind.radius, g, field, np.zeros_like(aureole)).tables
                light = tuple(a + b for a, b in zip(once, more, strict=True))
            names = ("mean", "mxx", "mzz", "mxz", "down", "aureole", "by_look", "by_look_x")
            for name, table in zip(names, light, strict=True):
                tables[f"diffuse_{name}"] = table.astype(np.float32)
            if progress is not None:
                progress(order + 1, orders)
        return tables
    finally:
        release_all(ctx, maker, air)


class _Maker:
    """The programs and targets that draw tables; what they draw comes back as arrays."""

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, air: Atmosphere) -> None:
        self._ctx = ctx
        self._medium = medium_textures(ctx, air)
        self._defines = medium_defines(air)
        self._program = FullscreenProgram(
            ctx, "air/transmittance", _TABLE, [*self._medium], self._defines, shared=[AIR]
        )
        self._rings: dict[str, tuple[FullscreenProgram, Rings, list[str]]] = {}
        self._ring_program("first", _FIRST, ["transmittance_table"], "WITHOUT_DIFFUSE")
        self._ring_program(
            "aureole",
            _FIRST,
            ["transmittance_table"],
            "WITHOUT_DIFFUSE",
            "WITHOUT_RAYLEIGH",
            "AUREOLE",
        )
        self._ring_program("next", _NEXT, ["diffuse_down", *SCATTERING], "WITHOUT_SUN")

    def _ring_program(self, name: str, rings: Rings, samplers: list[str], *variant: str) -> None:
        defines = {"ABOVE": rings.above, "AROUND": rings.around, "STEPS": rings.steps}
        defines |= self._defines | dict.fromkeys(variant, 1)
        program = FullscreenProgram(
            self._ctx,
            "air/diffuse",
            _TABLE,
            [*self._medium, *samplers],
            shared=[AIR],
            defines=defines,
        )
        self._rings[name] = program, rings, samplers

    def transmittance(self) -> Array32:
        values = {"table_size": _TRANSMITTANCE, "nodes": np.zeros((_NODES, 4))}
        return self._drawn(self._program, values, [*self._medium.values()], _TRANSMITTANCE, 1)[0]

    def rings(self, name: str, tables: dict[str, Array32]) -> tuple[Array, Array, Array]:
        """Three harmonics of the light on rings, (rings, heights, suns, 4) each."""
        program, rings, samplers = self._rings[name]
        count = rings.above + rings.below
        nodes = np.zeros((_NODES, 4))
        nodes[:count, :2] = rings.nodes
        textures = [texture_of(self._ctx, tables[name]) for name in samplers]
        values = {"table_size": (SUNS, HEIGHTS), "nodes": nodes}
        size = SUNS, HEIGHTS * count
        drawn = self._drawn(program, values, [*self._medium.values(), *textures], size, 3)
        for texture in textures:
            texture.release()
        zero, one, two = (a.reshape(count, HEIGHTS, SUNS, 4).astype(np.float64) for a in drawn)
        return zero, one, two

    def _drawn(
        self,
        program: FullscreenProgram,
        values: dict[str, object],
        textures: Sequence[Texture],
        size: tuple[int, int],
        outputs: int,
    ) -> list[Array32]:
        target = ImageTarget(self._ctx, size, (Format("f4", 4),) * outputs)
        State().apply(self._ctx, target.framebuffer, (0, 0, *size))
        program.draw(values, textures)
        drawn = [np.array(target.read(i)) for i in range(outputs)]
        release_all(self._ctx, target)
        return drawn

    def release(self) -> None:
        for texture in self._medium.values():
            texture.release()
        self._program.release()
        for program, _, _ in self._rings.values():
            program.release()


def texture_of(ctx: moderngl.Context, array: Array32) -> Texture:
    """A table (rows, columns, 4), or (layers, rows, columns, 4), held beyond its ends."""
    *depth, height, width, _ = array.shape
    size, data = (width, height), array.tobytes()
    texture: Texture
    if depth:
        texture = ctx.texture3d((*size, depth[0]), 4, data, dtype="f4")
        texture.repeat_z = False
    else:
        texture = ctx.texture(size, 4, data, dtype="f4")
    texture.repeat_x = texture.repeat_y = False
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    return texture
