"""The backend `can`: the driver of a robot whose motors are on a CAN bus."""

import math

from vrg.bus.messages import SensorMessage
from vrg.errors import ConfigError, Problem, StaleDataError
from vrg.hal.backends import BACKENDS, MatchContext, open_driver
from vrg.hal.can.base import TURN
from vrg.hal.can.bus import RealMedium
from vrg.hal.can.calibration import load_calibration
from vrg.hal.can.link import Medium
from vrg.hal.can.settings import CanSettings
from vrg.hal.can.train import DriveTrain, TrainState
from vrg.hal.driver import Driver, DriverContext
from vrg.hal.readings import Readings
from vrg.hal.sensors.battery import Battery, BatterySpec
from vrg.hal.sensors.encoders import Encoders, EncodersSpec
from vrg.hal.sensors.odometry import Odometry, OdometrySpec
from vrg.hal.sensors.spec import Sample


class CanDriver(DriveTrain, Driver):
    """A drive train that is set up by a match file, and whose state is read as sensors; see `Driver` and `DriveTrain`.

    Ages are measured in real seconds on the bus. A match with physical robots runs at rate 1, so that they are seconds
    of match time too.

    Args:
        context: its options are those of `CanSettings`. medium: the buses; None for those of this computer.

    Raises:
        ConfigError: the settings or the calibration file have problems.
    """

    settings = CanSettings
    measures = frozenset({"odometry", "encoders", "battery"})

    def __init__(self, context: DriverContext, medium: Medium | None = None) -> None:
        name = context.name
        settings = CanSettings.read("can", context.options)
        wiring = settings.robots.get(name)
        if wiring is None:
            where = ("backends", "can", "robots")
            raise ConfigError([Problem(f"{name}: expected its wiring in [backends.can.robots.{name}]", where)])
        model, calibration = context.model, None
        if wiring.calibration:
            calibration = load_calibration(context.base / wiring.calibration, wiring.nodes)
            model = calibration.applied(model)
        Driver.__init__(self, name, model)
        self._now = context.now
        self._supply = wiring.supply
        outputs = wiring.wired_outputs(name, model.actuators)
        self.uses = frozenset(outputs)
        axes = wiring.wheel_axes(model.drivetrain.axes, calibration)
        unwatched = wiring.watchdog == "unsafe"
        link, protocol, own = settings.link(name), settings.protocol_of(name), settings.options_of(name)
        medium, supply = medium or RealMedium(), wiring.judged_supply
        DriveTrain.__init__(
            self, name, medium, link, protocol, axes, model,
            options=own, unwatched=unwatched, supply=supply, outputs=outputs,
        )  # fmt: skip

    def read(self) -> Readings:
        """The newest readings, as the drives have reported them.

        Raises:
            StaleDataError: not connected, or no encoder has spoken yet.
        """
        if not self.connected:
            raise StaleDataError("expected a connected robot to read: call connect() first", self.name)
        state = self.state()
        if state.age == math.inf:
            raise StaleDataError("expected encoder estimates, but none was received yet", self.name)
        return Readings(
            stamp=self._now() - state.age,
            age=state.age,
            armed=state.armed,
            estop=state.estop,
            fault=state.fault,
            latched=state.fault is not None,
            samples=self._samples(state),
        )

    def _samples(self, state: TrainState) -> list[Sample[SensorMessage]]:
        """A sample of each sensor that the model has and the drives have reported."""
        now, model = self._now(), self.features
        samples: list[Sample[SensorMessage]] = []
        if (odometry := model.sensor(OdometrySpec)) is not None:
            moved = Odometry(pose=state.odometry, twist=model.drivetrain.twist(state.speeds))
            samples.append(Sample(now - state.age, state.age, moved, odometry.name))
        if (encoders := model.sensor(EncodersSpec)) is not None:
            counts = Encoders(counts=tuple(round(angle / TURN * encoders.ticks) for angle in state.angles))
            samples.append(Sample(now - state.age, state.age, counts, encoders.name))
        if (battery := model.sensor(BatterySpec)) is not None and state.volts is not None:
            charge = Battery(charge=self._charge(state.volts))
            samples.append(Sample(now - state.volts_age, state.volts_age, charge, battery.name))
        return samples

    def _charge(self, volts: float) -> float:
        """The battery's charge by its voltage, 0 to 1."""
        empty, full = self._supply
        return min(1.0, max(0.0, (volts - empty) / (full - empty)))


def open_on(medium: Medium, backend: str, context: MatchContext) -> Driver:
    """Construct the driver of a robot, on these buses if it is a CAN robot; see `vrg.hal.backends.open_driver`."""
    kind = BACKENDS.get(backend)
    return kind(context, medium) if issubclass(kind, CanDriver) else open_driver(backend, context)
