"""The emulated drives of the robots of a match: in a simulation, or as processes of their own."""

import random
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from vrg.hal.backends import Companion
from vrg.hal.can.calibration import load_calibration
from vrg.hal.can.workshop.emulated import DriveOptions
from vrg.hal.can.workshop.motor import MotorModel
from vrg.hal.can.workshop.simulation import Simulation
from vrg.hal.models.drivetrain import Drivetrain
from vrg.portable.scalars import total

if TYPE_CHECKING:
    from vrg.hal.can.settings import CanSettings

EMULATING = "emulating"
"""The first word that `vrg node drives` prints once it is on the bus."""


class Emulation:
    """The emulated drives of the robots of a match. Each method is for some robots, by name, which have a wiring.

    Args:
        settings: the table of the match file.
    """

    def __init__(self, settings: "CanSettings") -> None:
        self._settings = settings

    def attach(self, robots: Sequence[str], simulation: Simulation, seed: int) -> None:
        """Put the drives into a simulation.

        Args:
            seed: of everything in them that is random.
        """
        settings = self._settings
        for name in robots:
            link, kind, own = settings.link(name), settings.protocol_of(name).drive_type, settings.options_of(name)
            drives = []
            for node in settings.robots[name].nodes:
                rng = random.Random(f"{seed} {link} {node}")
                motor = MotorModel(**settings.robots[name].motor.model_dump(exclude_none=True))
                options = DriveOptions(serial=rng.getrandbits(40), motor=motor, protocol=own)
                drives.append(kind(node, options, simulation.clock.now(), rng))
            simulation.wire(link).attach(drives)

    def companions(self, robots: Sequence[str]) -> list[Companion]:
        """The processes of the drives, one for each bus and kind of drive."""
        settings, buses = self._settings, dict[tuple[str, str], list[str]]()
        for name in robots:
            # Drives with different options are processes of their own.
            own = settings.robots[name]
            buses.setdefault((str(settings.link(name)), f"{own.options} {own.motor}"), []).append(name)
        companions = []
        for number, members in enumerate(buses.values(), 1):
            link, first = settings.link(members[0]), settings.robots[members[0]]
            ids = [node for name in members for node in settings.robots[name].nodes]
            arguments = ["node", "drives", *link.arguments, "--protocol", settings.protocol_name(members[0])]
            arguments += [f"--option={name}={value}" for name, value in first.options.items()]
            motor = first.motor.model_dump(exclude_none=True)
            arguments += [f"--{name.replace('_', '-')}={value}" for name, value in motor.items()]
            # They are the same drives when their process is started again.
            arguments += ["--serial", str(random.Random(f"{link} {ids}").getrandbits(40))]
            for node in ids:
                arguments += ["--id", str(node)]
            companions.append(Companion("drives" if number == 1 else f"drives-{number}", tuple(arguments), EMULATING))
        return companions

    def only_in_process(self, robots: Sequence[str]) -> list[str]:
        """The reasons, in words, why these robots can be driven by a match in one process alone."""
        return self._settings.within_process(robots)

    def as_wired(self, robot: str, drivetrain: Drivetrain, base: Path) -> Drivetrain:
        """The drivetrain whose speeds, for what the odometry of a robot measures, are those of its axes as wired.

        It differs from the model's, `drivetrain`, where a calibration stands above the wiring.
        """
        wiring = self._settings.robots[robot]
        if not wiring.calibration or "ratio" not in wiring.model_fields_set:
            return drivetrain  # of wheels whose ratio is not in the file nothing but the calibration is known
        found = load_calibration(base / wiring.calibration, wiring.nodes)
        axes = wiring.wheel_axes(drivetrain.axes, found)
        ratios = [
            [
                axis.ratio * axis.direction * (-1 if axis.node in wiring.reversed else 1)
                for axis in axes
                if axis.axis == number
            ]
            for number in range(len(drivetrain.axes))
        ]
        rates = zip(drivetrain.with_track(found.track).rates, ratios, strict=True)
        return replace(
            drivetrain,
            rates=tuple(
                (ahead * scale, turn * scale, side * scale)
                for (ahead, turn, side), own in rates
                for scale in [total(own) / len(own) / wiring.ratio]
            ),
        )
