"""The image source of Basilisk: its vizInterface asks, simgl's camera model answers.

::

    wire    bytes to messages, by field number
    scene   messages to a scene and a camera
    front   the answers, one REQ peer beside the other
    replay  recorded messages to image files
"""
