"""The commands of ``simgl``, each a function whose parameters are its options.

``command_line``          option groups as dataclasses, and how commands print
``render_commands``       render, sequence, campaign, exposure
``assess_command``        assess: one epoch, a trajectory, a sweep
``record_command``        record: ROS 2 messages in a file
``ros2_command``          ros2: ROS 2 topics on the network
``events_command``        events: what an event camera sees, in a file
``thermal_command``       thermal: temperatures along a trajectory
``bench_command``         bench: a set of scenes, a baseline, a page
``start_commands``        new, example: files to begin with
``inspection_commands``   doctor, view, camera test and export, model check and turntable
``completion``            what a shell may complete
``web_options``           options of the browser view
``usage_line``            errors of a command line in one line
``application``           registers the commands, and prints errors

Whatever is slow to import is imported inside the command, so that ``simgl --help`` starts at once.
Of the rest of simgl, only ``errors``, ``progress`` and ``epoch_options`` may be imported at the
top. A new command is a function here and a line in ``application``.
"""
