"""The reading of a robot at one instant: its state, and a sample of each of its sensors."""

from abc import ABC, abstractmethod
from collections.abc import Container, Iterator, Mapping, Sequence
from typing import Any, TypeVar, overload

from msgspec import Struct

from vrg.bus.codec import Received
from vrg.bus.deferred import Deferred
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Message, SensorMessage
from vrg.bus.topics import Keys
from vrg.hal.sensors.spec import Sample, SensorSpec

S = TypeVar("S", bound=SensorMessage)


class SensorInlets:
    """Where the readings of the sensors arrive that the world simulates for a robot.

    Args:
        keys: the keys of the match. mailbox: the mailbox of the player's node.
        robot: the robot's name. sensors: the specs of these sensors.
    """

    def __init__(self, keys: Keys, mailbox: Mailbox, robot: str, sensors: Sequence[SensorSpec]) -> None:
        self._mailbox = mailbox
        self._inlets = [
            (spec.name, mailbox.subscribe(keys.sensor(spec.message, robot, spec.name), sampled=True))
            for spec in sensors
        ]
        self._source: Mailbox | None = None
        """The mailbox of the world, if it defers readings."""
        self._published, self._deferred = [inlet for _, inlet in self._inlets], 0
        """The inlets of which no reading was deferred, by the number of those that were, on any key."""
        self._of_kind: dict[type[SensorMessage], list[tuple[str, str, str]]] = {}

    def samples(self) -> "Samples":
        """The newest sample of each sensor."""
        if self._source is None:
            self._source = next((inlet.source for _, inlet in self._inlets if inlet.source is not None), None)
        newest = {} if self._source is None else self._source.newest
        if len(newest) != self._deferred:
            self._deferred = len(newest)
            others = [inlet for _, inlet in self._inlets if inlet.topic.key not in newest]
            self._published = [inlet for inlet in others if inlet.source is None or inlet.latest is not None]
        told = {inlet.topic.key: told for inlet in self._published if (told := inlet.latest) is not None}
        return Samples(self, self._mailbox.now, newest, told)

    def of(self, kind: type[SensorMessage]) -> list[tuple[str, str, str]]:
        """The name, the key and the kind of each sensor of a kind, by the class of its messages."""
        found = self._of_kind.get(kind)
        if found is None:
            of = ((name, inlet.topic) for name, inlet in self._inlets)
            found = [(name, topic.key, topic.type.kind) for name, topic in of if issubclass(topic.type, kind)]
            self._of_kind[kind] = found
        return found


class LazySamples(Sequence[Sample[SensorMessage]], ABC):
    """Samples that are made, or fetched, when somebody looks at them. Another process is sent what they are."""

    @abstractmethod
    def of(self, kind: type[S], name: str | None = None) -> Sample[S] | None:
        """The first sample of a kind of sensor: see `Readings.latest`."""

    @abstractmethod
    def all(self) -> Sequence[Sample[SensorMessage]]:
        """All samples."""

    @overload
    def __getitem__(self, index: int) -> Sample[SensorMessage]: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Sample[SensorMessage]]: ...
    def __getitem__(self, index: int | slice) -> Sample[SensorMessage] | Sequence[Sample[SensorMessage]]:
        return self.all()[index]

    def __iter__(self) -> Iterator[Sample[SensorMessage]]:
        return iter(self.all())

    def __len__(self) -> int:
        return len(self.all())

    def __reduce__(self) -> tuple[type[tuple[Any, ...]], tuple[Any, ...]]:
        return tuple, (tuple(self.all()),)


class Samples(LazySamples):
    """The newest sample of each sensor that the world simulates. Each is made when somebody looks at it.

    The age of a sample is the absolute difference of its stamp and now. A stamp far in the future is from before the
    world was set back to a snapshot, so the sample is old.

    Args:
        inlets: where they have arrived. now: match time, s. newest, told: the messages, deferred or not, by key.
    """

    def __init__(
        self,
        inlets: SensorInlets,
        now: float,
        newest: Mapping[str, Deferred[Message]],
        told: Mapping[str, Received[SensorMessage]],
    ) -> None:
        self._inlets, self._now, self._newest, self._told = inlets, now, newest, told

    def of(self, kind: type[S], name: str | None = None) -> Sample[S] | None:
        """The first sample of a kind of sensor: see `Readings.latest`."""
        for own, key, _ in self._inlets.of(kind):
            if (name is None or own == name) and (sample := self._sample(own, key)) is not None:
                return sample  # type: ignore[return-value]
        return None

    def all(self) -> list[Sample[SensorMessage]]:
        """All samples."""
        return self.of_kinds(None)

    def of_kinds(self, kinds: Container[str] | None) -> list[Sample[SensorMessage]]:
        """The samples of sensors of some kinds; None for all."""
        wanted = (sensor for sensor in self._inlets.of(SensorMessage) if kinds is None or sensor[2] in kinds)
        samples = (self._sample(name, key) for name, key, _ in wanted)
        return [sample for sample in samples if sample is not None]

    def _sample(self, name: str, key: str) -> Sample[SensorMessage] | None:
        deferred = self._newest.get(key)
        received: Any = self._told.get(key) if deferred is None else deferred.of(key)
        if received is None:
            return None
        return Sample(received.stamp, abs(self._now - received.stamp), received.body, name)


def samples_of(samples: Sequence[Sample[SensorMessage]], kinds: Container[str]) -> Sequence[Sample[SensorMessage]]:
    """The samples of sensors of some kinds, such as `laser`."""
    if isinstance(samples, Samples):
        return samples.of_kinds(kinds)
    return [sample for sample in samples if sample.value.kind in kinds]


class Readings(Struct, frozen=True, gc=False):
    """The state of a robot and its newest samples. A sensor that it lacks, or that has not reported yet, has no sample.

    Args:
        stamp: the match time at which the robot was last heard, s. age: the match time since then, s.
        armed: True if its motors accept commands. estop: True if the emergency stop is latched.
        fault: what is wrong, in words, without the name of the robot; None if nothing is.
        latched: True if the fault, or an emergency stop that was pressed at the robot itself, stays until a person
            clears it.
        samples: the newest sample of each sensor.
    """

    stamp: float
    age: float
    armed: bool
    estop: bool
    fault: str | None = None
    latched: bool = False
    samples: Sequence[Sample[SensorMessage]] = ()

    def latest(self, kind: type[S], name: str | None = None) -> Sample[S] | None:
        """The newest sample of a sensor, by the class of its message: `readings.latest(Laser)`.

        Args:
            kind: the class of the sensor's message.
            name: the sensor's name on its robot, if it has several of this kind; the default is the first one.

        Returns:
            the sample, or None if the robot has no such sensor or the sensor has not reported yet.

        Raises:
            TypeError: `kind` is no class.
        """
        if not isinstance(kind, type):
            raise TypeError(f"readings.latest: expected the class of a sensor's message, such as Laser, got {kind!r}")
        if isinstance(self.samples, LazySamples):
            return self.samples.of(kind, name)
        for sample in self.samples:
            if isinstance(sample.value, kind) and (name is None or sample.name == name):
                return sample  # type: ignore[return-value]
        return None
