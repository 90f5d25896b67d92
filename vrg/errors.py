"""Every error that VRG raises on purpose. Each says what was expected, what came, where, and what to do."""


class VrgError(Exception):
    """Base of all errors below; the command line prints its message and exits with status 1."""


class ConfigError(VrgError, ValueError):
    """A match file, map or option that cannot be used.

    Args:
        problems: one line each, `file:line: field: what is wrong`; all problems of the input at once.
    """

    def __init__(self, problems: list[str]) -> None:
        super().__init__("\n".join(problems))
        self.problems = problems


class MessageError(VrgError, ValueError):
    """Bytes on the bus that are not the message their key promises; names the key and the field."""


class BusError(VrgError, ConnectionError):
    """The router cannot be reached, or a session was used after it closed."""


class DuplicateNodeError(BusError):
    """A node of this kind and name is already alive in the match."""


class RobotError(VrgError, RuntimeError):
    """A robot was used in a state that does not allow it (driven before it was armed, say), or it failed."""


class StaleDataError(RobotError):
    """A reading was asked for that never came or is too old to act on."""


class WorldError(VrgError, ValueError):
    """A request that the world refuses: an unknown robot, a place inside a wall."""


class JournalError(VrgError, OSError):
    """The journal cannot be written or read."""


class LaunchError(VrgError, RuntimeError):
    """A process of the match did not start, or died more often than it may."""
