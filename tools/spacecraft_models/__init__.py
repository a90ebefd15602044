"""Generators of the shipped spacecraft: ``python -m tools.spacecraft_models [NAME ...]``.

One module per spacecraft gives a ``GeneratedModel``; ``shapes``, ``fittings`` and ``trusses`` build
its geometry, ``materials`` its surfaces, ``reentry_skin`` a tiled hull. ``glb`` and ``model_card``
write the two files, byte for byte the same each time. Add a model to ``__main__.GENERATORS``.
"""
