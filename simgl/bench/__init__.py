"""The benchmark: time and memory of frames on this machine, end to end and pass by pass.

``scenes``          shipped scenes and named sets of them
``run_bench``       a set or some scenes, one after another, each in a process of its own
``scene_process``   that process: frames, passes, memory, and frames through links
``scene_request``   what that process is asked and answers
``frame_times``     loops that time frames and passes
``start_up``        from the start of a process to its first DN
``child_process``   child processes, bounded in time
``machine``         processor, memory
``earth_tables``    tables and textures of the Earth
``peers``           other renderers on a like target
``results``         what was found, as data and JSON
``goals``           the table of goals in times of the machine's own speed
``comparison``      with the results of an earlier run
``bench_tables``    results in a terminal
``bench_page``      results as an HTML page with plots

A frame is everything from an epoch to the DN array on the CPU: poses, view, passes, read-back.
Through the bridge it is the client's round trip to a server process. Frame times are measured
without pass timers; passes are timed in a second loop, since on a CPU renderer each timer waits for
its pass. A new scene is a file in ``data/bench`` and, if it belongs to a set, a line in ``scenes``.
"""
