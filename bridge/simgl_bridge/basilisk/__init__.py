"""The image source of Basilisk: its vizInterface asks, simgl's camera model answers.

- ``viz_messages``: protobuf messages of the wire, read by field number
- ``viz_scene``, ``planets``: from a message to a scene and a camera
- ``camera_overrides``: camera parameters that the wire does not carry
- ``camera_png``, ``endpoint``: the image and the replies at a ZeroMQ address
- ``recording_replay``: images of recorded messages

It may import ``simgl`` and ``simgl_bridge``; only ``commands`` imports it. A new field
of the wire is added to ``viz_messages``, its effect to ``viz_scene``.
"""
