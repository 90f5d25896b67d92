"""The stop certificate of a match in which much goes wrong: each fault is in it, from when it was seen on the bus."""

import json
import signal
from collections.abc import Callable

import pytest

from vrg.bus.messages import OfficialAction
from vrg.testing.processes.match import MINNOWS, PLAYERS, LiveMatch, long_match, patient

pytestmark = [pytest.mark.system, pytest.mark.thorough]

TICK = 0.02
"""The match time in s between two ticks of the world."""
SEEN = 0.5
"""The match time in s by which the observer and the launcher may hear the same thing at different times."""


def fail_player(match: LiveMatch, name: str, fault: signal.Signals) -> None:
    old = match.child(name)
    old.send_signal(fault)
    match.wait_replaced(name, old)
    assert match.observer.halts_nobody_else(name), match.observer.state.halted
    match.go_on()


def go_wrong(match: LiveMatch) -> None:
    """A player dies and another one hangs, an official halts, the emergency stop is engaged, and the world dies."""
    observer = match.observer
    observer.wait_until(
        lambda: all(observer.body(name).twist.v > 0.3 for name in MINNOWS), "everybody to be on the way"
    )
    fail_player(match, "ann", signal.SIGKILL)
    fail_player(match, "bob", signal.SIGSTOP)
    observer.decide(OfficialAction.HALT)
    observer.wait_until(lambda: observer.state.halted, "the halt")
    observer.wait_until(observer.standing, "all robots to stand")
    match.resume()
    match.command("estop", "faults", "--router", match.endpoint, "--reason", "a test")
    observer.wait_until(lambda: observer.state.estop, "the emergency stop")
    observer.wait_until(observer.standing, "all robots to stand")
    match.command("estop", "faults", "--release", "--router", match.endpoint)
    match.resume()
    world, epoch = match.child("world"), observer.epoch
    world.kill()
    match.wait_replaced("world", world)
    observer.wait_until(lambda: observer.epoch == epoch + 1 and observer.state.halted, "a halt in the new world")
    match.resume()
    match.launcher.send_signal(signal.SIGINT)
    assert match.wait_ended() == 130


def test_every_fault_of_a_match_is_certified_once(start: Callable[..., LiveMatch]) -> None:
    match = start(patient(long_match("faults")))
    go_wrong(match)
    heard = match.observer.heard
    told = json.loads(match.command("run", "stops", str(match.run.path), "--json"))
    assert told["notes"] == []
    assert told["sentence"] in match.said()

    deaths = {i["process"]: i for i in told["incidents"] if i["kind"] == "death"}
    assert len(deaths) == sum(i["kind"] == "death" for i in told["incidents"])
    assert sorted(deaths) == ["ann", "bob", "world"]
    assert "signal 9" in deaths["ann"]["what"]
    assert "hangs" in deaths["bob"]["what"]
    [estop] = [i for i in told["incidents"] if i["kind"] == "estop"]
    assert "a test" in estop["what"]
    # On a slow machine the next player comes so late that the match is halted for that, too.
    away = [f"{name} has not reported" for name in ("ann", "bob")]
    halts = [i for i in told["incidents"] if i["kind"] == "halt" and not any(words in i["what"] for words in away)]
    assert ["called by observer" in i["what"] for i in halts].count(True) == 1
    assert sum("the world" in i["what"] for i in halts) == len(halts) - 1

    for name in ("ann", "bob"):
        incident = deaths[name]
        assert list(incident["robots"]) == [name]
        newest = max(r.stamp for r in heard.reports[name] if r.stamp <= incident["time"] + TICK)
        assert incident["time"] == pytest.approx(newest, abs=SEEN), "it begins with the newest message"
        # The next player of this name may have been there before the robot of the last one stood.
        assert incident["robots"][name]["outcome"] in ("stopped", "did not stand before play went on")
    for incident in (halts[0], estop):
        assert sorted(incident["robots"]) == sorted(PLAYERS)
        assert {incident["robots"][name]["outcome"] for name in MINNOWS} == {"stopped"}
    assert estop["time"] == pytest.approx(heard.estops[0][0], abs=SEEN)
    assert sorted(deaths["world"]["robots"]) == sorted(PLAYERS)
    for stop in deaths["world"]["robots"].values():
        assert stop["outcome"] in ("stopped", "stood already")
        assert stop["distance"] < 0.2
