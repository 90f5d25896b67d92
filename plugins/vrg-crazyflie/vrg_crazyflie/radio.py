"""The thin shell around cflib: it connects, sends commands and hands over reports."""

import logging
import math
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Final

from platformdirs import user_cache_path

from vrg.errors import RobotError
from vrg.hal.clock import MonotonicClock
from vrg.types import Twist
from vrg_crazyflie.flight import Arming, Command, Hover, Land, Order
from vrg_crazyflie.report import MOTION, MOTION_PERIOD, STATUS, STATUS_PERIOD

if TYPE_CHECKING:
    from cflib.crazyflie import Crazyflie

CONNECTING: Final = 30.0
"""The real time in s within which a Crazyflie must tell what it is."""
OLDEST: Final = 12
"""The oldest version of Bitcraze's protocol that has a port of the supervisor: that of the firmware 2026.04."""
OFF_TIME: Final = 0.5
"""The time in s for which a restart switches the processor off that flies."""
BOOTING: Final = 10.0
"""The time in s that it may then take until it answers."""


class Radio:
    """The connection to one Crazyflie.

    Args:
        name: of the robot, for messages. uri: its address. heard: called with the values of each log block, on
            cflib's thread. lost: called with the reason when the link is lost, on a thread of cflib's.
    """

    def __init__(
        self, name: str, uri: str, heard: Callable[[Mapping[str, float]], None], lost: Callable[[str], None]
    ) -> None:
        self._name, self.uri = name, uri
        self._heard, self._lost = heard, lost
        self._craft: Crazyflie | None = None

    def open(self) -> None:
        """Connect, and start the reports. Nothing may be connected yet.

        Raises:
            RobotError: it does not answer, or its firmware is too old.
        """
        from cflib.crazyflie import Crazyflie  # noqa: PLC0415 - match files are checked without it

        from vrg_crazyflie.emulated.link import SCHEME, register  # noqa: PLC0415

        logging.getLogger("cflib").setLevel(logging.CRITICAL)  # errors, which it logs with tracebacks, are raised here
        register()
        cache = None if self.uri.startswith(SCHEME) else user_cache_path("vrg") / "crazyflie"
        try:
            craft = Crazyflie(rw_cache=None if cache is None else str(cache))
        except OSError:  # a sealed player may write nothing: it asks for the tables of contents again
            craft = Crazyflie()
        ready, why = threading.Event(), [""]

        def failed(_: str, reason: str) -> None:
            why[0] = (reason.strip() or "the link failed").splitlines()[0]  # it may have a traceback below
            ready.set()

        craft.fully_connected.add_callback(lambda _: ready.set())
        craft.connection_failed.add_callback(failed)
        craft.connection_lost.add_callback(failed)
        craft.open_link(self.uri)
        if not ready.wait(CONNECTING):
            why[0] = f"it did not tell what it is within {CONNECTING:g} s"
        if why[0]:
            craft.close_link()
            ask = "is it switched on, is its address right, and is the Crazyradio plugged in?"
            raise RobotError(f"cannot connect to {self.uri}: {why[0]}: {ask}", self._name)
        # If the link fails while a packet is sent, cflib waits for its thread of pings, and that for the packet.
        craft.link_statistics.stop()
        try:
            self._start(craft)
        except RobotError:
            craft.close_link()
            raise
        craft.connection_lost.add_callback(lambda _, reason: self._lost(str(reason)))
        self._craft = craft

    def send(self, command: Command) -> None:
        """Send a command; without a connection nothing is sent."""
        craft = self._craft
        if craft is None:
            return
        match command:
            case Hover(Twist(v=v, w=w, side=side), height):
                # cflib's turn rates are in degrees/s; they are counter-clockwise, as VRG's.
                craft.commander.send_hover_setpoint(v, side, math.degrees(w), height)
            case Land(duration, height):
                craft.high_level_commander.land(height, duration, yaw=None)  # without None, it would turn to 0
            case Arming(wanted):
                craft.supervisor.send_arming_request(wanted)
            case Order.YIELD:
                craft.commander.send_notify_setpoint_stop()
            case Order.OFF:
                craft.commander.send_stop_setpoint()
            case Order.CUT:
                craft.supervisor.send_emergency_stop()
            case Order.RECOVER:
                craft.supervisor.send_crash_recovery_request()

    def restart(self, clock: MonotonicClock) -> None:
        """Switch the processor that flies off and on, and connect again. Its motors stand still meanwhile.

        Raises:
            RobotError: it hangs on a cable, or does not answer.
        """
        if not self.uri.startswith(("radio://", "vrg://")):  # a cable powers it, too
            raise RobotError("it cannot be restarted by its cable: switch it off and on, then recover it", self._name)
        from cflib.utils.power_switch import PowerSwitch  # noqa: PLC0415

        try:
            switch = PowerSwitch(self.uri)
            try:
                switch.stm_power_down()
                clock.sleep(OFF_TIME)
                switch.stm_power_up()
            finally:
                switch.close()
        except Exception as error:  # cflib raises no narrower one
            raise RobotError(f"cannot restart it: {error}: switch it off and on, then recover it", self._name) from None
        deadline = clock.now() + BOOTING
        while self._craft is None:
            clock.sleep(OFF_TIME)
            with suppress(*([RobotError] if clock.now() < deadline else [])):
                self.open()

    def close(self) -> None:
        """Close the link. cflib sends a last set-point with no thrust: one that still flies falls."""
        craft, self._craft = self._craft, None
        if craft is not None:
            craft.close_link()

    def _start(self, craft: "Crazyflie") -> None:
        """Start the reports of one whose firmware has them."""
        from cflib.crazyflie.log import LogConfig  # noqa: PLC0415

        version = craft.platform.get_protocol_version()
        if version < OLDEST:
            what = f"expected protocol version {OLDEST} or later, as firmware 2026.04 has, got version {version}"
            raise RobotError(f"{what}: update it by cfclient", self._name)
        for variables, period in ((MOTION, MOTION_PERIOD), (STATUS, STATUS_PERIOD)):
            block = LogConfig(name=next(iter(variables)), period_in_ms=period)
            for variable, kind in variables.items():
                block.add_variable(variable, kind)
            block.data_received_cb.add_callback(lambda _stamp, values, _block: self._heard(values))
            try:
                craft.log.add_config(block)
            except KeyError as error:
                raise RobotError(f"its firmware cannot report {error}: update it by cfclient", self._name) from None
            block.start()
