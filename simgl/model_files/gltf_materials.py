"""The materials of a glTF file with their images."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np
from msgspec import Struct

from simgl.arrays import Array
from simgl.config.validation import fitted
from simgl.errors import AssetError, ConfigError, did_you_mean
from simgl.model_files import gltf_schema as schema
from simgl.model_files.gltf_file import GltfFile
from simgl.model_files.gltf_images import read_image
from simgl.model_files.surface_tables import load_finish
from simgl.scene.materials import Material
from simgl.scene.surface_layers import SMOOTHEST, Coat
from simgl.scene.textures import CLAMP, MIRROR, REPEAT, Image, Maps, SurfaceTextures

_WRAPS = {10497: REPEAT, 33071: CLAMP, 33648: MIRROR}
_WORDS = {
    "base_colour": "base colour texture",
    "law": "metallic-roughness texture",
    "normal": "normal map",
    "emission": "emissive texture",
}

T = TypeVar("T", bound=Struct)


@dataclass(frozen=True, kw_only=True)
class UvFrame:
    """How a material places its images: a set of texture coordinates and an affine map."""

    tex_coord: int
    offset: schema.Pair
    rotation: float
    scale: schema.Pair

    def place(self, uv: Array) -> Array:
        """(n, 2) places in the image of (n, 2) texture coordinates; a turn is counter-clockwise
        in the plane of u and v."""
        c, s = np.cos(self.rotation), np.sin(self.rotation)
        # v runs down the image, which mirrors the turn.
        turn = np.array([[c, s], [-s, c]])
        return uv * self.scale @ turn.T + self.offset


@dataclass(frozen=True, kw_only=True)
class Palette:
    """The surfaces of a file.

    frames : of each material; None for one without images
    """

    materials: tuple[Material, ...]
    frames: tuple[UvFrame | None, ...]
    textures: SurfaceTextures
    notes: tuple[str, ...]


def read_palette(file: GltfFile) -> Palette:
    """All materials of a file; raises AssetError or ConfigError, in one line."""
    layers = _Layers(file)
    notes: list[str] = []
    materials, frames = [], []
    for index, surface in enumerate(file.gltf.materials):
        name = surface.name or f"material_{index}"
        reader = _MaterialReader(file, name, surface)
        maps, frame = reader.maps(layers)
        materials.append(reader.material(maps))
        frames.append(frame)
        notes += [f'material "{name}": {note}' for note in reader.notes]
    return Palette(
        materials=tuple(materials),
        frames=tuple(frames),
        textures=layers.textures,
        notes=tuple(notes),
    )


class _Layers:
    """The images of a file, each read once for each kind and wrap."""

    def __init__(self, file: GltfFile) -> None:
        self._file = file
        self._read: dict[str, dict[tuple[int, tuple[int, int]], Image]] = {k: {} for k in _WORDS}

    def layer(self, kind: str, use: schema.TextureUse) -> int:
        """The number of a texture among its kind."""
        gltf = self._file.gltf
        texture = self._file.item("texture", gltf.textures, use.index)
        if texture.source is None:
            raise AssetError(f"{self._file.path}: texture {use.index} names no PNG or JPEG image")
        sampler = schema.Sampler()
        if texture.sampler is not None:
            sampler = self._file.item("sampler", gltf.samplers, texture.sampler)
        wrap = _WRAPS[sampler.wrap_s], _WRAPS[sampler.wrap_t]
        known = self._read[kind]
        if (texture.source, wrap) not in known:
            values = read_image(self._file, kind, texture.source)
            known[texture.source, wrap] = Image(values=values, wrap=wrap)
        return list(known).index((texture.source, wrap))

    @property
    def textures(self) -> SurfaceTextures:
        """All that were read."""
        return SurfaceTextures(**{k: tuple(read.values()) for k, read in self._read.items()})


@dataclass
class _MaterialReader:
    """One material of the file, with notes on what it asks for and is not drawn."""

    file: GltfFile
    name: str
    surface: schema.Material
    notes: list[str] = field(default_factory=list)

    def maps(self, layers: _Layers) -> tuple[Maps, UvFrame | None]:
        """Its images; those that do not share the frame of the first are left out with a note."""
        pbr = self.surface.pbr_metallic_roughness
        extras = self._extras()
        finished = extras.simgl_finish is not None
        one_law = finished or extras.simgl_lambertian
        uses = {
            "base_colour": None if finished else pbr.base_color_texture,
            "law": None if one_law else pbr.metallic_roughness_texture,
            "normal": self.surface.normal_texture,
            # A texture on zero emission has no effect.
            "emission": self.surface.emissive_texture if any(self._emission()) else None,
        }
        chosen: dict[str, int] = {}
        frame: UvFrame | None = None
        for kind, use in uses.items():
            if use is None:
                continue
            frame_of_use = _frame(use)
            if frame_of_use.tex_coord > 1:
                self.notes.append(
                    f"{_WORDS[kind]} on texture coordinates {frame_of_use.tex_coord} is not drawn"
                )
                continue
            if frame is not None and frame_of_use != frame:
                first = _WORDS[next(iter(chosen))]
                self.notes.append(f"{_WORDS[kind]}, placed unlike the {first}, is not drawn")
                continue
            frame = frame_of_use
            chosen[kind] = layers.layer(kind, use)
        normal = uses["normal"]
        return Maps(**chosen, normal_scale=1.0 if normal is None else normal.scale), frame

    def _part(self, key: str, table: type[T]) -> T:
        """One of its extensions, with the defaults where the file has none."""
        data = self.surface.extensions.get(key, {})
        return fitted(data, table, f'{self.file.path} material "{self.name}" {key}')

    def _extras(self) -> schema.MaterialExtras:
        extras = self.surface.extras if isinstance(self.surface.extras, dict) else {}
        where = f'{self.file.path} material "{self.name}" extras'
        known = schema.MaterialExtras.__struct_fields__
        for key in extras:
            # Keys of other programs are theirs.
            if key.startswith("simgl_") and key not in known:
                raise ConfigError(where, key, f"is not a key here; {did_you_mean(key, known)}")
        return fitted(extras, schema.MaterialExtras, where)

    def _emission(self) -> schema.Quad:
        key = "KHR_materials_emissive_strength"
        strength = self._part(key, schema.EmissiveStrength).emissive_strength
        red, green, blue = (strength * factor for factor in self.surface.emissive_factor)
        return red, green, blue, self._extras().nir_emission

    def _coat(self) -> Coat | None:
        coat = self._part("KHR_materials_clearcoat", schema.Clearcoat)
        if coat.clearcoat_factor == 0.0:
            return None
        textures = {
            "clear coat texture": coat.clearcoat_texture,
            "clear coat roughness texture": coat.clearcoat_roughness_texture,
            "clear coat normal map": coat.clearcoat_normal_texture,
        }
        self.notes += [f"{what} is not drawn" for what, it in textures.items() if it is not None]
        self._note_smooth("clear coat roughness", coat.clearcoat_roughness_factor)
        roughness = max(coat.clearcoat_roughness_factor, SMOOTHEST)
        return Coat(strength=coat.clearcoat_factor, roughness=roughness)

    def _note_smooth(self, what: str, roughness: float) -> None:
        if roughness < SMOOTHEST:
            self.notes.append(f"{what} {roughness:g} is raised to {SMOOTHEST:g}")

    def material(self, maps: Maps) -> Material:
        """Its factors."""
        pbr = self.surface.pbr_metallic_roughness
        red, green, blue, alpha = pbr.base_color_factor
        extras = self._extras()
        try:
            if extras.simgl_finish is not None:
                # The finish stands for colour, law and coat; relief and light stay the file's.
                finish = load_finish(extras.simgl_finish)
                return replace(finish, name=self.name, emission=self._emission(), maps=maps)
        except AssetError as error:
            where = f'{self.file.path} material "{self.name}" extras'
            raise AssetError(f"{where}: simgl_finish names {error}") from None
        nir = extras.nir_reflectance
        if self.surface.alpha_mode == "BLEND":
            self.notes.append("transparency is not drawn")
        if not extras.simgl_lambertian:
            self._note_smooth("roughness", pbr.roughness_factor)
        self.notes += [
            f"{extension} is not drawn"
            for extension in self.surface.extensions
            if extension not in schema.READ_EXTENSIONS
        ]
        try:
            return Material(
                name=self.name,
                # Without a near-infrared reflectance the red one stands in.
                reflectance=(red, green, blue, red if nir is None else nir),
                metallic=0.0 if extras.simgl_lambertian else pbr.metallic_factor,
                roughness=None if extras.simgl_lambertian else max(pbr.roughness_factor, SMOOTHEST),
                coat=self._coat(),
                emission=self._emission(),
                coverage=alpha,
                cutoff=self.surface.alpha_cutoff if self.surface.alpha_mode == "MASK" else None,
                maps=maps,
            )
        except ValueError as error:
            raise AssetError(f"{self.file.path}: {error}") from None


def _frame(use: schema.TextureUse) -> UvFrame:
    transform = use.extensions.transform or schema.TextureTransform()
    return UvFrame(
        tex_coord=use.tex_coord if transform.tex_coord is None else transform.tex_coord,
        offset=transform.offset,
        rotation=transform.rotation,
        scale=transform.scale,
    )
