"""The stop certificate of a match in which much goes wrong agrees with what an observer on its bus has seen."""

import itertools
import json
import math
import signal
from collections.abc import Callable
from typing import Any

import pytest

from tests.system.harness import MINNOWS, PLAYERS, Match, long_match, patient
from tests.system.observer import Observer
from vrg.bus.messages import OfficialAction, at_rest
from vrg.recording.stops import REST_TIME

pytestmark = [pytest.mark.system, pytest.mark.thorough]

TICK = 0.02
"""The match time in s between two ticks of the world."""
SEEN = 0.5
"""The match time in s by which the observer and the launcher may hear the same thing at different times."""


def seen_to_stand(observer: Observer, name: str, since: float, until: float) -> float | None:
    """The match time from which the observer saw a robot at rest between two match times, and not only for a moment."""
    later = [p for p in observer.heard.poses if since <= p.stamp <= until + REST_TIME]
    rests = [at_rest(observer.body(name, poses).twist) for poses in later]
    for number, poses in enumerate(later):
        until_moving = next((p.stamp for p, rest in zip(later[number:], rests[number:], strict=True) if not rest), None)
        long = until_moving is None or until_moving - poses.stamp >= REST_TIME or until_moving > until
        if rests[number] and long and poses.stamp <= until:
            return poses.stamp
    return None


def everybody_stands(observer: Observer) -> None:
    observer.wait_until(
        lambda: all(at_rest(b.twist) for b in observer.heard.poses[-1].body.bodies), "all robots to stand"
    )


def fail_player(match: Match, name: str, fault: signal.Signals) -> None:
    old = match.child(name)
    old.send_signal(fault)
    match.wait_replaced(name, old)
    assert match.observer.halts_nobody_else(name), match.observer.state.halted
    match.go_on()


def go_wrong(match: Match) -> None:
    """A player dies and another one hangs, an official halts, the emergency stop is engaged, and the world dies."""
    observer = match.observer
    observer.wait_until(
        lambda: all(observer.body(name).twist.v > 0.3 for name in MINNOWS), "everybody to be on the way"
    )
    fail_player(match, "ann", signal.SIGKILL)
    fail_player(match, "bob", signal.SIGSTOP)
    observer.decide(OfficialAction.HALT)
    observer.wait_until(lambda: observer.state.halted, "the halt")
    everybody_stands(observer)
    match.resume()
    match.command("estop", "faults", "--router", match.endpoint, "--reason", "a test")
    observer.wait_until(lambda: observer.state.estop, "the emergency stop")
    everybody_stands(observer)
    match.command("estop", "faults", "--release", "--router", match.endpoint)
    match.resume()
    world, epoch = match.child("world"), observer.epoch
    world.kill()
    match.wait_replaced("world", world)
    observer.wait_until(lambda: observer.epoch == epoch + 1 and observer.state.halted, "a halt in the new world")
    match.resume()
    match.launcher.send_signal(signal.SIGINT)
    assert match.wait_ended() == 130


def test_every_fault_of_a_match_is_certified_once_and_as_it_was_seen(start: Callable[..., Match]) -> None:
    match = start(patient(long_match("faults")))
    go_wrong(match)
    observer, heard = match.observer, match.observer.heard
    told = json.loads(match.command("run", "stops", str(match.run.path), "--json"))
    assert told == json.loads(match.run.result.read_text())["stops"]
    assert told["notes"] == []
    assert told["sentence"] in match.said()
    table = match.command("run", "stops", str(match.run.path))
    assert table.strip().splitlines()[-1] == told["sentence"]

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
        agrees(observer, incident, name)
        newest = max(r.stamp for r in heard.reports[name] if r.stamp <= incident["time"] + TICK)
        assert incident["time"] == pytest.approx(newest, abs=SEEN), "it begins with the newest message"
    for incident in (halts[0], estop):
        assert sorted(incident["robots"]) == sorted(PLAYERS)
        for name in MINNOWS:
            agrees(observer, incident, name)
    engaged = heard.estops[0][0]
    assert estop["time"] == pytest.approx(engaged, abs=SEEN)
    assert sorted(deaths["world"]["robots"]) == sorted(PLAYERS)
    for stop in deaths["world"]["robots"].values():
        assert stop["outcome"] in ("stopped", "stood already")
        assert stop["distance"] < 0.2
    assert told["worst"]["seconds"] == max(s["seconds"] for i in told["incidents"] for s in i["robots"].values())


def agrees(observer: Observer, incident: dict[str, Any], name: str) -> None:
    """The certificate says of a robot what the observer saw, as exactly as it claims."""
    stop, until = incident["robots"][name], incident["went_on"]
    seen = seen_to_stand(observer, name, incident["time"], until)
    end = incident["time"] + stop["seconds"]
    if stop["outcome"] == "did not stand before play went on":
        # The next player of this name was there before the robot of the last one stood.
        assert seen is None or seen == pytest.approx(until, abs=SEEN), (incident, seen)
    else:
        assert stop["outcome"] == "stopped", f"{name} after {incident['what']}: {stop}"
        assert stop["resolution"] <= 2 * TICK + 1e-9
        assert seen == pytest.approx(end, abs=2 * TICK + 1e-6)
    then = [p for p in observer.heard.poses if incident["time"] <= p.stamp <= end + 1e-6]
    places = [observer.body(name, p).pose for p in then]
    rolled = sum(math.dist((a.x, a.y), (b.x, b.y)) for a, b in itertools.pairwise(places))
    assert stop["distance"] == pytest.approx(rolled, abs=0.03)
