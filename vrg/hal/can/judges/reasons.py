"""The reasons for which the motors of a robot must be off, as its judges find them in what the drives report."""

import enum
from typing import NamedTuple

_CUT_POWER = "though it was ordered to be off: cut the power of its motor"
_BATTERY = "Charge or change the battery, or correct `supply` in the wiring of this robot"


class Cause(enum.Enum):
    """What is wrong with a drive; the value is its words, in which details take the places of braces."""

    REPORTED = "{}"
    NO_HEARTBEAT = "no heartbeat for {:g} s"
    NO_REPORT = "it has not said for {:g} s whether its motor is on"
    NO_ENCODER = "no encoder message for {:g} s, though it is alive: {}"
    QUIET = "nothing was heard of it for {:g} s: check its wires and its plug."
    DEAF = "it answers nothing: check its wires and its plug."
    WIRES = (
        "its frames or its setpoints were lost {} times within {:g} s, for long enough to stop its motor. Check the "
        "wires and the plug of this drive"
    )
    SWAPPED = (
        "its drive has serial number {}, expected {}: were ids or plugs swapped? Swap them back. Where another drive "
        "is meant, calibrate and connect the robot anew"
    )
    LOW_SUPPLY = (
        "its supply has {:.3g} V, where an empty battery has {:g} V: is the emergency switch released? " + _BATTERY
    )
    HIGH_SUPPLY = "its supply has {:.3g} V, where a full battery has {:g} V: is it the right one? " + _BATTERY
    ON = f"it is on, {_CUT_POWER}"
    TURNS = f"it turns at {{:.3g}} turn/s, {_CUT_POWER}"


class Reason(NamedTuple):
    """What is wrong with one drive: the id of its node, the cause, and the values that its words tell."""

    node: int
    cause: Cause
    details: tuple[object, ...] = ()

    def __str__(self) -> str:
        return f"node {self.node}: {self.cause.value.format(*self.details)}"
