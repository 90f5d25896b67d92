"""How a robot meets its drives: every one must say who it is, and be set up, before it may be armed."""

import math
from collections.abc import Sequence

from vrg.errors import RobotError
from vrg.hal.can.axis import Axis
from vrg.hal.can.medium import Bus
from vrg.hal.can.watch import Watch
from vrg.hal.can.workshop.survey import Survey
from vrg.hal.clock import Clock

LISTEN = 0.4
"""s for which a newcomer only listens. Who drives these drives already sends several setpoints in that time."""
HEAR_PATIENCE = 3.0
"""s in which nothing new has been heard of drives, after which one that has said nothing at all is given up."""
ANSWER_PATIENCE = 10.0
"""s in which nothing new has been heard, after which a drive that is heard but does not say who it is is given up."""
ANSWERS_SETTLE = 0.2
"""s more, for a second drive with the same id to answer too."""
_ASK_PERIOD = 0.5
"""s from one question to a drive that has not answered to the next, and the most that is waited for an answer."""
_POLL = 0.02
"""s between looks at what has been heard."""


def meet(bus: Bus, protocol: str, watch: Watch, survey: Survey, clock: Clock) -> None:
    """Open the bus, listen, meet every drive, and set it up. Energises nothing. Hold no lock that its callbacks want.

    Nothing is sent to drives that somebody else commands: to be asked and set up would disturb who does.

    Args:
        bus: what it hears reaches the axes and the survey. protocol: its name, for messages.
        watch: the robot's axes. survey: knows who else is on the bus. clock: the time of the bus.

    Raises:
        RobotError: no such interface, or a drive that does not answer, speaks another protocol or shares its id. The
            bus is then closed.
    """
    axes = list(watch.axes.values())
    try:
        bus.listen_to(None)
        bus.start()
        clock.sleep(LISTEN)
        _require_sense(axes)
        if not _answered(axes, clock):
            raise RobotError(_who_is_missing(protocol, bus, watch, survey))
        problems = [f"node {axis.node}: {axis.problem}" for axis in axes if axis.problem]
        if problems:
            raise RobotError("; ".join(problems))
        _require_sense(axes)
        for axis in axes:
            axis.prepare()
        bus.listen_to([wanted for axis in axes for wanted in axis.filters])
    except BaseException:
        bus.stop()
        raise


def _require_sense(axes: Sequence[Axis]) -> None:
    """Refuse drives that somebody else commands, or that say what makes no sense.

    Raises:
        RobotError: there is one.
    """
    odd = [f"node {axis.node}: {axis.odd}" for axis in axes if axis.odd]
    if odd:
        raise RobotError("; ".join(odd))


def _answered(axes: Sequence[Axis], clock: Clock) -> bool:
    """Wait until every drive has said who it is, for as long as there is progress; whether all have."""
    asked = -math.inf
    known, since = (0, 0), clock.now()
    while not all(axis.heard > 0 and axis.identified for axis in axes):
        now = clock.now()
        news = (sum(axis.heard > 0 for axis in axes), sum(axis.identified for axis in axes))
        if news != known:
            known, since = news, now
        left = _patience(axes) - (now - since)
        if left <= 0:
            return False
        if now - asked > _ASK_PERIOD:
            asked = now
            for axis in axes:
                if not axis.identified:
                    axis.identify(min(_ASK_PERIOD, left))
        clock.sleep(_POLL)
    clock.sleep(ANSWERS_SETTLE)
    return True


def _patience(axes: Sequence[Axis]) -> float:
    """How many s without anything new these drives are waited for."""
    return ANSWER_PATIENCE if all(axis.heard > 0 for axis in axes) else HEAR_PATIENCE


def _who_is_missing(protocol: str, bus: Bus, watch: Watch, survey: Survey) -> str:
    """Which drives have not been heard, or have not answered, and who has been heard in their place."""
    with watch.lock:
        axes, trouble, heard = list(watch.axes.values()), watch.guard.fault, str(survey)
    silent = [str(axis.node) for axis in axes if axis.heard < 0]
    mute = [str(axis.node) for axis in axes if axis.heard >= 0 and not axis.identified]
    which = f"node{'s' if len(silent or mute) > 1 else ''} {', '.join(silent or mute)}"
    what = "a heartbeat" if silent else "an answer to who they are"
    return (
        f"{f'{trouble}; ' if trouble else ''}expected {what} of {protocol} {which} on {bus.link} within "
        f"{_patience(axes):g} s, got none; heard there: {heard}. Are the ids and the protocol right?"
    )
