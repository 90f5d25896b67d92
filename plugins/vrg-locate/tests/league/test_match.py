"""A whole match in one process whose real ball an emulated SSL-Vision sees."""

from pathlib import Path

import pytest

from league.league import vision_packet
from vrg.agents import Strategy, Twist, View
from vrg.bus.messages import LOST, FieldObject
from vrg.coordinator.journal import NoJournal
from vrg.errors import ConfigError
from vrg.hal.models import robot_model
from vrg.launch.nodes.player import player_node
from vrg.playing.in_process import Assembly, assemble
from vrg.seats.seat import Seat, SeatKind
from vrg.testing import matches
from vrg.testing.sources import FakeFeed
from vrg.types import STILL
from vrg_locate.ssl import source as module
from vrg_locate.ssl.network import Packet
from vrg_locate.ssl.packets import Seen, SeenBall
from vrg_locate.ssl.source import SslSource

TEXT = """
name = "real-ball"
game = "practice"
map = "open"
engine = "planar"
lasers = false
[rules]
x = [-8.0, 8.0]
y = [-8.0, 8.0]
[localisation.vision]
source = "ssl"
ball = "ball"
[[players]]
name = "ann"
role = "player"
x = -5.0
y = -5.0
[[bodies]]
name = "ball"
kind = "ball"
x = 0.0
y = 0.0
radius = 0.1
localisation = "fusion"
"""
BEGAN = 1000.0
"""When the match began, by the clock of the source, s."""
LATE = 0.05
"""The time from a picture to its packet, s."""
RATE = 50
"""Pictures in a second."""


class Watcher(Strategy):
    """Stands, and remembers which things it is shown, with the match times, s."""

    def __init__(self, name: str) -> None:
        super().__init__(name, robot_model("P2AT"))
        self.seen: list[tuple[float, FieldObject]] = []

    def act(self, view: View) -> Twist:
        if view.things:
            self.seen.append((view.time, view.things[0]))
        return STILL


class Vision:
    """Sees a ball that rolls from (-1, 0) along x at 1 m/s, is hidden from 2 s to 3 s, and then lies at (2, 1)."""

    def __init__(self, made: Assembly) -> None:
        (self._source,) = (node for node in made.trackers if isinstance(node, SslSource))
        self._source._monotonic = lambda: BEGAN + made.executor.time
        self._stream = self._source._stream
        self._made = made

    def show(self) -> None:
        """Send the packet of the picture that was taken a moment ago."""
        now = self._made.executor.time
        taken = now - LATE
        spare = SeenBall(4.0, 4.0, 0.9)
        ball = SeenBall(taken - 1.0, 0.0, 0.8) if taken < 2.0 else SeenBall(2.0, 1.0, 0.99)
        balls = (ball, spare) if not 2.0 <= taken < 3.0 else (spare,) if taken < 2.3 else ()
        data = vision_packet(Seen(taken, now, [], balls=balls))
        self._stream.shown.append(Packet(BEGAN + now, "10.0.0.1:5000", data))


def test_players_see_a_real_ball_and_that_it_is_lost(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "PacketStream", FakeFeed)
    setup = matches.written(tmp_path, TEXT)
    assert (setup.rate, setup.trackers) == (1.0, ["vision", "fusion"])
    assert Seat(SeatKind.TRACKER) in setup.roster.seats
    watcher = Watcher("ann")
    made = assemble(setup, NoJournal(), lambda name: player_node(setup, name, make=lambda: watcher), strict=True)
    vision = Vision(made)
    while made.executor.time < 4.0:
        vision.show()
        made.executor.step()
    made.executor.stop()

    assert watcher.seen[0][1].lost, "no picture has come yet"
    rolling = [(time, ball) for time, ball in watcher.seen if 0.6 < time < 2.0]
    assert len(rolling) > 10
    for time, ball in rolling:
        assert not ball.lost
        # The referee looks at the world each 0.1 s, and the player at what the referee has said.
        assert (ball.x, ball.y) == pytest.approx((time - 1.0, 0.0), abs=0.13)
        assert (ball.vx, ball.vy) == pytest.approx((1.0, 0.0), abs=0.05)
    hidden = [(time, ball) for time, ball in watcher.seen if 2.0 + LOST + 0.15 < time < 3.0]
    assert hidden
    assert all(ball.lost and ball.vx == 0.0 and 0.9 < ball.x < 1.3 for _, ball in hidden)
    assert not any(ball.lost for time, ball in watcher.seen if 0.5 < time < 2.0 + LOST - 0.05)
    found = [ball for time, ball in watcher.seen if time > 3.5]
    assert all((ball.lost, ball.vx) == (False, 0.0) for ball in found)
    assert (found[-1].x, found[-1].y) == pytest.approx((2.0, 1.0), abs=1e-3)


def test_a_match_without_real_robots_and_things_needs_no_source(tmp_path: Path) -> None:
    setup = matches.written(tmp_path, TEXT, virtual=True)
    assert (setup.trackers, setup.tracked) == ([], {})
    with pytest.raises(ConfigError, match="ball: expected a source that sees real things"):
        matches.written(tmp_path, TEXT.replace('"ssl"\nball = "ball"', '"sim"'))
