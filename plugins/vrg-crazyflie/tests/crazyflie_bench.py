"""A Crazyflie on a stand: an emulated one, real cflib, and simulated time."""

from typing import Any, Self

from vrg.hal.driver import DriverContext
from vrg.hal.models.crazyflie import CRAZYFLIE
from vrg.hal.simulated_clock import SimulatedClock
from vrg.testing.driver import DriverBench, arm
from vrg_crazyflie.driver import CrazyflieDriver
from vrg_crazyflie.emulated.link import CRAZYFLIES, Emulated
from vrg_crazyflie.emulated.vehicle import RESPONSE, Vehicle

NAME = "cf"
STEP = 0.02


class CrazyflieBench(DriverBench):
    """The driver of one emulated Crazyflie.

    Args:
        response, auto_arm: of its body. robot: its settings.
    """

    driver: CrazyflieDriver

    def __init__(self, *, response: float = RESPONSE, auto_arm: bool = True, **robot: Any) -> None:
        self.clock = SimulatedClock()
        self.body = Vehicle(response=response, auto_arm=auto_arm)
        self.craft = CRAZYFLIES[NAME] = Emulated(NAME, clock=self.clock, vehicle=self.body)
        options = {"emulate": True, "robots": {NAME: robot}}
        context = DriverContext(name=NAME, model=CRAZYFLIE, options=options, now=self.clock.now)
        self.driver = CrazyflieDriver(context, self.clock)
        self.clock.sleep(0.2)  # until its firmware is ready

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.craft.reachable, self.craft.silent = True, False
        self.driver.close()
        self.craft.close()
        self.clock.sleep(0.1)
        self.clock.close()

    def advance(self, seconds: float) -> None:
        self.clock.sleep(seconds)

    def cut(self) -> None:
        self.craft.silent = True

    @property
    def now(self) -> float:
        """Simulated time, s."""
        return self.clock.now()

    @property
    def fault(self) -> str:
        """What the driver says is wrong."""
        return self.driver.read().fault or ""

    def fly(self) -> None:
        """Connect, and take off."""
        self.driver.connect()
        self.advance(0.2)
        arm(self)

    def time_until(self, condition: Any, patience: float = 20.0) -> float:
        """The simulated time in s until something holds."""
        began = self.now
        assert self.clock.wait(condition, patience), f"it does not hold within {patience:g} s: {self.fault}"
        return self.now - began
