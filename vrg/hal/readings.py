"""The reading of a robot at one instant: its state, and a sample of each of its sensors."""

from collections.abc import Sequence
from typing import TypeVar

from msgspec import Struct

from vrg.bus.mailbox import Inlet
from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.spec import Sample

S = TypeVar("S", bound=SensorMessage)


def samples_of(inlets: Sequence[tuple[str, Inlet[SensorMessage]]], now: float) -> list[Sample[SensorMessage]]:
    """The newest sample of each sensor that the world simulates.

    The age of a sample is the absolute difference of its stamp and now. A stamp far in the future is from before the
    world was set back to a snapshot, so the sample is old.

    Args:
        inlets: the name of each sensor on its robot, and where its readings arrive. now: match time, s.
    """
    return [
        Sample(received.stamp, abs(now - received.stamp), received.body, name)
        for name, inlet in inlets
        if (received := inlet.latest) is not None
    ]


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
        """
        for sample in self.samples:
            if isinstance(sample.value, kind) and (name is None or sample.name == name):
                return sample  # type: ignore[return-value]
        return None
