"""Light along an orbit, without rendering: sunlight on the target and phase angle."""

import numpy as np

import simgl

scenario = simgl.load_scenario("examples/trajectories/files.toml")
for minute in range(0, 100, 10):
    state = scenario.at(scenario.epoch_tai_ns + minute * 60_000_000_000)
    target = state.bodies["target"].pose.position
    camera = state.cameras["navcam"].position - target
    towards_sun = state.sun.seen_from(target).direction_icrf
    phase = np.degrees(np.arccos(towards_sun @ camera / np.linalg.norm(camera)))
    share = state.sunlit_share(target)
    print(f"{simgl.utc_from_tai_ns(state.tai_ns)}  sunlight {share:6.1%}  phase {phase:5.1f} deg")
