"""Functional mock-up units (FMI 3.0, co-simulation) of a scenario's camera.

- ``variables``: the inputs, parameters and outputs of one camera
- ``model_description``: these as ``modelDescription.xml`` and ``buildDescription.xml``
- ``model_header``: these as tables for the C code in ``bridge/cpp/fmi``
- ``compiler``: the shared library, where a compiler is installed
- ``archive``: all of it in one FMU file

A variable is added to ``variables``, and its effect to ``bridge/cpp/fmi/simgl_fmu.c``.
"""
