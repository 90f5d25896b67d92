"""Short matches of RoboFlag in one process, of which everything is remembered; and simple strategies for them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from vrg.agents.mover import Mover
from vrg.agents.strategy import Strategy, View
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Body, PlayerStatus, RefereeState, Stage
from vrg.bus.node import Node, Tick
from vrg.config.loading import load_match
from vrg.config.setup import MatchSetup
from vrg.games.roboflag import TAGGED
from vrg.hal.models import RobotModel
from vrg.launch.nodes.referee import open_journal
from vrg.playing.in_process import play
from vrg.regions import Rectangle
from vrg.runs.run_folder import RunFolder
from vrg.types import STILL, Pose, Twist, Vector

HERE = "tests.games.roboflag.playing"
FIELD = Rectangle(-5.6, -3.6, 5.6, 3.6)


class Standing(Strategy):
    """Stands where it is, whatever happens."""

    def act(self, view: View) -> Twist:
        return STILL


class Crossing(Strategy):
    """Drives to the place on the other side of the field, which is its own start with the other x, and stays there."""

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._mover, self._goal = Mover(), (0.0, 0.0)
        self._known = False

    def act(self, view: View) -> Twist:
        if not self._known:
            self._known, self._goal = True, crossed(view.pose)
        return self._mover.go(view, self._goal, FIELD)


class Intruding(Strategy):
    """Drives onto the other half, and stands there."""

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._mover = Mover()

    def act(self, view: View) -> Twist:
        return STILL if view.me.state == TAGGED else self._mover.go(view, (2.0, 1.5), FIELD)


def crossed(start: Pose) -> Vector:
    """The goal of a player that crosses its own half, which is 5 m wide: from x = -0.5 to x = -5.5 and back."""
    middle = -3.0 if start.x < 0 else 3.0
    return 2 * middle - start.x, start.y


@dataclass(frozen=True)
class Moment:
    """What was seen at one tick.

    Args:
        time: the match time, s. state: the referee's state. bodies: the robots, by name.
        modes: what each player has reported to be doing.
    """

    time: float
    state: RefereeState
    bodies: Mapping[str, Body]
    modes: Mapping[str, str]

    @property
    def playing(self) -> bool:
        """Whether play goes on."""
        return self.state.stage is Stage.PLAY_ROUND and self.state.halted is None

    def status(self, name: str) -> PlayerStatus:
        """What the referee says of a player."""
        return next(player for player in self.state.players if player.name == name)

    def place(self, name: str) -> Vector:
        """Where a robot is, m."""
        return self.bodies[name].pose.x, self.bodies[name].pose.y


class Eye(Node):
    """A node that sees everything, ten times a second."""

    kind = "watcher"

    def __init__(self, setup: MatchSetup) -> None:
        super().__init__("eye", Mailbox(), 0.1)
        self._state = self.mailbox.subscribe(setup.keys.referee_state)
        self._poses = self.mailbox.subscribe(setup.keys.poses)
        self._reports = {p.name: self.mailbox.subscribe(setup.keys.report(p.name)) for p in setup.players}
        self.seen: list[Moment] = []

    def tick(self, tick: Tick) -> None:
        """Remember what there is."""
        state, poses = self._state.latest, self._poses.latest
        if state is None or poses is None:
            return
        bodies = {body.name: body for body in poses.body.bodies}
        modes = {name: "" if (r := inlet.latest) is None else r.body.mode for name, inlet in self._reports.items()}
        self.seen.append(Moment(tick.time, state.body, bodies, modes))


Player = tuple[str, float, float, str]
"""A player: its name, which begins with that of its team, where it starts, m, and its strategy."""


def match_text(players: Sequence[Player], seed: int = 0, rules: str = "") -> str:
    """A match of virtual robots on the plane; everybody looks at the other half at the start."""
    text = f'name = "m"\ngame = "roboflag"\nmap = "open"\nengine = "planar"\nseed = {seed}\nlasers = false\n'
    text += f'[rules]\nscale = 2.0\nlineup = "place"\n{rules}\n'
    for name, x, y, strategy in players:
        team = name.rstrip("0123456789")
        text += f'[[players]]\nname = "{name}"\nrole = "{team}"\nx = {x}\ny = {y}\n'
        text += f'heading = {0 if team == "red" else 180}\nstrategy = "{strategy}"\n'
    return text


def four_each(red: str, blue: str) -> list[Player]:
    """Four against four, in two rows."""
    ys = (-2.4, -0.8, 0.8, 2.4)
    return [(f"red{i + 1}", -1.5, y, red) for i, y in enumerate(ys)] + [
        (f"blue{i + 1}", 1.5, -y, blue) for i, y in enumerate(ys)
    ]


def watched(folder: Path, players: Sequence[Player], seconds: float, seed: int = 0, rules: str = "") -> list[Moment]:
    """Play a match for some seconds of match time, and tell all that was seen."""
    file, run = folder / "match.toml", folder / "run"
    file.write_text(match_text(players, seed, rules))
    run.mkdir()
    setup, kept = load_match(file), RunFolder(run)
    eye = Eye(setup)
    with open_journal(setup, kept) as journal:
        ending = play(setup, journal, limit=seconds, watchers=[eye])
    assert not ending.failures
    return eye.seen
