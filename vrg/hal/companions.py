"""Processes that robots need besides their players' own, such as emulated drives."""

from dataclasses import dataclass


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
