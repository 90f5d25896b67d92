"""A backend's own table in a match file, `[backends.<name>]`: what each kind of it can tell the rest of VRG."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from vrg.tables import Table


@dataclass(frozen=True)
class Companion:
    """A process that must run for the robots of a backend.

    Args:
        name: of the process and its log. arguments: of the `vrg` command.
        says: a word that it prints once it is ready.
    """

    name: str
    arguments: tuple[str, ...]
    says: str


class BackendSettings(Table):
    """The table. A subclass has the fields."""

    def problems(self, robots: Sequence[str], base: Path) -> list[str]:
        """What keeps these robots from being used, in words; relative paths start from `base`."""
        return []

    def companions(self, robots: Sequence[str]) -> list[Companion]:
        """The processes that these robots need besides their players'."""
        return []
