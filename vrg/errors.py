"""Every error that VRG raises on purpose. A message names what was expected, what was found, where, and what to do."""

from collections.abc import Sequence
from dataclasses import dataclass

Path = tuple[str | int, ...]
"""The place of a field in a file, from its top, such as `("players", 2, "role")`."""


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong with what a person has written.

    Args:
        text: what was expected and what was found.
        path: the field that it is about; empty for the whole file. The code that reads the file finds the line for it.
            The path may name a player instead of its number. Numbers count from 0, and from 1 where they are printed.
        file, line: the place of the field in the file, if that is known already. `line` counts from 1.
    """

    text: str
    path: Path = ()
    file: str | None = None
    line: int | None = None

    def __str__(self) -> str:
        where = ":".join(str(part) for part in (self.file, self.line) if part is not None)
        field = ".".join(str(part + 1 if isinstance(part, int) else part) for part in self.path)
        return ": ".join(part for part in (where, field, self.text) if part)


class VrgError(Exception):
    """The base class of all errors below. The command line prints its message and exits with status 1."""


class ConfigError(VrgError, ValueError):
    """A match file, a map or an option cannot be used.

    Args:
        problems: all problems of the input at once, or the only one. A plain string is a problem without a place.
    """

    def __init__(self, problems: str | Sequence[Problem | str]) -> None:
        found = [problems] if isinstance(problems, str) else problems
        self.problems = [Problem(problem) if isinstance(problem, str) else problem for problem in found]
        super().__init__("\n".join(map(str, self.problems)))

    def __reduce__(self) -> tuple[type["ConfigError"], tuple[list[Problem]]]:
        return type(self), (self.problems,)


class MessageError(VrgError, ValueError):
    """Bytes on the bus are not the message that belongs to their key. The message names the key and the field."""


class MisroutedError(MessageError):
    """A message came under another key than the one it was published on, or from a sender that may not publish there.

    Attributes:
        key: the key that it came on. meant: the key that it was published on. sender: the node that published it.
    """

    def __init__(self, key: str, meant: str, sender: str) -> None:
        self.key, self.meant, self.sender = key, meant, sender
        who = sender or "an unknown sender"
        wrong = f"one of {who} for {meant}" if meant != key else f"one of {who}, which may not publish on it"
        super().__init__(f"{key}: expected a message for this key, got {wrong}")

    def __reduce__(self) -> tuple[type["MisroutedError"], tuple[str, str, str]]:
        return type(self), (self.key, self.meant, self.sender)


class BusError(VrgError, ConnectionError):
    """The router cannot be reached or cannot serve, or a process that is asked does not answer."""


class CredentialsError(BusError):
    """A process has no keys for its seat, or they are refused. To try again is of no use."""


class DuplicateNodeError(BusError):
    """A node of this kind and name is already alive in the match."""


class _NamedError(VrgError, RuntimeError):
    """Something is wrong with one of several, whose name a person reads before the words.

    Args:
        text: what is wrong. name: of the robot, player or process; empty where that is said already.
    """

    def __init__(self, text: str, name: str = "") -> None:
        super().__init__(text, name)
        self.text, self.name = text, name

    def __str__(self) -> str:
        return f"{self.name}: {self.text}" if self.name else self.text


class RobotError(_NamedError):
    """A robot was used in a state that does not allow it, such as driven before it was armed, or it has failed."""


class StaleDataError(RobotError):
    """A reading was asked for that has never come or is too old to act on."""


class WorldError(VrgError, ValueError):
    """The world refuses a request, for example because of an unknown robot or a place inside a wall."""


class StrategyError(VrgError, RuntimeError):
    """A strategy, which is a student's own code, has failed. The message names the file and the line.

    Args:
        text: what has happened, and where.
        final: True if there is no use in trying it again, as it has used up its memory or flooded its output.
    """

    def __init__(self, text: str, *, final: bool = False) -> None:
        super().__init__(text)
        self.final = final


class HangError(StrategyError):
    """A strategy does not come to a decision."""


class FileError(VrgError, ValueError):
    """A file is damaged, of another kind, or no text. The message says what was expected and found, but not where."""


class JournalError(VrgError):
    """The journal or the evidence cannot be written or read."""


class LaunchError(_NamedError):
    """A process of the match did not start, or died more often than it may."""


class GivenUpError(LaunchError):
    """A player has failed too often, and its match wants no disqualification."""


class SandboxError(LaunchError):
    """A player's process cannot be sealed, as its match wants it. The message names what is missing and what to do."""
