"""What a protocol must be told of a robot's drives, besides their ids: the table [backends.can.robots.<name>.options].

A protocol that needs to be told something has a subclass of `ProtocolOptions`, and names it in its `Axis` class.
"""

from vrg.tables import Table


class ProtocolOptions(Table):
    """The options of a protocol that has none. Every field of a subclass has a default."""

    @property
    def missing(self) -> str | None:
        """What must be said and has not been, in words; None where nothing is missing."""
        return None
