"""A backend's own table in a match file, `[backends.<name>]`: what each kind of it can tell the rest of VRG."""

from collections.abc import Sequence
from pathlib import Path

from vrg.hal.companions import Companion
from vrg.tables import Table


class BackendSettings(Table):
    """The table. A subclass has the fields."""

    def problems(self, robots: Sequence[str], base: Path) -> list[str]:
        """What keeps these robots from being used, in words; relative paths start from `base`."""
        return []

    def companions(self, robots: Sequence[str]) -> list[Companion]:
        """The processes that these robots need besides their players'."""
        return []
