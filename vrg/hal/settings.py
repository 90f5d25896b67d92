"""A backend's own table in a match file, `[backends.<name>]`, and its contract with the rest of VRG."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from vrg.hal.backends import Companion
from vrg.tables import Table

if TYPE_CHECKING:
    from vrg.hal.can.workshop.simulation import Simulation
    from vrg.hal.models.drivetrain import Drivetrain


class BackendSettings(Table):
    """The base class of the tables of all backends. The subclass of a backend adds the fields."""

    @property
    def emulated(self) -> bool:
        """True if the motor controllers of these robots are emulated, not real."""
        return False

    def problems(self, robots: Sequence[str], base: Path) -> list[str]:
        """The reasons, in words, why these robots cannot be used. Relative paths in the table start from `base`."""
        return []

    def unproved(self, robots: Sequence[str]) -> list[str]:
        """The properties of these robots that a match file alone cannot prove, in words, for `vrg check`."""
        return []

    def only_in_process(self, robots: Sequence[str]) -> list[str]:
        """The reasons, in words, why these robots can be driven by a match in one process alone."""
        return []

    def missing_here(self, robots: Sequence[str]) -> list[str]:
        """The things that these robots need and this machine lacks, in words, each with what to do."""
        return []

    def endpoints(self, robots: Sequence[str]) -> list[str]:
        """The endpoints that the drivers of these robots connect to, such as `tcp/127.0.0.1:7447`."""
        return []

    def files(self, robots: Sequence[str]) -> list[str]:
        """The files that this table names for these robots, as it names them; they are kept with a run."""
        return []

    def simulate(self, robots: Sequence[str], simulation: "Simulation", seed: int) -> bool:
        """Put these robots' motor controllers into a simulation; False where they are real, or there is no such way.

        Args:
            seed: of everything in them that is random.
        """
        return False

    def as_wired(self, robot: str, drivetrain: "Drivetrain", base: Path) -> "Drivetrain":
        """The drivetrain whose speeds, for what the odometry of a robot measures, are those of its axes as wired.

        It differs from the model's, `drivetrain`, where a calibration stands above the wiring.
        """
        return drivetrain

    def companions(self, robots: Sequence[str]) -> list[Companion]:
        """The processes that these robots need besides those of their players."""
        return []
