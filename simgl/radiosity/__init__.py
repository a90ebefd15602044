"""Interreflection: light between surfaces of spacecraft, traced once, solved per frame.

A bake traces rays from a body's surfaces once (``bake``, with ``remesh``, ``patches``,
``gather_points``, ``occlusion``, ``hemisphere``, ``patch_cells``, part by part ``in_turn``;
``light_grids`` where light is uneven, ``near_means`` where it is noise, values for
``interpolation`` between them); its result, a
``light_transport``, stays in memory and in files (``transport_store``). In each frame
``patch_light`` solves for the light that leaves the patches under the ``incident_light``, by
``solver`` and what it has precomputed
(``precomputed_response``, ``sunlit_patches``, ``sky_cells``); metal sends sunlight on in lobes
(``lobe_sunlight``, from ``glossy_places`` in ``lobe_pairs`` by ``reflection_laws``), and others
take it away (``hidden_sunlight``). ``neighbour_light`` adds what spacecraft near each other
exchange to the ``isolated_light`` of each, by the paths of ``between_spacecraft`` from and to each
``near_body``, pairs (``path_pairs``) less those that ``third_bodies`` hide, in
``lobes_to_others`` of metal. ``final_gather`` is the slow reference: rays from single points.
May import ``rays``, ``scene`` and what lies below; knows no OpenGL. A new kind of light belongs
into ``incident_light`` and ``patch_light``.
"""
