"""Render passes: each module draws one step of a frame in one OpenGL context.

``simgl.rendering.renderer`` orders them from a view to radiance,
``simgl.rendering.camera_pipeline`` from radiance to digital numbers. In the order of a frame:
``shadow`` and ``lamp_shadow`` (shadow maps),
``interreflection`` (light at vertices), ``visibility``, ``gbuffer``, ``reference_gather`` (the same
light by rays), ``surface`` (shading), ``resolve`` and ``warp`` (to pixels), ``motion_sweep`` and
``average`` (an exposure), ``thermal`` (thermal radiance), ``truth``; then ``optics``, ``spread`` or
``compute_spread``, ``exposure``, ``readout``; ``display`` and ``inset`` fill a window.
``background`` draws Earth and sky.

Shared modules: ``drawn_spacecraft``, ``shading_points``, ``even_squares`` (from pass to pass),
``shared_blocks`` (uniform blocks), ``mesh_store``, ``texture_store``, ``outline_program``,
``albedo_table``, ``vertex_sums``, ``page_numbers``. A pass imports these, ``gpu`` and ``view``,
never another pass.

A new pass: a class with ``draw`` and ``release``, a folder of that name in ``shaders/``, a line in
the renderer.
"""
