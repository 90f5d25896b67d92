"""A backend's own table in a match file, `[backends.<name>]`, and what such a table tells the rest of VRG."""

from collections.abc import Sequence
from pathlib import Path

from vrg.hal.companions import Companion
from vrg.tables import Table


class BackendSettings(Table):
    """The base class of the tables of all backends. The subclass of a backend adds the fields."""

    def problems(self, robots: Sequence[str], base: Path) -> list[str]:
        """The reasons, in words, why these robots cannot be used. Relative paths in the table start from `base`."""
        return []

    def unproved(self, robots: Sequence[str]) -> list[str]:
        """What a match file alone cannot prove of these robots, in words, for `vrg check`."""
        return []

    def missing_here(self, robots: Sequence[str]) -> list[str]:
        """What these robots need and this machine lacks, in words, each with what to do."""
        return []

    def files(self, robots: Sequence[str]) -> list[str]:
        """The files that this table names for these robots, as it names them; they are kept with a run."""
        return []

    def companions(self, robots: Sequence[str]) -> list[Companion]:
        """The processes that these robots need besides those of their players."""
        return []
