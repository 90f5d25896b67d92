"""The recovery of a robot from what has latched, as a person has decided."""

import logging
from collections.abc import Callable, Sequence

from vrg.errors import RobotError
from vrg.hal.can.axis import Axis
from vrg.hal.can.medium import Bus
from vrg.hal.can.watch import Watch
from vrg.hal.clock import Clock

log = logging.getLogger(__name__)


class Recovery:
    """See the module. It waits for answers of the drives, so it runs on a thread of its own, beside the robot's.

    Args:
        watch: the robot's axes. bus: the one that they are on. clock: its time.
        rebase: lets the odometry take what the encoders say next for where they were.

    Attributes:
        under_way: the robot is being recovered, and cannot be armed.
    """

    def __init__(self, watch: Watch, bus: Bus, clock: Clock, rebase: Callable[[], None]) -> None:
        self._clock = clock
        self._watch = watch
        self._bus = bus
        self._rebase = rebase
        self.under_way = False

    def run(self) -> None:
        """Open the bus anew, set the drives up, and clear their errors; the motors stay off.

        What is still wrong latches again within a second. The emergency stop stays.
        """
        watch = self._watch
        with watch.lock:
            if not watch.connected or self.under_way:
                return
            self.under_way = True
            watch.guard.disarm()
            watch.idle()
            watch.reopening = True
            axes = list(watch.axes.values())
        problem = self._open_anew(axes)
        with watch.lock:
            self.under_way = watch.reopening = False
            # What a person needs to know from now on is this, and no longer what was wrong before.
            watch.guard.begin(self._clock.now())
            if problem:
                watch.guard.latch(problem)
            elif watch.connected:
                watch.idle()
                if not watch.guard.estop:
                    watch.clear()
            watch.look()
            closed = not watch.connected
        if closed:
            # The robot was closed meanwhile, perhaps before its bus was opened anew here.
            self._bus.stop()
        elif not problem:
            log.info("%s: faults are cleared, the motors are off", watch.name)

    def _open_anew(self, axes: Sequence[Axis]) -> str | None:
        """Close and open the bus, and set the drives up; what kept that from being done, in words."""
        # Outside the lock: the receive thread, which is waited for, may want it.
        try:
            self._bus.stop()
            if trouble := self._bus.restart():
                return trouble
            with self._watch.lock:
                # A drive that was started again counts from zero: nothing it says from here on is compared with before.
                self._rebase()
            self._bus.start()
            for axis in axes:
                axis.prepare()
        except RobotError as error:
            return str(error)
        except Exception as error:
            # A recovery runs beside the player: who waits for it must see that it failed.
            log.exception("%s: it could not be recovered", self._watch.name)
            return f"it could not be recovered: {error!r}"
        return None
