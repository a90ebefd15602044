"""Whether Mesa's llvmpipe frees a fence whose lock one of its threads holds, and what follows.

python -m benchmarks.driver_threads --out FILE.json [--runs 10] [--seconds 5]

Draws small scenes into six targets and compiles new shaders between, in processes of their own
with ``watch.c`` before Mesa (it needs a C compiler and Mesa's 22.3 layout of a fence). Of the
threads' signals of fences each fifth is held up, as if another process took the core. The C
library reuses freed memory at once, so that damage to it shows. Counts processes that died:

    freed          as it is
    kept           fences that are in use are not freed
    no threads     LP_NUM_THREADS=0
    not held       nothing is held up
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import msgspec

from benchmarks.record import load, write_record

_WATCH = Path(__file__).with_name("watch.c")
_DRAW = """\
import sys, time
import moderngl

VERTEX = '''#version 330
void main() { gl_Position = vec4(vec2(gl_VertexID % 2, gl_VertexID / 2) * 4.0 - 1.0, 0.0, 1.0); }'''
FRAGMENT = '''#version 330
out vec4 c;
void main() {
    c = vec4(NUMBER);
    for (int i = 0; i < 8; i++) c += sin(gl_FragCoord.x * float(i));
}'''

ctx = moderngl.create_context(standalone=True, backend="egl", require=330)
targets = [ctx.framebuffer([ctx.texture((64, 64), 4, dtype="f4")]) for _ in range(6)]
end, turn = time.monotonic() + float(sys.argv[1]), 0
while time.monotonic() < end:
    if turn % 10 == 0:
        fragment = FRAGMENT.replace("NUMBER", f"{turn}.0")
        program = ctx.program(vertex_shader=VERTEX, fragment_shader=fragment)
        triangle = ctx.vertex_array(program, [])
    for target in targets:
        target.use()
        triangle.render(moderngl.TRIANGLES, vertices=3)
    ctx.finish()
    turn += 1
"""
_HELD = {"HELD_US": "3000", "AFTER_US": "1000", "EVERY": "5"}
_VARIANTS = {
    "freed": _HELD,
    "kept": _HELD | {"KEEP": "1"},
    "no threads": _HELD | {"LP_NUM_THREADS": "0"},
    "not held": {},
}
_MESSAGE = r"^(?:free\(\)|malloc\(\)|corrupted|double free|Fatal Python error).*"
_REUSED_AT_ONCE = "glibc.malloc.tcache_count=0:glibc.malloc.mxfast=0"


class Variant(msgspec.Struct, kw_only=True):
    """What its processes did.

    freed_in_use : processes in which a fence was freed whose lock was held
    died : of a signal
    messages : of the C library or Python, by number
    """

    runs: int = 0
    freed_in_use: int = 0
    died: int = 0
    messages: dict[str, int] = {}


def _draw(library: Path, seconds: float, changes: dict[str, str]) -> tuple[int, str]:
    environment = os.environ | {
        "LD_PRELOAD": str(library),
        "GLIBC_TUNABLES": _REUSED_AT_ONCE,
        "MESA_SHADER_CACHE_DISABLE": "true",
        "LP_NUM_THREADS": "2",
    }
    done = subprocess.run(
        [sys.executable, "-X", "faulthandler", "-c", _DRAW, str(seconds)],
        env=environment | changes,
        capture_output=True,
        text=True,
        timeout=60.0 + 20.0 * seconds,
        check=False,
    )
    return done.returncode, done.stderr


def _note(variant: Variant, status: int, said: str) -> None:
    variant.runs += 1
    variant.freed_in_use += "first fence freed in use" in said
    variant.died += status < 0
    for message in re.findall(_MESSAGE, said, re.MULTILINE)[:1]:
        variant.messages[message] = variant.messages.get(message, 0) + 1


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    variants = {name: Variant() for name in _VARIANTS}
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "watch.so"
        compiler = ["cc", "-O2", "-Wall", "-shared", "-fPIC", str(_WATCH), "-o", str(library)]
        subprocess.run([*compiler, "-lpthread", "-ldl"], check=True)
        for _ in range(options.runs):
            for name, changes in _VARIANTS.items():
                _note(variants[name], *_draw(library, options.seconds, changes))
                write_record(options.out, {"load": load(), "variants": variants})
    for name, variant in variants.items():
        print(f"{name}: {variant.died} of {variant.runs} died, {variant.freed_in_use} freed in use")


if __name__ == "__main__":
    main()
