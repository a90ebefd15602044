"""Fragment shaders as compute shaders: the same text, and what a draw does around it.

A compute shader writes images where a fragment shader has outputs, and looks a depth up in one
where a draw has its depth test.
"""

from __future__ import annotations

import re
from dataclasses import replace

import moderngl

from simgl.errors import ShaderError
from simgl.gpu.glsl import Stage
from simgl.gpu.pipeline_state import ONE_MINUS_SRC1_COLOR

GLSL_VERSION = 430
# Of a workgroup, along both axes [pixels].
WORKGROUP = 8
# The image unit of the depths; the outputs have those before.
DEPTHS_UNIT = 7
# The binding of a buffer whose first word is the end of the rows that are drawn.
ROWS_BINDING = 0
# What a draw sets: x, y, width, height [pixels]; whether that buffer ends them; the depth of all
# that is drawn, 0..1; the test of ``DEPTH_TESTS``, and whether the depth is written; of ``BLENDS``.
_PARAMETERS = (
    *("drawn_area", "ends_with_rows"),
    *("drawn_depth", "depth_test", "writes_depth", "blending"),
)
# What passes if the drawn depth compares so with the one that is there; all that is drawn.
DEPTH_TESTS = {"1": 0, "<": 1, ">": 2, "!=": 3}
# By a state's ``blend``: what of the drawn colour counts; what of that which is there: none, all of
# it, or what the second source leaves.
BLENDS = {
    None: (1, 0),
    (moderngl.ONE, moderngl.ONE): (1, 1),
    (moderngl.ONE, ONE_MINUS_SRC1_COLOR): (1, 2),
    (moderngl.ZERO, ONE_MINUS_SRC1_COLOR): (0, 2),
}

_OUTPUT = re.compile(
    r"^(?:layout\(location = (?P<location>\d+)(?P<second>, index = 1)?(?:, index = 0)?\) )?"
    r"out (?P<kind>u?vec\d|u?int|float) (?P<name>\w+)(?:\[(?P<count>[^\]]+)\])?;(?P<rest>.*)$"
)
_PLACE = re.compile(r"^#line (\d+) (\d+)$")
# A texel of an image has four channels.
_TEXELS = {
    "vec4": ("rgba32f, {}) uniform image2D", "blended({}, imageLoad({}, pixel))"),
    "uint": ("{}) writeonly uniform uimage2D", "uvec4({}, 0u, 0u, 0u)"),
    "uvec2": ("{}) writeonly uniform uimage2D", "uvec4({}, 0u, 0u)"),
    "uvec4": ("{}) writeonly uniform uimage2D", "{}"),
}
_HEAD = f"""#version {GLSL_VERSION} core
#define COMPUTE
layout(local_size_x = {WORKGROUP}, local_size_y = {WORKGROUP}) in;
uniform ivec4 drawn_area;
uniform float drawn_depth;
uniform int depth_test, writes_depth, ends_with_rows;
layout(std430, binding = {ROWS_BINDING}) readonly buffer DrawnRows {{ int drawn_rows; }};
const int DRAW_ALL = 0, DRAW_BEFORE = 1, DRAW_BEHIND = 2, DRAW_ELSEWHERE = 3;
layout(r32f, binding = {DEPTHS_UNIT}) uniform image2D depths;
vec4 drawn_at;        // as gl_FragCoord
float shaded_depth;   // as gl_FragDepth
bool discarded = false;
uniform ivec2 blending;
"""
# What is stored of a drawn colour where there is one already.
_BLENDED = """
vec4 blended(vec4 drawn, vec4 there) {
    if (blending.y == 0) return drawn;
#ifdef SECOND_SOURCE
    if (blending.y == 2) there *= 1.0 - SECOND_SOURCE;
#endif
    return float(blending.x) * drawn + there;
}
"""
_TAIL = """
void main() {
    ivec2 place = ivec2(gl_GlobalInvocationID.xy), pixel = drawn_area.xy + place;
    if (any(greaterThanEqual(place, drawn_area.zw))) return;
    if (ends_with_rows != 0 && pixel.y >= drawn_rows) return;
    if (depth_test != DRAW_ALL) {
        float there = imageLoad(depths, pixel).r;
        if (depth_test == DRAW_BEFORE && !(drawn_depth < there)) return;
        if (depth_test == DRAW_BEHIND && !(drawn_depth > there)) return;
        if (depth_test == DRAW_ELSEWHERE && drawn_depth == there) return;
    }
    drawn_at = vec4(vec2(pixel) + 0.5, drawn_depth, 1.0);
    shaded_depth = drawn_depth;
    shade();
    if (discarded) return;
    if (writes_depth != 0) imageStore(depths, pixel, vec4(shaded_depth));
"""


def is_of_draw(uniform: str) -> bool:
    """Whether a uniform is one that ``as_compute`` adds."""
    return uniform in (*_PARAMETERS, "depths") or uniform.endswith("_image")


def as_compute(stage: Stage) -> Stage:
    """The compute shader of a fragment stage whose text ``assemble`` has made.

    Its outputs are RGBA32F, or unsigned; only ``main`` discards; it asks for no derivatives.
    Raises ShaderError for an output that no image holds.
    """
    lines: list[str] = [_HEAD.rstrip("\n")]
    stores: list[str] = []
    # Of the next line, in its file, and the file.
    number, file = 0, 0
    for line in stage.text.splitlines()[1:]:
        number += 1
        if place := _PLACE.match(line):
            number, file = int(place[1]) - 1, int(place[2])
        match = _OUTPUT.match(line)
        if match is None:
            lines.append(line)
            continue
        stores.append(f"STORE_{len(stores)}")
        lines += _image(stage, stores[-1], **match.groupdict())
        lines.append(f"#line {number + 1} {file}")
    text = "\n".join(lines)
    for name, ours in (
        (r"\bvoid main\(\)", "void shade()"),
        (r"\bgl_FragCoord\b", "drawn_at"),
        (r"\bgl_FragDepth\b", "shaded_depth"),
        (r"\bdiscard;", "{ discarded = true; return; }"),
    ):
        text = re.sub(name, ours, text)
    # Only where an output is declared its word is something.
    stored = [f"#ifdef {word}\n    {word}\n#endif\n" for word in stores]
    return replace(stage, text="".join([text, _BLENDED, _TAIL, *stored, "}\n"]))


def _image(
    stage: Stage,
    word: str,
    location: str | None,
    kind: str,
    name: str,
    count: str | None,
    rest: str,
    second: str | None,
) -> list[str]:
    """The lines that declare an output as a variable and an image, and a word that stores it."""
    if second:
        return [f"{kind} {name};{rest}", f"#define SECOND_SOURCE {name}", f"#define {word}"]
    if kind not in _TEXELS:
        raise ShaderError(f"{stage.files[0]}: a compute shader has no image for {kind} {name}")
    image, texel = _TEXELS[kind]
    size, element = (f"[{count}]", "[k]") if count else ("", "")
    each = f"for (int k = 0; k < {count}; ++k) " if count else ""
    at = f"{name}_image{element}"
    layout = image.format(f"binding = {location or 0}")
    return [
        f"{kind} {name}{size};{rest}",
        f"layout({layout} {name}_image{size};",
        f"#define {word} {each}imageStore({at}, pixel, {texel.format(name + element, at)});",
    ]
