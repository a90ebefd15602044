"""Scenario files: TOML tables, checked strictly and turned into frozen descriptions of a scene.

schema              every table, key, unit and limit; a new key starts here
loader              file or dictionary -> Scenario; load_scenario, scenario_from_dict
spacecraft_tables   [spacecraft.NAME]: model, trajectory, attitude, joints
camera_tables       [camera.NAME]: mount and pointing (its lens and detector: simgl.camera)
bands_table         [bands]
environment_tables  [sun], [earth], [sky]
lamp_tables         [lamp.NAME]
uncertainty         [uncertainty]: what draws of an assessment vary
table_checks        checks that several tables share
scenario            Scenario, and SceneState from it at any time

May import camera, config, model_files, motion, physics and scene; nothing that draws.
"""
