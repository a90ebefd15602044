"""``simgl ros2``: images on ROS 2's topics, without an installation of ROS 2.

ROS 2 is DDS with naming rules, and Cyclone DDS is one of its implementations.
"""

from __future__ import annotations

import os

from simgl.errors import ConfigError
from simgl.ros2.run_messages import TF, TopicMessage

try:
    from cyclonedds.core import DDSException, Policy, Qos, ReadCondition, WaitSet
    from cyclonedds.core import InstanceState as Instance
    from cyclonedds.core import SampleState as Sample
    from cyclonedds.core import ViewState as View
    from cyclonedds.domain import Domain, DomainParticipant
    from cyclonedds.pub import DataWriter
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic
    from cyclonedds.util import duration

    from simgl.ros2.dds_types import TYPES, TFMessage, sample_of
except ImportError:
    problem = 'needs Cyclone DDS: pip install "simgl[dds]"'
    raise ConfigError("simgl ros2", "", problem) from None

# States, or images, that wait at a reader.
_QUEUE = 100
_MAX_BLOCKING_S = 10
# Cyclone's own configuration; it names networks, and so on.
_CONFIGURATION = "CYCLONEDDS_URI"
# Without one: this machine only. Type descriptions of Fast DDS (vendor 1.15), which ROS 2 sends
# since Kilted, are ones that Cyclone refuses: types then count by their names.
_LOOPBACK = """<CycloneDDS><Domain Id="any">
<General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>40</MaxAutoParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery>
<Compatibility><IgnoreTypeInformation>1.15</IgnoreTypeInformation></Compatibility>
</Domain></CycloneDDS>"""


class DdsNode:
    """A participant of DDS that writes topics of ROS 2 and reads ``/tf``.

    topics : topic to type of what will be published
    domain : ROS_DOMAIN_ID

    Raises ConfigError where Cyclone DDS cannot start.
    """

    def __init__(self, topics: dict[str, str], domain: int) -> None:
        reliable = Policy.Reliability.Reliable(duration(seconds=_MAX_BLOCKING_S))
        qos = Qos(reliable, Policy.Durability.Volatile, Policy.History.KeepLast(_QUEUE))
        self._qos = qos
        try:
            # A user's configuration is Cyclone's to read.
            self._domain = None if _CONFIGURATION in os.environ else Domain(domain, _LOOPBACK)
            self._participant = DomainParticipant(domain)
            self._writers = {
                topic: DataWriter(self._participant, self._topic(topic, kind), qos=qos)
                for topic, kind in topics.items()
            }
            self._frames = DataReader(self._participant, self._topic("/tf", TF), qos=qos)
            self._arrived = WaitSet(self._participant)
            self._arrived.attach(
                ReadCondition(self._frames, Sample.NotRead | View.Any | Instance.Alive)
            )
        except DDSException as error:
            raise ConfigError("simgl ros2", "--domain", f"cannot be joined: {error}") from None

    def _topic(self, topic: str, kind: str) -> Topic:
        # One object for what is both written and read.
        return Topic(self._participant, f"rt{topic}", TYPES[kind])

    @property
    def middleware(self) -> str:
        """What carries the messages."""
        return "Cyclone DDS, without ROS"

    def reader(self, topic: str, kind: str) -> DataReader:
        """A reader of what other nodes publish on a topic."""
        return DataReader(self._participant, self._topic(topic, kind), qos=self._qos)

    def is_heard(self, topic: str) -> bool:
        """Whether anybody listens to a topic that is published here."""
        return bool(self._writers[topic].get_matched_subscriptions())

    def publish(self, message: TopicMessage) -> None:
        """Write a message where somebody listens."""
        topic, kind, fields = message
        if self.is_heard(topic):
            self._writers[topic].write(sample_of(TYPES[kind], fields))

    def next_frames(self, timeout_s: float) -> TFMessage | None:
        """The next message on ``/tf`` in the order of arrival; None where none comes in time."""
        if not (samples := self._frames.take(N=1)):
            self._arrived.wait(duration(seconds=timeout_s))
            samples = self._frames.take(N=1)
        return next((s for s in samples if isinstance(s, TFMessage)), None)

    def close(self) -> None:
        """Leave the domain."""
        self._arrived = self._frames = self._participant = self._domain = None
        self._writers = {}
