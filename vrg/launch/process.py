"""One process of a match, as its plan, its supervisor and the process itself know it."""

from pathlib import Path

import msgspec
from msgspec import Struct

from vrg.kinds import KINDS, ROUTER, Kind


class Process(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A process of a match. As JSON it is the argument with which it is started; see `vrg.launch.process_main.main`.

    Args:
        name: of the process and of its log.
        kind: the name of one of `vrg.kinds`; empty for a companion of robots, which has no part in the bus.
        node: the name of its player, source, team or window, or the address where it serves.
        machine: the machine on which it runs, as the match file names it.
        router: the endpoint of the router that it uses, or is. upstream: that of the router that a further one is
            linked to.
        run: the run folder; empty if it is not known, and nothing is kept.
        keys: the folder of the keys of the match's seats; None in a match without them.
        strategy: of a player, in place of the one in the match file.
        pulse: the key of its pulse, whose first message tells that it is ready; empty if it is no node of the match.
        says: the text that a process without a pulse prints when it is ready; empty for the router.
        command: the arguments of the `vrg` command that a companion is.
        physical: True if it is one of a physical robot. waits: True if companions must be ready before it is started.
        trusted: True gives it all environment variables, False those that strangers may know.
    """

    name: str
    kind: str = ""
    node: str = ""
    machine: str = ""
    router: str = ""
    upstream: str | None = None
    run: str = ""
    keys: str | None = None
    strategy: str = ""
    pulse: str = ""
    says: str = ""
    command: tuple[str, ...] = ()
    physical: bool = False
    waits: bool = False
    trusted: bool = True

    @property
    def of(self) -> Kind | None:
        """Its kind; None for a companion."""
        return KINDS.get(self.kind) if self.kind else None

    @property
    def is_router(self) -> bool:
        """True if this is a router. It has no pulse, because it runs before there is a bus."""
        return self.kind == ROUTER.name

    @property
    def node_id(self) -> str:
        """The kind and the name of its node, such as `player/ann`; empty if it is no node of the match."""
        return "/".join(self.pulse.split("/")[-2:])

    @property
    def plays(self) -> bool:
        """True if it is a player's process, which may be disqualified."""
        return self.of is not None and self.of.plays

    @property
    def essential(self) -> bool:
        """True if there is no match without it."""
        return self.of is None or self.of.essential

    @property
    def stop_order(self) -> int:
        """Processes of a lower number are stopped before those of a higher number; companions outlive players."""
        return 2 if self.of is None else self.of.stop_order

    @property
    def group(self) -> int:
        """Processes of a lower group must be ready before those of a higher group are started."""
        return 0 if self.is_router else 2 if self.waits else 1

    @property
    def title(self) -> str:
        """Its title in a list of processes."""
        return f"vrg {self.kind}{f' {self.node}' if self.node else ''} in {Path(self.run).name}"

    @property
    def arguments(self) -> tuple[str, ...]:
        """The arguments of its program."""
        return self.command or (msgspec.json.encode(self).decode(),)


def by_hand(kind: Kind, name: str, router: str, *, run: Path | None, keys: Path | None) -> Process:
    """A process that a person runs beside a match.

    Args:
        name: of its node, or the address where it serves. router, run, keys: see `Process`.
    """
    return Process(
        name=kind.process or name,
        kind=kind.name,
        node=name,
        router=router,
        run="" if run is None else str(run),
        keys=None if keys is None else str(keys),
    )


def process_of(arguments: str) -> Process:
    """The process that was started with this argument."""
    return msgspec.json.decode(arguments, type=Process)
