"""The contract of the sources of fixes, and their registry.

A source is a process of the match: `[localisation.NAME]` in the match file names its kind and its settings. Other
packages add a kind by an entry point of the group `vrg.localisation`.
"""

import logging
from abc import abstractmethod
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, ClassVar

from msgspec import Struct

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Fix, Fixes
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys
from vrg.hal.models import RobotModel
from vrg.hal.models.drivetrain import Drivetrain
from vrg.hal.sim.config import BodySetup
from vrg.registry import Registry, subclass_of
from vrg.tables import Table
from vrg.types import Pose

log = logging.getLogger(__name__)

TRACKER = "tracker"
"""The kind of nodes that locate robots; in a match with seats they have the tracker's."""


class SourceContext(Struct, frozen=True, kw_only=True):
    """The things that a source is made from in a match.

    Args:
        name: of the source. settings: its table, of its own class.
        robots: the models of the robots that it is to see, by name. starts: their poses when the match begins.
        things: the set-ups of the passive bodies that it is to see, by name.
        emulated: of those of them that are physical robots with emulated drives, the drivetrain whose speeds, for what
            the odometry measures, are those of the axes as wired; see `Emulation.as_wired` of
            vrg.hal.can.workshop.emulation.
        seed: of all that is random in it. base: the folder that its relative paths start from.
    """

    name: str
    settings: Table
    robots: Mapping[str, RobotModel]
    starts: Mapping[str, Pose]
    emulated: Mapping[str, Drivetrain] = {}
    things: Mapping[str, BodySetup] = {}
    seed: int
    base: Path


class Source(Node):
    """The node of a source of fixes.

    Args:
        context: what it is made from. mailbox: its mailbox. keys: the keys of the match. period: between two ticks, s.

    Attributes:
        settings: the class of its table in a match file.
        sees_physical: True if it can see physical robots whose drives are real.
    """

    kind = TRACKER
    settings: ClassVar[type[Table]]
    sees_physical: ClassVar[bool] = True

    def __init__(self, context: SourceContext, mailbox: Mailbox, keys: Keys, period: float = 0.02) -> None:
        super().__init__(context.name, mailbox, period)
        self._topic = keys.fixes(self.name)

    @classmethod
    def problems(cls, settings: Table, base: Path) -> list[str]:
        """The reasons, in words, why these settings cannot be used. Relative paths in them start from `base`."""
        return []

    @classmethod
    def missing_here(cls, settings: Table, base: Path) -> list[str]:
        """The things that this source needs and this machine lacks, in words, each with what to do."""
        return []

    @classmethod
    def files(cls, settings: Table) -> list[str]:
        """The files that these settings name, as they name them; they are kept with a run."""
        return []

    def tick(self, tick: Tick) -> None:
        """Publish what has been seen since the last tick."""
        for stamp, fixes in self.seen(tick) if tick.live else ():
            self.mailbox.publish(self._topic, Fixes(fixes=fixes), stamp=stamp)

    @abstractmethod
    def seen(self, tick: Tick) -> Iterable[tuple[float, tuple[Fix, ...]]]:
        """The match times of what has been captured, s, and the robots and things that were seen then."""


SOURCES: Registry[type[Source]] = Registry(
    "source of fixes",
    "vrg.localisation",
    {"sim": "vrg.localisation.sim:SimSource"},
    subclass_of(Source),
)
"""The class of every kind of source, by its name."""


def read_source(table: Mapping[str, Any]) -> tuple[type[Source], Table]:
    """The class of a source and its settings, of a table `[localisation.NAME]`.

    Raises:
        ConfigError: there is no such kind of source. ValidationError: its settings are wrong.
    """
    kind = SOURCES.get(table.get("source", ""))
    return kind, kind.settings.model_validate({key: value for key, value in table.items() if key != "source"})
