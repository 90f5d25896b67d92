"""The emulated drives of the robots of a match: in a simulation, or as processes of their own."""

import random
from collections.abc import Sequence
from typing import TYPE_CHECKING

from vrg.hal.backends import Companion
from vrg.hal.can.workshop.emulated import DriveOptions
from vrg.hal.can.workshop.motor import MotorModel
from vrg.hal.can.workshop.simulation import Simulation

if TYPE_CHECKING:
    from vrg.hal.can.settings import CanSettings

EMULATING = "emulating"
"""The first word that `vrg node drives` prints once it is on the bus."""


def attach_drives(settings: "CanSettings", robots: Sequence[str], simulation: Simulation, seed: int) -> None:
    """Put emulated drives of these robots into a simulation.

    Args:
        seed: of everything in them that is random.
    """
    for name in robots:
        link, kind, own = settings.link(name), settings.protocol_of(name).drive_type, settings.options_of(name)
        drives = []
        for node in settings.robots[name].nodes:
            rng = random.Random(f"{seed} {link} {node}")
            motor = MotorModel(**settings.robots[name].motor.model_dump(exclude_none=True))
            options = DriveOptions(serial=rng.getrandbits(40), motor=motor, protocol=own)
            drives.append(kind(node, options, simulation.clock.now(), rng))
        simulation.wire(link).attach(drives)


def processes_of(settings: "CanSettings", robots: Sequence[str]) -> list[Companion]:
    """The processes of the emulated drives of these robots, one for each bus and kind of drive."""
    buses: dict[tuple[str, str], list[str]] = {}
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
