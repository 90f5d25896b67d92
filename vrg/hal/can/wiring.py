"""The wiring of a robot with motors on a CAN bus, in a match file: [backends.can.robots.<name>]."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, ValidationInfo, field_validator

from vrg.errors import ConfigError, Problem
from vrg.hal.actuators import Actuator, Gripper, Kicker
from vrg.hal.can.base import WheelAxis
from vrg.hal.can.calibration import Calibration
from vrg.hal.can.judges.supply import ANY_SUPPLY
from vrg.hal.can.link import AdapterValue, known_interface
from vrg.hal.can.outputs import Output
from vrg.hal.can.protocols import PROTOCOLS
from vrg.hal.driver import COMMAND_TIMEOUT
from vrg.hal.models import RobotModel
from vrg.registry import expected_one_of
from vrg.tables import Table

InterfaceName = Annotated[str, AfterValidator(known_interface)]
ProtocolName = Annotated[str, AfterValidator(PROTOCOLS.known)]


class MotorSettings(Table):
    """The motors of emulated drives, in the words of `MotorModel`; what is missing is as usual there.

    Args:
        inertia: of rotor and load, kg m^2. friction: at the shaft, Nm. current_limit: A.
        velocity_limit: turn/s. delay: from a setpoint to when the drive acts on it, s.
        braking: the time constant of a motor that is off, s: some drives let it coast.
    """

    inertia: float | None = Field(None, gt=0)
    braking: float | None = Field(None, gt=0, le=60)
    friction: float | None = Field(None, ge=0)
    current_limit: float | None = Field(None, gt=0)
    velocity_limit: float | None = Field(None, gt=0)
    delay: float | None = Field(None, ge=0, le=0.5)


class OutputWiring(Table):
    """An actuator at a digital output of a drive: [backends.can.robots.<name>.outputs].

    Args:
        drive: the node id. bit: the number of the output, as its protocol counts them.
        pulse: for how long a kick switches it on, s. Only a kicker has one: others are on as long as they are used.
    """

    drive: int
    bit: int = Field(ge=0, le=31)
    pulse: float | None = Field(None, gt=0, le=1)


class RobotWiring(Table):
    """One robot: [backends.can.robots.<name>].

    Args:
        left, right: node ids of the motors on each side, one or two.
        axes: of a robot whose drivetrain has other axes than `left` and `right`: the node ids of each, by its name.
        ratio: turns of a motor for one turn of its wheel. reversed: node ids of the motors whose positive speed drives
            back. A calibration file stands above both.
        calibration: file written by `vrg can calibrate`, relative to the match file.
        watchdog: `proved` lets each drive's own watchdog stop its motor once, at zero speed, before the robot is armed
            for the first time; `unsafe` drives a robot whose drives have none. If this computer fails, nothing stops
            such a robot.
        supply: the voltage of an empty and of a full battery, V.
        interface, channel, bitrate, adapter, protocol: for a robot on a bus of its own, in place of those of
            [backends.can].
        options: the protocol's options of the drives; see `Axis.options_type` of the protocol.
        outputs: the actuators of the robot at digital outputs of its drives, by their names.
        motor: what emulated drives and their load are like, where that is not as usual; real drives are as they are.
    """

    left: list[int] = Field(default_factory=list, max_length=2)
    right: list[int] = Field(default_factory=list, max_length=2)
    axes: dict[str, list[int]] = Field(default_factory=dict, validate_default=True)
    ratio: float = Field(1.0, gt=0, le=10_000)
    reversed: list[int] = Field(default_factory=list)
    calibration: str | None = None
    watchdog: Literal["proved", "unsafe"] = "proved"
    supply: tuple[float, float] = (20.0, 25.2)
    interface: InterfaceName | None = None
    channel: str | None = None
    bitrate: int | None = Field(None, ge=10_000, le=1_000_000)
    adapter: dict[str, AdapterValue] | None = None
    protocol: ProtocolName | None = None
    options: dict[str, Any] = Field(default_factory=dict)
    outputs: dict[str, OutputWiring] = Field(default_factory=dict)
    motor: MotorSettings = Field(default_factory=lambda: MotorSettings.model_validate({}))

    # One validator for each field, so that all mistakes are found at once; what is wrong itself is not in `info.data`.
    @field_validator("axes")
    @classmethod
    def _wired(cls, axes: dict[str, list[int]], info: ValidationInfo) -> dict[str, list[int]]:
        if not {"left", "right"} <= info.data.keys():
            return axes
        left, right = info.data["left"], info.data["right"]
        if axes and (left or right):
            raise ValueError("expected either `left` and `right` or `axes`, got both")
        if len(left) != len(right):
            raise ValueError(f"expected as many motors left as right, got {len(left)} and {len(right)}")
        if empty := [name for name, nodes in (axes or {"left": left}).items() if not nodes]:
            raise ValueError(f"expected a motor for each axis, got none for {', '.join(empty)}")
        nodes = [*left, *right, *(node for own in axes.values() for node in own)]
        if len(set(nodes)) != len(nodes):
            raise ValueError(f"expected an id of its own for every motor, got {nodes}")
        return axes

    @field_validator("reversed")
    @classmethod
    def _reversed(cls, value: list[int], info: ValidationInfo) -> list[int]:
        if {"left", "right", "axes"} <= info.data.keys():
            wired = [info.data["left"], info.data["right"], *info.data["axes"].values()]
            nodes = [node for own in wired for node in own]
            if strangers := set(value) - set(nodes):
                raise ValueError(f"expected ids of {nodes}, got {sorted(strangers)}")
        return value

    @field_validator("supply")
    @classmethod
    def _supply(cls, value: tuple[float, float]) -> tuple[float, float]:
        if not value[0] < value[1]:
            raise ValueError(f"expected the voltage of an empty and of a full battery, got {value}")
        return value

    @property
    def judged_supply(self) -> tuple[float, float]:
        """The voltage of an empty and of a full battery, V; any if they are not given."""
        return self.supply if "supply" in self.model_fields_set else ANY_SUPPLY

    @property
    def nodes(self) -> list[int]:
        """The node ids of all motors."""
        return [node for nodes in self._by_axis.values() for node in nodes]

    @property
    def _by_axis(self) -> dict[str, list[int]]:
        return self.axes or {"left": self.left, "right": self.right}

    def wheel_axes(self, names: Sequence[str], calibration: Calibration | None) -> list[WheelAxis]:
        """The assignment of motors to the axes of a drivetrain, by the calibration if there is one.

        Args:
            names: those of the axes.

        Raises:
            ConfigError: the wiring has other axes.
        """
        if sorted(self._by_axis) != sorted(names):
            wired = ", ".join(self._by_axis)
            raise ConfigError(
                f"expected the motors of the axes {', '.join(names)} of this model, got {wired}: write "
                f"`axes = {{ {', '.join(f'{name} = [...]' for name in names)} }}` into the wiring of this robot"
            )
        axes = []
        for name, nodes in self._by_axis.items():
            for node in nodes:
                axis = WheelAxis(node, names.index(name), -1 if node in self.reversed else 1, self.ratio)
                if calibration is not None:
                    own = calibration.axes[node]
                    axis = replace(axis, direction=own.direction, ratio=own.ratio, serial=own.serial)
                axes.append(axis)
        return axes

    def misfits(self, robot: str, model: RobotModel) -> list[str]:
        """The reasons, in words, why a robot of a model cannot be wired so."""
        found = []
        for fit in (
            lambda: self.wheel_axes(model.drivetrain.axes, None),
            lambda: self.wired_outputs(robot, model.actuators),
        ):
            try:
                fit()
            except ConfigError as error:
                found += [problem.text for problem in error.problems]
        return found

    def wired_outputs(self, robot: str, actuators: Sequence[Actuator]) -> dict[str, Output]:
        """The outputs that actuators of a robot are wired to, by their names.

        Raises:
            ConfigError: the robot has no such actuator, or a kicker has no pulse, or something else has one.
        """
        known, found, problems = {actuator.name: actuator for actuator in actuators}, {}, []
        for name, wired in self.outputs.items():
            actuator, pulse = known.get(name), wired.pulse
            if actuator is None:
                has_none = f"the model of {robot} has no actuators, so that nothing can be wired to an output"
                problems.append(f"{name}: {expected_one_of(list(known), name) if known else has_none}")
            elif isinstance(actuator, Kicker) != (pulse is not None):
                wanted = (
                    "a `pulse` in s, for which a kick is on" if pulse is None else "no `pulse`: only a kicker has one"
                )
                problems.append(f"{name}: expected {wanted}")
            elif isinstance(actuator, Kicker) and pulse is not None:
                found[name] = Output(wired.drive, wired.bit, pulse, max(pulse, actuator.pause))
            else:
                # A dribbler turns as long as it is commanded again and again, as a motor does.
                lasts = math.inf if isinstance(actuator, Gripper) else COMMAND_TIMEOUT
                found[name] = Output(wired.drive, wired.bit, lasts)
        if problems:
            where = ("backends", "can", "robots", robot, "outputs")
            raise ConfigError([Problem(text, where) for text in problems])
        return found
