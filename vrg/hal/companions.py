"""Processes that robots need besides those of their players, such as emulated drives."""

from dataclasses import dataclass


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
