"""The kinds of processes of a match: each is described here, and only here.

A package outside adds a kind by an entry point of the group `vrg.kinds`; `vrg node` then runs it:

    [project.entry-points."vrg.kinds"]
    scoreboard = "my_package.scoreboard:KIND"
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

from vrg.errors import ConfigError
from vrg.packages import Package, lacking
from vrg.plugins import Option
from vrg.registry import Registry, expected_one_of, installed_by
from vrg.seats.seat import NAMED, Seat, SeatKind


class Opening(NamedTuple):
    """The place of a process that shows a match.

    Args:
        name: of the process' job, such as the address at which it serves.
        words: makes the words that tell people where the match is shown, of the endpoint of the match's router.
    """

    name: str
    words: Callable[[str], str]


@dataclass(frozen=True, kw_only=True)
class Kind:
    """One kind of process.

    Args:
        name: of the kind. about: what a process of it does, in a few words.
        begins: the `module:function` that is called before the process has a thread, a session or keys, of the match's
            set-up, the name, the run folder and the folder of the keys; empty for none. What it returns becomes
            `NodeContext.begun`.
        node: the `module:function` that makes its node for a `vrg.launch.context.NodeContext`. Only its own process
            imports it. Empty for the router, which has no node.
        runner: the `module:function` that runs the node, with the parameters of `vrg.bus.process.run_node`.
        seats: the kinds of seats that it may take, the one that it prefers first.
        process: the name of its process; empty if the match file, or its user, names the processes.
        pulse: the kind of node as which it beats; empty for that of this name.
        named: what its name is the name of, in one word; empty if it needs none.
        command: the `module:function` of the command that runs one beside a match, where that takes more than its name.
        shown: its name in `vrg show`; empty if it is not listed there.
        opens: the `module:function` that makes the Opening of its process for `vrg play --show` and `vrg show`, of the
            match's set-up, the address that was typed or None, and `secured`: whether only seats are let in. It raises
            a ConfigError or a LaunchError for an address that cannot be used.
        replays: the `module:function` that shows a recorded match, as `vrg.commands.page.serve_replay` does.
        option: of `vrg play`, which opens it as `--show` does; of `vrg run replay`, too, if it `replays`.
        needs: the packages that it needs to show anything, by the module of each.
        drives: the name of the strategy whose players stand unless a process of this kind drives them.
        stop_order: processes of a lower number are stopped first.
        essential: the match is given up without it.
        keeps: it writes files into the run folder that it needs to go on.
        draws: it draws numbers that no player may guess.
        plays: it plays for a player, whose strategy may be anybody's.
        views: it shows the match to other programs; on the bus it has the name of its process.
    """

    name: str
    about: str
    seats: Sequence[SeatKind]
    begins: str = ""
    node: str = ""
    runner: str = "vrg.bus.process:run_node"
    process: str = ""
    pulse: str = ""
    named: str = ""
    command: str = ""
    shown: str = ""
    opens: str = ""
    replays: str = ""
    option: Option | None = None
    needs: Mapping[str, Package] = field(default_factory=dict)
    drives: str = ""
    stop_order: int = 1
    essential: bool = False
    keeps: bool = False
    draws: bool = False
    plays: bool = False
    views: bool = False

    def seats_of(self, name: str) -> list[Seat]:
        """The seats that a process of this kind and this name may take, the one that it prefers first."""
        return [Seat(kind, name) if kind in NAMED else Seat(kind) for kind in self.seats]

    def check_needs(self) -> None:
        """Check that the packages that it needs are there.

        Raises:
            ConfigError: one is not; the message says what to install.
        """
        if problems := [why for module, package in self.needs.items() if (why := lacking(module, package))]:
            raise ConfigError([f"{self.shown or self.name} cannot be shown: {why}" for why in problems])


_WINDOW = "vrg.launch.process_main:run_window"
_DECIDES = (SeatKind.OFFICIAL, SeatKind.WINDOW)

ROUTER = Kind(
    name="router", about="routes all messages of a match", seats=(SeatKind.ROUTER,), process="router", stop_order=3,
    essential=True,
)  # fmt: skip
WORLD = Kind(
    name="world", about="physics, sensors and the match clock", seats=(SeatKind.WORLD,), process="world",
    node="vrg.launch.nodes.world:world", runner="vrg.bus.process:run_world", stop_order=2, essential=True, keeps=True,
    draws=True,
)  # fmt: skip
COORDINATOR = Kind(
    name="coordinator", about="the referee", seats=(SeatKind.REFEREE,), process="referee",
    node="vrg.launch.nodes.referee:referee", essential=True, keeps=True, draws=True,
)  # fmt: skip
RECORDER = Kind(
    name="recorder", about="records a match for Foxglove", seats=(SeatKind.RECORDER,), process="recorder",
    node="vrg.launch.nodes.recorder:recorder", keeps=True,
)  # fmt: skip
TRACKER = Kind(
    name="tracker", about="locates robots: the fusion centre, or a source of fixes", seats=(SeatKind.TRACKER,),
    node="vrg.launch.nodes.tracker:tracker", named="source",
)  # fmt: skip
PLAYER = Kind(
    name="player", about="one player with its robot", seats=(SeatKind.PLAYER,),
    begins="vrg.playing.strategies:begun", node="vrg.launch.nodes.player:player", named="player", stop_order=0,
    essential=True, plays=True,
)  # fmt: skip
SPECTATOR = Kind(
    name="spectator", about="a window that shows the match; several may be open", seats=_DECIDES, process="spectator",
    node="vrg.launch.nodes.windows:spectator", runner=_WINDOW, command="vrg.commands.show:window",
    shown="window",
)  # fmt: skip
COMMANDER = Kind(
    name="commander", about="commands a team with a gamepad or the keyboard", seats=(SeatKind.COMMANDER,),
    node="vrg.launch.nodes.windows:commander", runner=_WINDOW, named="team", command="vrg.commands.show:commander",
    shown="commander",
)  # fmt: skip
WEB = Kind(
    name="web", about="the match in browsers", seats=_DECIDES, process="web", pulse="spectator",
    node="vrg.launch.nodes.web:web", command="vrg.commands.page:web", shown="web", views=True,
    replays="vrg.commands.page:serve_replay",
)  # fmt: skip
BUILT_IN: Final = (ROUTER, WORLD, COORDINATOR, RECORDER, TRACKER, PLAYER, SPECTATOR, COMMANDER, WEB)
"""The kinds that come with VRG."""


def _check(found: Any) -> str | None:
    able = isinstance(found, Kind) and (found is ROUTER or found.node or found.command)
    able = able and isinstance(found.option, Option | None)
    return None if able else "expected a Kind with a node, whose option is an Option or None"


KINDS: Final[Registry[Kind]] = Registry(
    "kind of process",
    "vrg.kinds",
    {kind.name: f"vrg.kinds:{kind.name.upper()}" for kind in BUILT_IN},
    _check,
)
"""Every kind by name."""


BY_PROCESS: Final = {kind.process: kind for kind in BUILT_IN if kind.process}
"""The kinds of VRG of which a match has one process at most, by the name of that process."""


def every_kind() -> Iterator[Kind]:
    """Every kind that can be used, those that come with VRG first; other packages are imported only for the others."""
    yield from BUILT_IN
    own, shown = {kind.name for kind in BUILT_IN}, {kind.shown for kind in BUILT_IN if kind.shown}
    for name in KINDS.names():
        kind = None if name in own else KINDS.find(name)
        # One that would take the place of another is left out.
        if kind is not None and kind.name == name and kind.process not in BY_PROCESS and kind.shown not in shown:
            shown |= {kind.shown} - {""}
            yield kind


def kind_shown(name: str, use: str) -> Kind:
    """The kind that `vrg show` lists by a name.

    Args:
        use: the field with the function that is wanted of it, `opens` or `replays`.

    Raises:
        ConfigError: there is no such kind, it has no such function, or a package that it needs is missing.
    """
    shown = {kind.shown: kind for kind in every_kind()}
    if name not in shown and (wanted := installed_by("vrg.commands", f"show.{name}")):
        raise ConfigError(f"a view of the match: got {name!r}, which {wanted}")
    able = {name: kind for name, kind in shown.items() if getattr(kind, use)}
    if name not in able:
        live = ", which shows running matches only" if name in shown and use == "replays" else ""
        raise ConfigError(f"a view of the match: {expected_one_of(sorted(able), name)}{live}")
    able[name].check_needs()
    return able[name]
