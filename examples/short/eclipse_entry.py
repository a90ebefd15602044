"""Eclipse entry and exit of the target, to a millisecond."""

import simgl
from simgl import Event

scenario = simgl.load_scenario("examples/trajectories/files.toml")
start = scenario.epoch_tai_ns
stop, step = start + 5_400 * 10**9, 120 * 10**9
for event in (Event.ECLIPSE_ENTRY, Event.UMBRA_ENTRY, Event.UMBRA_EXIT, Event.ECLIPSE_EXIT):
    for tai_ns in simgl.event_epochs(scenario, event, "navcam", "target", start, stop, step):
        print(f"{simgl.utc_from_tai_ns(tai_ns)}  {event.value}")
