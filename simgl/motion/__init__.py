"""Where things are and how they point: orbits, trajectories, attitudes, joints, camera mounts."""
