"""Looking at model files before they are used: ``simgl model check`` and ``simgl model turntable``.

``model_check``  size, parts, watertightness, joints, materials, and what will not be drawn
``turntable``    a contact sheet from eight sides

May import ``model_files``, ``scenario`` and the simulator. A new check is a field of
``model_check.ModelReport``, and a line in ``report_text``.
"""
