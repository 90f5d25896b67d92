"""The referee drives robots by a lease, and is killed or frozen while it does."""

import signal
from pathlib import Path

import pytest

from tests.system.conftest import FAULTS
from vrg.bus.messages import OfficialAction, PlayerStatus
from vrg.hal.permission import REFEREE_TIMEOUT
from vrg.testing.processes.match import LiveMatch
from vrg.testing.processes.observer import Observer

LED = ("red1", "red2", "red3", "red4")
BRAKING = 1.2
"""The match time in s in which every robot stands after its lease has expired: ticks of the world, and its brakes."""
STILL = """
from vrg.agents import STILL, Strategy


class Still(Strategy):
    def act(self, view):
        return STILL
"""


def lease_match() -> str:
    """A match of RoboFlag on so large a field that home is a minute away; nobody moves by itself."""
    head = """
name = "leases"
game = "roboflag"
map = "open"
engine = "planar"
lasers = false

[rules]
scale = 8.0

[teams.red]
strategy = "still.py:Still"

[teams.blue]
strategy = "still.py:Still"
"""
    places = {name: ("red", -2.0, 14.0 - 2.0 * number) for number, name in enumerate(LED)}
    for name, (role, x, y) in (places | {"blue1": ("blue", 20.0, 12.0)}).items():
        head += f'\n[[players]]\nname = "{name}"\nrole = "{role}"\nx = {x}\ny = {y}\n'
    return head


def status(observer: Observer, name: str) -> PlayerStatus:
    found = observer.state.player(name)
    assert found is not None
    return found


@pytest.mark.system
@FAULTS
def test_four_led_robots_stop_when_the_referee_falls_silent(tmp_path: Path, fault: signal.Signals) -> None:
    (tmp_path / "still.py").write_text(STILL, encoding="utf-8")
    with LiveMatch(tmp_path, lease_match(), movers=()) as match:
        observer = match.observer

        def driven(*led: str) -> bool:
            observer.go_on()
            return observer.playing and observer.moving(*led)

        for name in LED:
            assert status(observer, name).lease is None
            observer.decide(OfficialAction.SET_STATE, name, "tagged")
        observer.wait_until(lambda: driven(*LED), "the referee to drive them", 120.0)
        sender = observer.heard.states[-1].sender
        observer.wait_until(lambda: all(observer.mode(name) == "Referee" for name in LED), "them to say so")
        assert all(status(observer, name).lease is not None for name in LED)

        before = len(observer.heard.poses)
        old = match.child("coordinator")
        old.send_signal(fault)
        observer.wait_until(lambda: observer.standing(*LED), "them to stand")
        # The next referee may speak before they stand: it holds them in its halt.
        silent = max(state.stamp for state in observer.heard.states if state.sender == sender)
        moved, latest = [observer.last_motion(name, before) for name in LED], silent + REFEREE_TIMEOUT + BRAKING
        assert all(at is not None and at <= latest for at in moved), (latest, moved)

        match.wait_replaced("coordinator", old)
        observer.wait_until(
            lambda: observer.heard.states[-1].sender != sender and observer.state.halted, "the next referee, in HALT"
        )
        observer.time_passes(0.5, "nobody moves in the halt")
        assert observer.standing(*LED)

        observer.wait_until(lambda: driven(*LED), "the referee to drive them again", 120.0)

        observer.decide(OfficialAction.SET_STATE, LED[0], "normal")
        observer.wait_until(lambda: status(observer, LED[0]).lease is None, "the lease of one to be given back")
        observer.wait_until(lambda: observer.standing(LED[0]), "its own strategy to stand")
        observer.wait_until(lambda: observer.mode(LED[0]) != "Referee", "its own strategy to be in control")
        observer.wait_until(lambda: driven(*LED[1:]), "the referee to go on driving the others", 120.0)
