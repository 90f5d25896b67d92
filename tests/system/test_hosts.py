"""Matches over several hosts: network namespaces with an sshd each, real ssh, real processes."""

import json
import os
import shutil
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from tests.system.lab import VRG, Lab, LabHost, laboratory, run
from vrg.games import GAMES
from vrg.launch.remote.silence import LAUNCHER_TIMEOUT
from vrg.recording.reader import read_tracks
from vrg.runs.events import EventKind, read_events
from vrg.testing.processes.match import MINNOWS, PLAYERS, LiveMatch, long_match, patient
from vrg.testing.requirements import missing
from vrg.testing.waiting import wait_until

pytestmark = pytest.mark.system

PATIENCE = 180.0
"""s: an agent's start on a busy machine takes a while, and its lease lasts."""


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    with laboratory(tmp_path_factory.mktemp("lab"), "h1", "h2", "h3") as made:
        yield made
        for host in made.hosts.values():
            assert host.processes() == [], f"left behind on {host.name}"


def spread(lab: Lab, name: str) -> str:
    """The long match with its world on one host and two minnows on others."""
    text = patient(long_match(name)).replace("\n[rules]", f'\n{lab.tables()}\n[place]\nworld = "h1"\n\n[rules]', 1)
    for player, host in (("ann", "h2"), ("bob", "h3")):
        text = text.replace(f'name = "{player}"', f'name = "{player}"\nmachine = "{host}"')
    return text


@pytest.fixture(scope="module")
def shared(lab: Lab, tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveMatch]:
    """A match that tests use one after the other."""
    with LiveMatch(tmp_path_factory.mktemp("match"), spread(lab, "hosts"), environment=lab.environment) as match:
        yield match


@pytest.fixture
def match(shared: LiveMatch) -> LiveMatch:
    """The shared match, in play."""
    plays_on(shared)
    return shared


def plays_on(match: LiveMatch) -> None:
    """Wait until all minnows move, and resume play as an official does whenever it is halted meanwhile.

    One who resumes before a player or a machine is back takes the risk of another halt; this one waits for all.
    """
    observer = match.observer

    def moving() -> bool:
        heard = observer.heard.reports
        if all(heard[name] and observer.now - heard[name][-1].stamp < 1.0 for name in PLAYERS):
            observer.resume()
        return observer.playing and observer.moving(*MINNOWS)

    observer.wait_until(moving, "minnows to move", PATIENCE)


def process_of(host: LabHost, kind: str, name: str = "") -> psutil.Process | None:
    """A node's process on a host; None if there is none."""
    title = f"vrg {kind}{f' {name}' if kind == 'player' else ''} "
    for process in host.processes():
        try:
            if " ".join(process.cmdline()).startswith(title):
                return process
        except psutil.NoSuchProcess:
            continue
    return None


def replaced(match: LiveMatch, host: LabHost, kind: str, name: str, old: psutil.Process) -> None:
    def another() -> bool:
        new = process_of(host, kind, name)
        return new is not None and new.pid != old.pid

    match.observer.wait_until(another, f"{name or kind} to be started again on {host.name}", PATIENCE)


def stood_within(match: LiveMatch, name: str, since: int, before: str, seconds: float) -> None:
    """A robot stood so soon after the poses of number `since`, or after its last command, which may have come later."""
    observer = match.observer
    observer.wait_until(lambda: observer.stopped_at(name, since, before) is not None, f"{name} to stand", PATIENCE)
    stopped = observer.stopped_at(name, since, before)
    assert stopped is not None
    drives = [d.stamp for d in observer.heard.drives[name] if d.sender == before and d.stamp <= stopped]
    last = max([observer.heard.poses[since - 1].stamp, *drives])
    assert stopped - last <= seconds, f"{name} drove on for {stopped - last:.2f} s of match time"


def driver(match: LiveMatch, name: str) -> str:
    """Who drives this robot."""
    match.observer.look()
    return match.observer.heard.drives[name][-1].sender


def test_every_process_runs_on_its_host(match: LiveMatch, lab: Lab) -> None:
    assert process_of(lab.hosts["h1"], "world")
    assert process_of(lab.hosts["h2"], "player", "ann")
    assert process_of(lab.hosts["h3"], "player", "bob")
    assert match.child("cid").is_running()
    assert match.endpoint.startswith("tls/10.77.0.1:"), "a match over several machines has seats"


def test_a_killed_process_of_another_host_is_started_again_there(match: LiveMatch, lab: Lab) -> None:
    observer, host = match.observer, lab.hosts["h2"]
    old = process_of(host, "player", "ann")
    assert old is not None
    before, since = driver(match, "ann"), len(observer.heard.poses)
    old.kill()
    stood_within(match, "ann", since, before, 0.6)
    replaced(match, host, "player", "ann", old)
    plays_on(match)
    match.wait_said("h2: ann was killed by signal 9: started again")


@pytest.mark.thorough
def test_when_an_agent_is_killed_its_processes_end_and_others_take_their_places(match: LiveMatch, lab: Lab) -> None:
    observer, host = match.observer, lab.hosts["h3"]
    old, agent = process_of(host, "player", "bob"), host.agent()
    assert old is not None
    before, since = driver(match, "bob"), len(observer.heard.poses)
    agent.kill()
    stood_within(match, "bob", since, before, 2.0)
    wait_until(lambda: not old.is_running(), "the processes of the killed agent to end")
    replaced(match, host, "player", "bob", old)
    plays_on(match)
    match.wait_said("h3 is away (bob)")
    match.wait_said("h3 is back: bob runs again")
    told = [(event.what, event.text) for event in read_events(match.run.events) if event.process == "h3"]
    assert (EventKind.AWAY, "h3 does not answer (bob)") in told, "the stop certificate is made of such events"


def test_a_link_that_is_cut_for_a_moment_stops_the_robots_behind_it(match: LiveMatch, lab: Lab) -> None:
    observer, host = match.observer, lab.hosts["h2"]
    old = process_of(host, "player", "ann")
    assert old is not None
    before, since = driver(match, "ann"), len(observer.heard.poses)
    host.cut()
    try:
        stood_within(match, "ann", since, before, 0.6)
        observer.wait_moving("cid")
    finally:
        host.mend()
    plays_on(match)
    assert old.is_running(), "it needed no other process"


@pytest.mark.thorough
def test_a_host_whose_link_stays_cut_stops_its_own_processes_and_comes_back(match: LiveMatch, lab: Lab) -> None:
    """The world is there: nobody has a clock, and all robots stand, as the world does not step without it."""
    host = lab.hosts["h1"]
    world = process_of(host, "world")
    assert world is not None
    host.cut()
    try:
        wait_until(lambda: not host.processes(), f"all to end within the lease of {LAUNCHER_TIMEOUT:g} s")
    finally:
        host.mend()
    replaced(match, host, "world", "", world)
    plays_on(match)
    match.wait_said("h1 is back: world runs again")


def hosts_end(lab: Lab) -> None:
    """Wait until nobody is left on any host."""
    for host in lab.hosts.values():
        wait_until(lambda host=host: not host.processes(), f"all on {host.name} to end")  # type: ignore[misc]


def test_a_killed_launcher_leaves_nobody_behind_on_any_host(lab: Lab, shared: LiveMatch) -> None:
    """The last test of the shared match."""
    match = shared
    try:
        for host in lab.hosts.values():
            assert host.processes(), host.name
        match.launcher.kill()
        match.launcher.wait()
        hosts_end(lab)
        wait_until(lambda: not match.survivors(), "all here to end")
        keys = match.seats
        assert keys is not None
        wait_until(lambda: not keys.exists(), "the keys of the run to be deleted")
    finally:
        match.close()


@pytest.mark.thorough
def test_roboflag_over_three_hosts_and_a_bad_radio_is_played_to_its_end(
    lab: Lab, tmp_path: Path, shared: LiveMatch
) -> None:
    shared.close()
    text = GAMES.get("roboflag").default_match().read_text(encoding="utf-8")
    text = text.replace(
        "[rules]",
        f'engine = "planar"\nrate = 3.0\n{lab.tables()}\n'
        '[place]\nworld = "h1"\nreferee = "h2"\nrecorder = "h3"\nrouter = "h1"\n'
        "\n[radio]\nloss = 0.8\ndelay = 0.2\njitter = 0.1\n\n[rules]\n"
        "round_time = 12.0\nsudden_death = 3.0\nlineup_limit = 15.0\n",
    )
    for number, name in enumerate(("red1", "red2", "red3", "blue1", "blue2", "blue3"), 2):
        text = text.replace(f'name = "{name}"', f'name = "{name}"\nmachine = "h{number % 3 + 1}"')
    with LiveMatch(tmp_path, text, environment=lab.environment, movers=()) as match:
        assert match.play_out() == 0
    result = json.loads(match.run.result.read_text())
    assert result["ended"] == "game over"
    assert set(result["processes"]) >= {"world", "referee", "recorder", "red1", "red4", "blue2"}
    links = [link for process in result["processes"].values() for link in process.get("radio", {}).values()]
    assert result["radio"]["lost"] == sum(link["lost"] for link in links) > 0
    assert all(0.2 <= link["delay"] <= 0.3 for link in links if link["arrived"])
    assert len(read_tracks(match.run.recordings())) == 8
    assert match.run.plot.stat().st_size > 10_000
    for host in lab.hosts.values():
        left = list((host.state / "vrg" / "hosted").glob(f"{match.run.path.name}*"))
        assert left == [], "what was fetched is deleted, and so are the keys"


@pytest.mark.thorough
def test_the_doctor_checks_every_machine_and_says_what_to_do(lab: Lab, tmp_path: Path, shared: LiveMatch) -> None:
    shared.close()
    text = spread(lab, "checked").replace('[machines.h2]\nhost = "h2"', '[machines.h2]\nhost = "10.77.0.99"')
    text = text.replace(
        f'[machines.h3]\nhost = "h3"\nvrg = "{VRG}"', '[machines.h3]\nhost = "h3"\nvrg = "~/nowhere/vrg"'
    )
    (tmp_path / "match.toml").write_text(text, encoding="utf-8")
    command = [sys.executable, "-P", "-m", "vrg", "doctor", "--json", "match.toml"]
    environment = {**os.environ, **lab.environment}
    done = subprocess.run(
        command, env=environment, cwd=tmp_path, capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 1, done.stderr
    found = json.loads(done.stdout)
    good = {finding["what"]: finding["text"] for finding in found["h1"] if finding["good"]}
    assert "4 players" in good["match"]
    assert "reached at t" in good["router"]
    (h2,) = found["h2"]
    assert "No route to host: is the machine switched on" in h2["text"]
    (h3,) = found["h3"]
    assert "write its path into [machines.h3]" in h3["text"]
    assert lab.hosts["h1"].processes() == []


@pytest.mark.thorough
def test_two_sites_with_a_router_each_lose_the_link_between_them(lab: Lab, tmp_path: Path, shared: LiveMatch) -> None:
    """The processes of h3 use the router of h2; when the link of h2 is cut, both hear nobody else any more."""
    shared.close()
    text = spread(lab, "sites").replace('host = "h2"', 'host = "h2"\nrouter = true')
    text = text.replace('host = "h3"', 'host = "h3"\nvia = "h2"')
    with LiveMatch(tmp_path, text, environment=lab.environment) as match:
        observer, host = match.observer, lab.hosts["h2"]
        assert process_of(host, "router")
        old = process_of(host, "player", "ann")
        assert old is not None
        ann, bob, since = driver(match, "ann"), driver(match, "bob"), len(observer.heard.poses)
        host.cut()
        try:
            stood_within(match, "ann", since, ann, 0.6)
            stood_within(match, "bob", since, bob, 0.6)
            observer.wait_until(lambda: "h2 does not answer (" in (observer.state.halted or ""), "a halt")
        finally:
            host.mend()
        plays_on(match)
        assert old.is_running(), "it needed no other process"


@pytest.mark.thorough
def test_wall_clocks_that_are_wrong_and_are_set_in_the_match_harm_nothing_and_a_frozen_launcher_loses_its_lease(
    lab: Lab, tmp_path: Path, shared: LiveMatch
) -> None:
    """The world's machine and a player's are hours off, each in its own way; leases last no longer for that."""
    shared.close()
    if shutil.which("cc") is None:
        missing("no compiler of C")
    library = tmp_path / "wall_clock.so"
    run("cc", "-shared", "-fPIC", "-O1", "-o", str(library), str(Path(__file__).with_name("wall_clock.c")), "-ldl")
    text, offsets = spread(lab, "clocks"), [tmp_path / "h1.offset", tmp_path / "h2.offset"]
    for name, offset, hours in zip(("h1", "h2"), offsets, (1, -3), strict=True):
        offset.write_bytes(struct.pack("q", 3600 * hours))
        command = tmp_path / f"{name}.vrg"
        command.write_text(f'#!/bin/sh\nexec env LD_PRELOAD={library} WALL_CLOCK={offset} {VRG} "$@"\n')
        command.chmod(0o755)
        text = text.replace(f'host = "{name}"\nvrg = "{VRG}"', f'host = "{name}"\nvrg = "{command}"')
    probe = ["env", f"LD_PRELOAD={library}", f"WALL_CLOCK={offsets[0]}", "date", "+%s"]
    before = int(time.time())
    there = int(subprocess.run(probe, capture_output=True, check=True).stdout)
    assert before + 3600 <= there <= time.time() + 3600, "the wall clock is wrong there"
    with LiveMatch(tmp_path, text, environment=lab.environment) as match:
        observer = match.observer
        plays_on(match)
        for hours in (-2, 5):
            for offset, factor in zip(offsets, (1, -2), strict=True):
                with offset.open("r+b") as file:
                    file.write(struct.pack("q", 3600 * hours * factor))
            observer.time_passes(2.0, "with other wall clocks")
            plays_on(match)
        assert "killed" not in match.said()
        assert "does not answer" not in match.said()
        match.launcher.send_signal(signal.SIGSTOP)
        try:
            hosts_end(lab)
        finally:
            match.launcher.send_signal(signal.SIGCONT)
            match.launcher.kill()
        wait_until(lambda: not match.survivors(), "all here to end")
