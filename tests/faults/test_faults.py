"""Simulated matches with faults: the same by the same seed, sound as they are, and unsound with a planted mistake."""

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from unittest import mock

import msgspec
import pytest
from typer.testing import CliRunner

import vrg.agents.player
import vrg.hal.can.guard
import vrg.hal.gate
from tests.tiny import TINY
from vrg.bus.mailbox import Numbers
from vrg.bus.node import Tick
from vrg.cli import make_app
from vrg.commands.fuzz import problems_of
from vrg.config.loading import load_match
from vrg.config.setup import MatchSetup
from vrg.coordinator.attendance import Attendance
from vrg.coordinator.coordinator import Coordinator
from vrg.coordinator.journal import Journal
from vrg.coordinator.match import Checkpoint
from vrg.faults.checking import checked, shortest
from vrg.faults.disk import FaultyJournal
from vrg.faults.plan import REFEREE, WORLD, Fault, FaultKind, Streams, drawn
from vrg.faults.simulation import SimulatedMatch
from vrg.hal.can.frame import Frame
from vrg.hal.can.workshop.odrive.drive import OdriveDrive
from vrg.hal.sim import safety
from vrg.hal.sim.snapshot import WorldSnapshot
from vrg.hal.sim.world import World
from vrg.launch.run_folder import RunFolder

MATCH = TINY.replace("passes = 1", "passes = 2\npass_limit = 8.0")
SECONDS, COUNT = 30.0, 6
WIRING = """
[backends.can]
interface = "virtual"
channel = "a"
protocol = "odrive"
emulate = true
[backends.can.robots.ann]
left = [0]
right = [1]
ratio = 50.0
"""


@pytest.fixture(scope="module")
def setup(tmp_path_factory: pytest.TempPathFactory) -> MatchSetup:
    file = tmp_path_factory.mktemp("match") / "tiny.toml"
    file.write_text(MATCH)
    return load_match(file).at_rate(1.0)


@pytest.fixture(scope="module")
def wired(tmp_path_factory: pytest.TempPathFactory) -> MatchSetup:
    file = tmp_path_factory.mktemp("match") / "wired.toml"
    file.write_text(MATCH.replace('name = "ann"\n', 'name = "ann"\nbackend = "can"\n') + WIRING)
    return load_match(file).at_rate(1.0)


def faults_of(setup: MatchSetup, seed: int) -> list[Fault]:
    return drawn(
        Streams(seed)("faults"), [player.name for player in setup.players], 0.6 * SECONDS, COUNT, setup.physical
    )


def journal_of(setup: MatchSetup, folder: Path, seed: int) -> tuple[bytes, list[str]]:
    run = RunFolder(folder)
    run.prepare()
    problems = checked(SimulatedMatch(setup, run, seed, faults_of(setup, seed)), SECONDS)
    return run.journal.read_bytes(), problems


def test_a_seed_gives_the_same_match_and_the_same_faults(setup: MatchSetup, tmp_path: Path) -> None:
    one, other = (journal_of(setup, tmp_path / name, 5) for name in ("one", "other"))
    assert one == other
    assert len(one[0].splitlines()) > 3


@pytest.mark.parametrize("seed", range(6))
def test_whatever_fails_what_must_hold_holds(setup: MatchSetup, seed: int) -> None:
    assert problems_of(setup, seed, faults_of(setup, seed), SECONDS) == []


@pytest.mark.parametrize("seed", [3, 5, 30])
def test_whatever_fails_what_must_hold_holds_with_drives(wired: MatchSetup, seed: int) -> None:
    assert problems_of(wired, seed, faults_of(wired, seed), SECONDS) == []


def test_nothing_goes_by_the_time_of_day(wired: MatchSetup, tmp_path: Path) -> None:
    steps = [Fault(FaultKind.CLOCK, name, 1.0, 2.0, 7200.0) for name in (WORLD, REFEREE, "ann", "bob")]
    journals = []
    for name, faults in (("without", []), ("with", steps)):
        run = RunFolder(tmp_path / name)
        run.prepare()
        assert checked(SimulatedMatch(wired, run, 1, faults), SECONDS) == []
        journals.append(run.journal.read_bytes())
    assert journals[0] == journals[1]


def test_a_process_that_is_started_again_keeps_its_bad_link(setup: MatchSetup, tmp_path: Path) -> None:
    run = RunFolder(tmp_path / "run")
    run.prepare()
    faults = [Fault(FaultKind.SLOW, "ann", 0.5, 9.0, 0.4), Fault(FaultKind.KILL, "ann", 1.0, 0.1)]
    match = SimulatedMatch(setup, run, 1, faults)
    match.run(3.0, lambda: None)
    session = match.processes["ann"].session
    assert session is not None
    assert session.delay() > 0.4


def test_a_process_may_hear_under_wrong_keys_before_it_has_heard_anything(setup: MatchSetup) -> None:
    faults = [Fault(FaultKind.KILL, WORLD, 4.0, 0.09), Fault(FaultKind.WRONG, WORLD, 4.24, 0.4)]
    assert problems_of(setup, 0, faults, SECONDS) == []


def test_one_more_draw_in_one_place_does_not_disturb_others() -> None:
    one, other = Streams(1), Streams(1)
    one("link of ann").random()
    assert one("link of bob").random() == other("link of bob").random()
    assert one("link of bob").random() != one("link of ann").random()


def _ignoring_full(self: FaultyJournal, at: int, data: bytes) -> None:
    if not self.disk.full:
        Journal._write(self, at, data)


def _with_torn(load: Callable[..., object]) -> Callable[..., object]:
    def planted(self: Journal, header: object) -> object:
        content = self.path.read_bytes()
        if content and not content.endswith(b"\n"):
            self.path.write_bytes(content + b"\n")
        return load(self, header)

    return planted


def _standing(**change: object) -> property:
    own = Journal.standing.fget
    assert own is not None

    def planted(self: Journal) -> Checkpoint | None:
        found: Checkpoint | None = own(self)
        return None if found is None else msgspec.structs.replace(found, **change)

    return property(planted)


def _same_epoch(restore: Callable[[World, WorldSnapshot], None]) -> Callable[[World, WorldSnapshot], None]:
    def planted(self: World, snapshot: WorldSnapshot) -> None:
        restore(self, snapshot)
        self.epoch -= 1

    return planted


def _keeping_back(announce: Callable[[Coordinator], None]) -> Callable[[Coordinator], None]:
    def planted(self: Coordinator) -> None:
        self._calls = [call for call in self._calls if call.number != 2]
        announce(self)

    return planted


def _by_time_of_day(tick: Callable[[Coordinator, Tick], None]) -> Callable[[Coordinator, Tick], None]:
    def planted(self: Coordinator, now: Tick) -> None:
        began = self.__dict__.setdefault("began", time.time() - now.time)
        tick(self, Tick(time.time() - began, live=now.live))

    return planted


TIMEOUT = "REFEREE_TIMEOUT"
PLANTED = {
    "journal: a full disk goes unnoticed": (15, [(FaultyJournal, "_write", _ignoring_full)]),
    "journal: a torn line stays": (4, [(Journal, "_load", _with_torn(Journal._load))]),
    "journal: calls are numbered anew after a restart": (4, [(Journal, "standing", _standing(calls=0))]),
    "journal: the clock is forgotten in a restart": (4, [(Journal, "standing", _standing(total=0.0))]),
    "journal: evidence is not written": (0, [(Journal, "witness", lambda *_: None)]),
    "coordinator: it announces what is not on disk": (0, [(Journal, "settled", lambda _: True)]),
    "coordinator: a call is kept back": (48, [(Coordinator, "_announce", _keeping_back(Coordinator._announce))]),
    "executor: what comes twice is taken twice": (44, [(Numbers, "is_new", lambda *_: True)]),
    "device: no watchdog": (1, [(safety, "COMMAND_TIMEOUT", 1e9)]),
    "device: a silent referee is not missed": (3, [(vrg.hal.gate, TIMEOUT, 1e9), (vrg.agents.player, TIMEOUT, 1e9)]),
    "coordinator: it goes by the time of day": (34, [(Coordinator, "tick", _by_time_of_day(Coordinator.tick))]),
    "world: a restart is no new epoch": (22, [(World, "restore", _same_epoch(World.restore))]),
}


def _worn(starve: Callable[[OdriveDrive], list[Frame]]) -> Callable[[OdriveDrive], list[Frame]]:
    def planted(self: OdriveDrive) -> list[Frame]:
        return starve(self) if self._now < 3.0 else []  # after it has been proved

    return planted


CAN_PLANTED = {
    "drive: its watchdog stops nothing": (FaultKind.KILL, [(OdriveDrive, "_starve", _worn(OdriveDrive._starve))]),
    "driver: it misses no drive": (FaultKind.MUTE, [(vrg.hal.can.guard, "HEARTBEAT_TIMEOUT", 1e9)]),
    "coordinator: it goes on without a robot": (FaultKind.BUS, [(Attendance, "failing", lambda *_, **__: ({}, []))]),
}


@pytest.mark.parametrize("mistake", CAN_PLANTED)
def test_a_planted_mistake_about_drives_is_found_by_one_fault(wired: MatchSetup, mistake: str) -> None:
    kind, patches = CAN_PLANTED[mistake]
    with ExitStack() as stack:
        for target, name, planted in patches:
            stack.enter_context(mock.patch.object(target, name, planted))
        assert problems_of(wired, 0, [Fault(kind, "ann", 4.0, 2.5)], 8.0)


@pytest.mark.parametrize("mistake", PLANTED)
def test_a_planted_mistake_is_found_by_its_seed(setup: MatchSetup, mistake: str) -> None:
    seed, patches = PLANTED[mistake]
    with ExitStack() as stack:
        for target, name, planted in patches:
            stack.enter_context(mock.patch.object(target, name, planted))
        assert problems_of(setup, seed, faults_of(setup, seed), SECONDS)


def test_the_fewest_faults_are_found() -> None:
    faults = [Fault(FaultKind.KILL, name, 1.0, 1.0) for name in ("ann", REFEREE, "bob", "world")]
    played: list[int] = []

    def play(fewer: Sequence[Fault]) -> list[str]:
        played.append(len(fewer))
        return ["wrong"] if {REFEREE, "world"} <= {fault.process for fault in fewer} else []

    problems, kept = shortest(faults, play)
    assert problems == ["wrong"]
    assert played == [4, 3, 2, 2, 1]
    assert [fault.process for fault in kept] == [REFEREE, "world"]


def test_the_command_names_the_seed_the_faults_and_what_does_not_hold(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "tiny.toml").write_text(MATCH)
    command = ["fuzz", str(tmp_path / "tiny.toml"), "--seed", "1", "--games", "1", "--faults", str(COUNT)]
    good = CliRunner().invoke(make_app(), command)
    assert good.exit_code == 0, good.output
    assert "in 0 something did not hold" in good.output
    monkeypatch.setattr(safety, "COMMAND_TIMEOUT", 1e9)  # the processes are forks of this one
    found = CliRunner().invoke(make_app(), command)
    assert found.exit_code == 1
    assert "seed 1: " in found.output
    assert "is driven, though" in found.output
