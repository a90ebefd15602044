"""Images along a trajectory: epochs, a run that can be resumed, its table, its video.

``epoch_options``  options of the command line that choose epochs (light: imported at start-up)
``epochs``         regular and random epochs, and those at which an event begins
``journal``        the table of a run in SQLite, and the loop over the frames that it lacks
``run_sequence``   ``simgl sequence``: files of each frame and camera, then its row
``event_stream``   ``simgl events``: what an event camera sees between sub-frames
``event_files``    its events in HDF5, AEDAT4 or npz

May import the simulator, ``output`` and ``workers``; assessments and campaigns use its epochs and
journal. A new event is a name in ``epoch_options.Event`` and a condition in ``epochs``.
"""
