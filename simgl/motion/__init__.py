"""Everything that moves: orbits, attitudes, joints, camera mounts and pointing.

trajectory     laws of position and attitude; ``poses`` evaluates them for all spacecraft
orbits         Keplerian with J2, SGP4, Clohessy-Wiltshire
samples        interpolation of sampled trajectories, attitudes and joint angles
joints, drives transforms of jointed parts; joint angles over time and sun tracking
mounts, pointing
               where cameras sit and look
files          readers of CCSDS, STK, TLE and CSV files

Imports ``physics`` and lower layers. A new law is a class with ``state(tai_ns)`` in orbits or
trajectory and its keys in simgl/scenario/spacecraft_tables.
"""
