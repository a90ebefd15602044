"""The objects of a glTF 2.0 file that simgl reads; everything else is ignored.

Field names are those of the format, in snake case. Numbers are doubles.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from msgspec import Meta, Struct, field

Index = Annotated[int, Meta(ge=0)]
Count = Annotated[int, Meta(ge=1)]
Fraction = Annotated[float, Meta(ge=0.0, le=1.0)]
NonNegative = Annotated[float, Meta(ge=0.0)]
Pair = tuple[float, float]
Triple = tuple[float, float, float]
Quad = tuple[float, float, float, float]

# Extensions that simgl reads, at least in part.
READ_EXTENSIONS = (
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_texture_transform",
)

# Modes of primitives; those below are points and lines.
TRIANGLES, TRIANGLE_STRIP, TRIANGLE_FAN = 4, 5, 6


class Object(Struct, frozen=True, rename="camel", kw_only=True):
    """A glTF object."""


class Accessor(Object, frozen=True):
    """Typed values in a buffer view."""

    component_type: Literal[5120, 5121, 5122, 5123, 5125, 5126]
    count: Count
    type: Literal["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"]
    buffer_view: Index | None = None
    byte_offset: Index = 0
    normalized: bool = False
    sparse: dict[str, Any] | None = None


class BufferView(Object, frozen=True):
    """A range of a buffer."""

    buffer: Index
    byte_offset: Index = 0
    byte_length: Index | None = None
    byte_stride: Count | None = None


class Buffer(Object, frozen=True):
    """Bytes: a data URI, another file, or the binary chunk."""

    uri: str | None = None


class Image(Object, frozen=True):
    """A PNG or JPEG image: a data URI, another file, or a buffer view."""

    uri: str | None = None
    buffer_view: Index | None = None


class Sampler(Object, frozen=True):
    """How an image continues past its edges; filtering is always on."""

    wrap_s: Literal[33071, 33648, 10497] = 10497
    wrap_t: Literal[33071, 33648, 10497] = 10497


class Texture(Object, frozen=True):
    """An image with a sampler."""

    sampler: Index | None = None
    source: Index | None = None


class TextureTransform(Object, frozen=True):
    """KHR_texture_transform: offset after rotation after scale."""

    offset: Pair = (0.0, 0.0)
    rotation: float = 0.0
    scale: Pair = (1.0, 1.0)
    tex_coord: Index | None = None


class TextureExtensions(Object, frozen=True, rename=None):
    """Extensions of a texture's use."""

    transform: TextureTransform | None = field(name="KHR_texture_transform", default=None)


class TextureUse(Object, frozen=True):
    """A texture on a material.

    scale : of a normal map only
    """

    index: Index
    tex_coord: Index = 0
    scale: float = 1.0
    extensions: TextureExtensions = TextureExtensions()


class Pbr(Object, frozen=True):
    """Metallic-roughness factors and textures."""

    base_color_factor: Quad = (1.0, 1.0, 1.0, 1.0)
    metallic_factor: float = 1.0
    roughness_factor: float = 1.0
    base_color_texture: TextureUse | None = None
    metallic_roughness_texture: TextureUse | None = None


class EmissiveStrength(Object, frozen=True):
    """KHR_materials_emissive_strength."""

    emissive_strength: NonNegative = 1.0


class Clearcoat(Object, frozen=True):
    """KHR_materials_clearcoat."""

    clearcoat_factor: Fraction = 0.0
    clearcoat_roughness_factor: Fraction = 0.0
    clearcoat_texture: Any = None
    clearcoat_roughness_texture: Any = None
    clearcoat_normal_texture: Any = None


class MaterialExtras(Object, frozen=True, rename=None):
    """simgl's keys in a material's extras; see docs/models.md."""

    nir_reflectance: float | None = None
    nir_emission: float = 0.0
    simgl_finish: str | None = None
    simgl_lambertian: bool = False


class Material(Object, frozen=True):
    """A material; extensions and extras are checked where they are used."""

    name: str | None = None
    pbr_metallic_roughness: Pbr = Pbr()
    double_sided: bool = False
    normal_texture: TextureUse | None = None
    emissive_texture: TextureUse | None = None
    emissive_factor: Triple = (0.0, 0.0, 0.0)
    alpha_mode: Literal["OPAQUE", "MASK", "BLEND"] = "OPAQUE"
    alpha_cutoff: NonNegative = 0.5
    extensions: dict[str, Any] = field(default_factory=dict)
    extras: Any = None


class Attributes(Object, frozen=True, rename="upper"):
    """Accessors of a primitive's vertices."""

    position: Index
    normal: Index | None = None
    texcoord_0: Index | None = None
    texcoord_1: Index | None = None
    color_0: Index | None = None


class Primitive(Object, frozen=True):
    """Triangles of one material; points and lines, which are not drawn."""

    attributes: Attributes
    indices: Index | None = None
    material: Index | None = None
    mode: Annotated[int, Meta(ge=0, le=TRIANGLE_FAN)] = TRIANGLES


class Mesh(Object, frozen=True):
    """The primitives of a node."""

    primitives: tuple[Primitive, ...]


class Node(Object, frozen=True):
    """A node of the scene tree."""

    name: str | None = None
    mesh: Index | None = None
    children: tuple[Index, ...] = ()
    matrix: Annotated[tuple[float, ...], Meta(min_length=16, max_length=16)] | None = None
    rotation: Quad = (0.0, 0.0, 0.0, 1.0)
    scale: Triple = (1.0, 1.0, 1.0)
    translation: Triple = (0.0, 0.0, 0.0)


class Scene(Object, frozen=True):
    """The roots of the tree."""

    nodes: tuple[Index, ...] = ()


class Gltf(Object, frozen=True):
    """The whole file."""

    accessors: tuple[Accessor, ...] = ()
    buffer_views: tuple[BufferView, ...] = ()
    buffers: tuple[Buffer, ...] = ()
    extensions_required: tuple[str, ...] = ()
    images: tuple[Image, ...] = ()
    materials: tuple[Material, ...] = ()
    meshes: tuple[Mesh, ...] = ()
    nodes: tuple[Node, ...] = ()
    samplers: tuple[Sampler, ...] = ()
    scene: Index = 0
    scenes: tuple[Scene, ...] = ()
    textures: tuple[Texture, ...] = ()
