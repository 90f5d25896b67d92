"""A backend's own table in a match file, `[backends.<name>]`, and its contract with the rest of VRG."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from pydantic import ValidationError

from vrg.errors import ConfigError
from vrg.hal.models import RobotModel
from vrg.tables import Table, problems_in

if TYPE_CHECKING:
    from vrg.hal.can.workshop.emulation import Emulation


class BackendSettings(Table):
    """The base class of the tables of all backends. The subclass of a backend adds the fields."""

    @classmethod
    def read(cls, backend: str, table: Mapping[str, Any]) -> Self:
        """The settings in the table of a backend of this name.

        Raises:
            ConfigError: with every problem of the table.
        """
        try:
            return cls.model_validate(dict(table))
        except ValidationError as error:
            raise ConfigError(problems_in(error, cls, ("backends", backend))) from None

    @property
    def emulation(self) -> "Emulation | None":
        """The emulated motor controllers of these robots; None if they are real."""
        return None

    def problems(self, robots: Mapping[str, RobotModel], base: Path) -> list[str]:
        """The reasons, in words, why these robots cannot be used. Relative paths in the table start from `base`."""
        return []

    def unverified(self, robots: Sequence[str]) -> list[str]:
        """The properties of these robots that a match file alone cannot prove, in words, for `vrg check`."""
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
