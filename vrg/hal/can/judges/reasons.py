"""The reasons for which the motors of a robot must be off, as its judges find them in what the drives report."""

import enum
from typing import NamedTuple

BUSY = "was this program stopped, or is this computer too busy?"
"""What a person should ask about setpoints that did not come."""
_CUT_POWER = "though it was ordered to be off: cut the power of its motor"
_NOT_ON = "expected closed-loop control, but it is idle"
_BATTERY = "Charge or change the battery, or correct `supply` in the wiring of this robot"


class Cause(enum.Enum):
    """What is wrong with a drive; the value is its words, in which details take the places of braces."""

    REPORTED = "{}"
    NO_HEARTBEAT = "no heartbeat for {:g} s"
    NO_REPORT = "it has not reported for {:g} s whether its motor is on"
    NO_ENCODER = "no encoder message for {:g} s, though it is alive: {}"
    QUIET = "nothing was heard from it for {:g} s: check its wires and its plug."
    DEAF = "it answers nothing: check its wires and its plug."
    WIRES = (
        "its frames or its setpoints were lost {} times within {:g} s, for long enough to stop its motor. Check the "
        "wires and the plug of this drive"
    )
    SWAPPED = (
        "its drive has serial number {}, expected {}: were ids or plugs swapped? Swap them back. If the drive was "
        "replaced on purpose, calibrate the robot and connect it again"
    )
    LOW_SUPPLY = (
        "its supply has {:.3g} V, where an empty battery has {:g} V: is the emergency switch released? " + _BATTERY
    )
    HIGH_SUPPLY = "its supply has {:.3g} V, where a full battery has {:g} V: is it the right one? " + _BATTERY
    REFUSES = _NOT_ON + " and reports {}"
    NO_SETPOINTS = _NOT_ON + ": this computer is too busy, it sent no setpoint for {:.2g} s. Close other programs"
    IDLE = _NOT_ON + " and gives no reason: does it hear this computer, and can it start (see `vrg can scan`)?"
    EXPIRED = f"its watchdog has stopped its motor, as no setpoint came in time: {BUSY}"
    NEVER_STARTS = (
        "it was ordered {} times to start, and still reports that its watchdog has stopped it: it does not hear "
        "this computer. Check the wires and the plug of this drive"
    )
    ON = f"it is on, {_CUT_POWER}"
    TURNS = f"it turns at {{:.3g}} turn/s, {_CUT_POWER}"
    UNPROVED = (
        "its own watchdog has not stopped it within {:g} s without setpoints, as far as it reports: set the watchdog "
        "in the drive to 0.2 s. If it is, frames come late: try without gateways, or with another adapter. To "
        'do without, write watchdog = "unsafe" in the wiring of this robot (`vrg can jog`: --unsafe)'
    )
    UNPROVED_NOW = (
        "its frames or its setpoints were lost, or they come late: its own watchdog has stopped it before, and not "
        "within {:g} s now. Check the wires and the plug of this drive, and what is between"
    )


class Reason(NamedTuple):
    """What is wrong with one drive: the id of its node, the cause, and the values that its words tell."""

    node: int
    cause: Cause
    details: tuple[object, ...] = ()

    def __str__(self) -> str:
        return f"node {self.node}: {self.cause.value.format(*self.details)}"
