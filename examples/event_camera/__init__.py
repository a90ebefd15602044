"""Events of an approach, drawn over the image of a frame camera.

``docking.toml``   the scene and its event camera
``__main__``       ``python -m examples.event_camera --out DIR`` makes the sheet

Needs no extra: the events stay in memory.
"""
