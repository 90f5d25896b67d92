"""The referee drives robots by a lease, and is killed or frozen while it does."""

import signal
from pathlib import Path

import pytest

from tests.system.harness import Match
from tests.vcan import UDP
from vrg.bus.messages import OfficialAction, PlayerStatus
from vrg.hal.can.link import Link
from vrg.hal.gate import REFEREE_TIMEOUT

LED = ("red1", "red2", "red3", "red4")
BRAKING = 1.2
"""The match time in s in which every robot stands after its lease has expired: ticks of the world, and its brakes."""
STILL = """
from vrg.agents import STILL, Strategy


class Still(Strategy):
    def act(self, view):
        return STILL
"""
WIRED = """
[backends.can]
interface = "{link.interface}"
channel = "{link.channel}"
emulate = true
"""
ROBOT = """
[backends.can.robots.{name}]
left = [{left}]
right = [{right}]
ratio = 50.0
"""


def lease_match(names: tuple[str, ...], link: Link | None = None) -> str:
    """A match of RoboFlag on so large a field that home is a minute away; nobody moves by itself.

    Args:
        names: the red players. link: the CAN bus that their robots are on; None for virtual robots.
    """
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
    if link is not None:
        head += WIRED.format(link=link)
        for number, name in enumerate(names):
            head += ROBOT.format(name=name, left=2 * number, right=2 * number + 1)
    places = {name: ("red", -2.0, 14.0 - 2.0 * number) for number, name in enumerate(names)}
    for name, (role, x, y) in (places | {"blue1": ("blue", 20.0, 12.0)}).items():
        backend = "can" if link is not None and role == "red" else "sim"
        head += f'\n[[players]]\nname = "{name}"\nrole = "{role}"\nbackend = "{backend}"\nx = {x}\ny = {y}\n'
    return head


def check_leases(match: Match, names: tuple[str, ...], fault: signal.Signals) -> None:
    """Let the referee drive these players, fail and come back."""
    observer = match.observer

    def status(name: str) -> PlayerStatus:
        found = observer.state.player(name)
        assert found is not None
        return found

    def driven(*led: str) -> bool:
        observer.go_on()
        return observer.playing and observer.moving(*led)

    for name in names:
        assert status(name).lease is None
        observer.decide(OfficialAction.SET_STATE, name, "tagged")
    observer.wait_until(lambda: driven(*names), "the referee to drive them", 120.0)
    sender = observer.heard.states[-1].sender
    observer.wait_until(lambda: all(observer.mode(name) == "Referee" for name in names), "them to say so")
    assert all(status(name).lease is not None for name in names)

    before = len(observer.heard.poses)
    old = match.child("coordinator")
    old.send_signal(fault)
    observer.wait_until(lambda: observer.standing(*names), "them to stand")
    # The next referee may speak before they stand: it holds them in its halt.
    silent = max(state.stamp for state in observer.heard.states if state.sender == sender)
    moved = {name: observer.last_motion(name, before) for name in names}
    assert all(at is not None and at <= silent + REFEREE_TIMEOUT + BRAKING for at in moved.values()), (silent, moved)

    match.wait_replaced("coordinator", old)
    observer.wait_until(
        lambda: observer.heard.states[-1].sender != sender and observer.state.halted, "the referee to be back, in HALT"
    )
    observer.time_passes(0.5, "nobody moves in the halt")
    assert observer.standing(*names)

    observer.wait_until(lambda: driven(*names), "the referee to drive them again", 120.0)

    observer.decide(OfficialAction.SET_STATE, names[0], "normal")
    observer.wait_until(lambda: status(names[0]).lease is None, "the lease of one to be given back")
    observer.wait_until(lambda: observer.standing(names[0]), "its own strategy to stand")
    observer.wait_until(lambda: observer.mode(names[0]) != "Referee", "its own strategy to be in control")
    observer.wait_until(lambda: driven(*names[1:]), "the referee to go on driving the others", 120.0)


def given_back(match: Match, names: tuple[str, ...]) -> None:
    """Give all of these back to their players, who stand."""
    observer = match.observer
    for name in names:
        observer.decide(OfficialAction.SET_STATE, name, "normal")
    observer.wait_until(lambda: not any(player.lease for player in observer.state.players), "no lease")
    observer.wait_until(lambda: observer.standing(*names), "them to stand")


@pytest.mark.system
@pytest.mark.parametrize(
    ("link", "faults"),
    [
        pytest.param(None, [signal.SIGKILL], id="virtual, dies"),
        pytest.param(None, [signal.SIGSTOP], id="virtual, hangs", marks=pytest.mark.thorough),
        pytest.param(UDP, [signal.SIGKILL, signal.SIGSTOP], id="can, dies and hangs", marks=pytest.mark.thorough),
    ],
)
def test_four_led_robots_stop_when_the_referee_falls_silent(
    tmp_path: Path, link: Link | None, faults: list[signal.Signals]
) -> None:
    (tmp_path / "still.py").write_text(STILL, encoding="utf-8")
    with Match(tmp_path, lease_match(LED, link), movers=()) as match:
        for fault in faults:
            check_leases(match, LED, fault)
            given_back(match, LED)
