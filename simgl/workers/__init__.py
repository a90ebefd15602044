"""Frames of one scenario, rendered in this process or by workers on this and other machines.

``frame_job``      the protocol of a job, and of what executes it
``executors``      serial execution, and the choice that ``--workers`` and ``--scheduler`` ask for
``dask_executor``  worker processes by Dask distributed; imported only where Dask is needed

May import the simulator and everything below it; campaigns, assessments and sweeps import it.
A new kind of work implements ``Job``; a new way to run jobs is another ``Executor``.
"""
