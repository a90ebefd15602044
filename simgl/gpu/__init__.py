"""OpenGL: contexts, shader programs, uniform blocks, render targets and pipeline state.

``context`` opens a headless context and makes one current (``window_systems``: EGL, GLX, OSMesa;
``osmesa``: the fallback without EGL). ``glsl`` assembles shader files, ``program`` compiles and
checks them while ``held_signals`` keeps signals out of moderngl, ``uniform_blocks`` generates GLSL
from numpy dtypes, ``handed_values`` hands their values on. ``fullscreen``, ``tile_quads`` (by
``triangles``) and ``vertex_buffers`` draw; ``compute_program`` computes, ``fourier`` transforms;
``pipeline_state`` sets the complete state of a draw; ``render_targets`` holds textures and
framebuffers, ``texture_levels`` textures with given levels, ``mesh_tables`` meshes as textures;
``timers`` measures passes.

May import ``simgl.arrays``, ``assets``, ``errors`` and ``lru_cache``; knows nothing of spacecraft.
A way to draw or a kind of GPU resource that several passes need belongs here, a pass does not.
"""
