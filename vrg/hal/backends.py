"""Robot backends by name. Other packages add theirs by an entry point of the group `vrg.backends`.

The object of such an entry point is a subclass of `Driver` that is constructed from one `DriverContext`.
"""

from dataclasses import dataclass

from vrg.bus.mailbox import Mailbox
from vrg.bus.topics import Keys
from vrg.hal.driver import Driver, DriverContext
from vrg.registry import Registry, subclass_of

BACKENDS: Registry[type[Driver]] = Registry(
    "backend",
    "vrg.backends",
    {"sim": "vrg.hal.sim.driver:SimDriver", "can": "vrg.hal.can.driver:CanDriver"},
    subclass_of(Driver),
)
"""The class of every backend's driver, by the backend's name."""


@dataclass(frozen=True, kw_only=True)
class MatchContext(DriverContext):
    """The context from which a driver is constructed in a match.

    Only the driver of a virtual robot uses the fields that this class adds: it speaks to its robot over the bus.

    Args:
        keys: the keys of the match. mailbox: the mailbox of the player's node.
    """

    keys: Keys
    mailbox: Mailbox


def open_driver(backend: str, context: MatchContext) -> Driver:
    """Construct the driver of a robot. It is not connected yet.

    Raises:
        ConfigError: no backend has this name, it cannot be imported, or its settings have problems.
    """
    kind = BACKENDS.get(backend)
    # Every driver's class is constructed from the context alone, but the constructor of the base class takes a name and
    # a model, so the type checker cannot know it.
    return kind(context)  # type: ignore[arg-type, call-arg]


@dataclass(frozen=True)
class Companion:
    """A process that must run for the robots of a backend.

    Args:
        name: the name of the process and of its log file. arguments: the arguments of the `vrg` command that starts it.
        says: the text that the process prints as soon as it is ready.
    """

    name: str
    arguments: tuple[str, ...]
    says: str
