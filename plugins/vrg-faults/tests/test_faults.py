"""Simulated matches with faults: the same by the same seed, sound as they are, and unsound with a planted mistake."""

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from unittest import mock

import msgspec
import pytest

import vrg.agents.player
import vrg.hal.permission
import vrg_faults.session
from vrg.agents import Action, View
from vrg.agents.player import Player
from vrg.bus.codec import Received
from vrg.bus.mailbox import Numbers
from vrg.bus.messages import RefereeState
from vrg.bus.node import Tick
from vrg.bus.pacing import Pacer
from vrg.config.loading import load_match
from vrg.config.setup import MatchSetup
from vrg.coordinator.attendance import Attendance
from vrg.coordinator.coordinator import Coordinator
from vrg.coordinator.journal import Journal
from vrg.coordinator.match import Checkpoint
from vrg.coordinator.outcome import Effects
from vrg.hal.can.workshop.emulated import EmulatedDrive
from vrg.hal.device import Device
from vrg.hal.estop import EstopOrders
from vrg.hal.permission import Permission
from vrg.hal.sim import robot
from vrg.hal.sim.config import WorldConfig
from vrg.hal.sim.driver import SimDriver
from vrg.hal.sim.snapshot import WorldSnapshot
from vrg.hal.sim.world import World
from vrg.runs.run_folder import RunFolder
from vrg.testing.command_line import invoke
from vrg.testing.tiny import TINY, TINY_CAN
from vrg.types import Twist
from vrg_faults.checking import checked, problems_of, shortest
from vrg_faults.disk import SimulatedJournal
from vrg_faults.plan import EVERYONE, REFEREE, WORLD, Fault, FaultKind, Streams, drawn
from vrg_faults.simulation import SimulatedMatch

RULES = ("passes = 1", "passes = 2\npass_limit = 8.0")
MATCH = TINY.replace(*RULES)
SECONDS, COUNT = 30.0, 6


def loaded(folder: Path, text: str) -> MatchSetup:
    file = folder / "tiny.toml"
    file.write_text(text)
    return load_match(file).at_rate(1.0)


@pytest.fixture(scope="module")
def setup(tmp_path_factory: pytest.TempPathFactory) -> MatchSetup:
    return loaded(tmp_path_factory.mktemp("match"), MATCH)


@pytest.fixture(scope="module")
def can_setup(tmp_path_factory: pytest.TempPathFactory) -> MatchSetup:
    return loaded(tmp_path_factory.mktemp("can"), TINY_CAN.replace(*RULES))


def seeds(brief: int, all_of_them: int) -> list[Any]:
    """So many seeds, and more that are thorough."""
    more = [pytest.param(seed, marks=pytest.mark.thorough) for seed in range(brief, all_of_them)]
    return [*range(brief), *more]


def faults_of(setup: MatchSetup, seed: int) -> list[Fault]:
    players = [player.name for player in setup.players]
    return drawn(Streams(seed)("faults"), players, 0.6 * SECONDS, COUNT, setup.physical)


def test_a_seed_gives_the_same_match_and_the_same_faults(setup: MatchSetup, tmp_path: Path) -> None:
    one, other = (checked(setup, tmp_path / name, 5, faults_of(setup, 5), SECONDS) for name in ("one", "other"))
    assert one == other
    assert len(one[1].splitlines()) > 3, "much has been journalled"


def test_a_hand_drives_a_player_backwards_and_then_it_plays_again(setup: MatchSetup, tmp_path: Path) -> None:
    run = RunFolder(tmp_path / "run")
    run.prepare()
    match = SimulatedMatch(setup, run, 0, [Fault(FaultKind.HAND, "ann", 4.0, 2.0)])
    speeds: dict[int, list[float]] = {}

    def look() -> None:
        if (poses := match.observer.poses) is not None:
            ann = next(body for body in poses.body.bodies if body.name == "ann")
            speeds.setdefault(int(poses.stamp), []).append(ann.twist.v)

    match.heard = look
    match.run(12.0)
    assert max(speeds[5]) < -0.2
    assert max(speeds[8]) > 0.2


@pytest.mark.parametrize("seed", seeds(2, 12))
def test_whatever_fails_what_must_hold_holds(setup: MatchSetup, seed: int) -> None:
    assert problems_of(setup, seed, faults_of(setup, seed), SECONDS) == []


@pytest.mark.parametrize(
    ("seed", "others", "begins"),
    [
        (14, [Fault(FaultKind.KILL, REFEREE, 12.0, 0.3)], [1.9, 6.5, 11.0]),
        (332, [Fault(FaultKind.RESET, REFEREE, 8.48, 2.44)], [10.43]),
    ],
    ids=["at the begin, while a pass ends, and while the referee ends", "while match time stands"],
)
def test_after_a_full_disk_no_honest_call_is_held_to_be_false(
    setup: MatchSetup, seed: int, others: list[Fault], begins: list[float]
) -> None:
    full = [Fault(FaultKind.FULL, REFEREE, begin, 2.83) for begin in begins]
    assert problems_of(setup, seed, [*full, *others], SECONDS) == []


def test_one_more_draw_in_one_place_does_not_disturb_others() -> None:
    one, other = Streams(1), Streams(1)
    one("link of ann").random()
    assert one("link of bob").random() == other("link of bob").random()
    assert one("link of bob").random() != one("link of ann").random()


def _ignoring_full(self: SimulatedJournal, file: int, data: bytes, at: int) -> int:
    return len(data) if self._disk.full else Journal._put(self, file, data, at)


def _with_torn(load: Callable[..., tuple[int, object]]) -> Callable[..., object]:
    """What a crash left of a line is not cut off: the next record goes on behind it, in the same line."""

    def planted(self: Journal, header: object) -> tuple[int, object]:
        content = self.path.read_bytes()
        end, last = load(self, header)
        if len(content) > end:
            self.path.write_bytes(content)
        return max(len(content), end), last

    return planted


def _standing(**change: object) -> property:
    own = Journal.standing.fget
    assert own is not None

    def planted(self: Journal) -> Checkpoint | None:
        found: Checkpoint | None = own(self)
        return None if found is None else msgspec.structs.replace(found, **change)

    return property(planted)


def _same_epoch(self: World, config: WorldConfig, snapshot: WorldSnapshot | None = None) -> None:
    BUILD(self, config, snapshot)
    self.epoch = 0


def _keeping_back(announce: Callable[[Coordinator], None]) -> Callable[[Coordinator], None]:
    def planted(self: Coordinator) -> None:
        self._calls = [call for call in self._calls if call.number != 2]
        announce(self)

    return planted


def _by_wall(self: Pacer, messages: Sequence[Any], now: float, *, cut: bool) -> bool:
    return HEAR(self, messages, time.time(), cut=cut)


def _unwatched(self: EmulatedDrive, *arguments: Any) -> None:
    INITIALISE(self, *arguments)
    self._watchdog = 0.0


def _deaf_to_halts(self: Permission, at: float, state: RefereeState) -> None:
    standing = [msgspec.structs.replace(p, may_move=True) for p in state.players]
    GATE(self, at, msgspec.structs.replace(state, halted=None, players=standing) if state.halted is not None else state)


def _deaf_player(self: Player, tick: Tick, referee: Received[RefereeState] | None) -> str | None:
    why = REASON(self, tick, referee)
    return None if why == "halt" else why


def _careless(self: Player, view: View, action: Action) -> None:
    DRIVE(self, msgspec.structs.replace(view, me=msgspec.structs.replace(view.me, may_move=True)), action)


def _for_ever(self: Device, now: float) -> Twist | None:
    return None if self._manual.latest is None else BY_HAND(self, self._manual.latest.stamp)


BY_HAND = Device.manual_twist
GATE, REASON, DRIVE = Permission.hear, Player._reason_to_stand, Player.drive
HEAR, INITIALISE, BUILD = Pacer.hear, EmulatedDrive.__init__, World.__init__
TIMEOUT = "REFEREE_TIMEOUT"
PLANTED: dict[str, tuple[int | list[Fault], list[tuple[Any, str, Any]]]] = {
    "journal: a full disk goes unnoticed": (4, [(SimulatedJournal, "_put", _ignoring_full)]),
    "journal: a torn line stays": (1, [(Journal, "_load", _with_torn(Journal._load))]),
    "journal: calls are numbered anew after a restart": (1, [(Journal, "standing", _standing(calls=0))]),
    "journal: the clock is forgotten in a restart": (16, [(Journal, "standing", _standing(total=0.0))]),
    "journal: evidence is not written": (0, [(Journal, "record_evidence", lambda *_: None)]),
    "coordinator: it announces what is not on disk": (0, [(Journal, "settled", lambda _: True)]),
    "coordinator: a call is kept back": (3, [(Coordinator, "_announce", _keeping_back(Coordinator._announce))]),
    "executor: what comes twice is taken twice": (3, [(Numbers, "is_new", lambda *_: True)]),
    "device: no watchdog": (3, [(robot, "COMMAND_TIMEOUT", 1e9)]),
    "device: a silent referee is not missed": (
        1,
        [(vrg.hal.permission, TIMEOUT, 1e9), (vrg.agents.player, TIMEOUT, 1e9)],
    ),
    "device: a person who sends nothing more is obeyed": (
        [Fault(FaultKind.HAND, "ann", 4.0, 1.5)],
        [(Device, "manual_twist", _for_ever)],
    ),
    "everyone: in a HALT robots drive on": (
        [Fault(FaultKind.HALT, EVERYONE, 2.5, 0.0)],
        [
            (Permission, "hear", _deaf_to_halts),
            (Player, "_reason_to_stand", _deaf_player),
            (Player, "drive", _careless),
        ],
    ),
    "coordinator: it does not halt when the world goes on from its snapshot": (
        [Fault(FaultKind.KILL, WORLD, 2.5, 0.1)],
        [(Coordinator, "_hear_world", lambda _: Effects())],
    ),
    "world: a restart is no new epoch": (9, [(World, "__init__", _same_epoch)]),
    "everyone: an emergency stop is ignored": (
        3,
        [(EstopOrders, "take", lambda _: None), (EstopOrders, "_sound", lambda *_: None)],
    ),
    "executor: the wall clock paces a node": (5, [(Pacer, "hear", _by_wall)]),
    "driver: it is never disarmed after a stop that it has missed": (
        [Fault(FaultKind.WRONG, "shark", 4.0, 2.5), Fault(FaultKind.ESTOP, EVERYONE, 4.3, 0.4)],
        [(SimDriver, "_stopped", lambda _: False)],
    ),
}
PLANTED_CAN: dict[str, tuple[int | list[Fault], list[tuple[Any, str, Any]]]] = {
    "drives: no watchdog": (1, [(EmulatedDrive, "__init__", _unwatched)]),
    "device: it does not recover": (0, [(Device, "_recover", lambda _: None)]),
    "referee: it does not halt for a faulty robot": (0, [(Attendance, "failing", lambda *_, **__: (set(), []))]),
}


OTHERS = ("journal: a torn line stays", "journal: the clock is forgotten in a restart",
          "journal: evidence is not written", "executor: what comes twice is taken twice",
          "world: a restart is no new epoch", "executor: the wall clock paces a node",
          "driver: it is never disarmed after a stop that it has missed", "device: it does not recover",
          "drives: no watchdog")  # fmt: skip
"""Mistakes that only `make test-all` plants."""


def marked(mistake: str) -> Any:
    return pytest.param(mistake, marks=[pytest.mark.thorough] if mistake in OTHERS else [])


@pytest.mark.parametrize("mistake", [marked(mistake) for mistake in (*PLANTED, *PLANTED_CAN)])
def test_a_planted_mistake_is_found(setup: MatchSetup, can_setup: MatchSetup, mistake: str) -> None:
    """The latter ones in robots with drives."""
    match = can_setup if mistake in PLANTED_CAN else setup
    found_by, patches = (PLANTED | PLANTED_CAN)[mistake]
    seed, faults = (found_by, faults_of(match, found_by)) if isinstance(found_by, int) else (0, found_by)
    with ExitStack() as stack:
        for target, name, planted in patches:
            stack.enter_context(mock.patch.object(target, name, planted))
        assert problems_of(match, seed, faults, SECONDS)


def test_a_call_that_is_announced_before_its_line_is_on_disk_is_found(setup: MatchSetup) -> None:
    stalled = Fault(FaultKind.STALLED, REFEREE, 0.05, 2.0)
    faults = [stalled, Fault(FaultKind.KILL, REFEREE, 1.0, 0.3)]

    def eager(self: Coordinator, now: float, standing: Checkpoint) -> None:
        append(self, now, standing)
        self._announce()

    append = Coordinator._append
    assert problems_of(setup, 0, faults, SECONDS) == []
    with mock.patch.object(Coordinator, "_append", eager):
        assert problems_of(setup, 0, faults, SECONDS)


def test_a_call_that_a_thawed_process_does_not_publish_again_is_found(setup: MatchSetup) -> None:
    frozen_in_a_tick = [Fault(FaultKind.FREEZE, REFEREE, 8.25, 2.0, 1.0)]
    assert problems_of(setup, 0, frozen_in_a_tick, SECONDS) == []
    with mock.patch.object(vrg_faults.session, "EVENT_LIFESPAN", 0.0):
        assert problems_of(setup, 0, frozen_in_a_tick, SECONDS)


@pytest.mark.parametrize("seed", seeds(1, 8))
def test_robots_with_drives_stand_and_play_goes_on_whatever_fails(can_setup: MatchSetup, seed: int) -> None:
    assert problems_of(can_setup, seed, faults_of(can_setup, seed), SECONDS) == []


def test_a_silent_bus_halts_the_match_which_goes_on_when_it_is_heard_again(
    can_setup: MatchSetup, tmp_path: Path
) -> None:
    silent = [Fault(FaultKind.BUS_SILENT, "ann", 4.0, 2.0)]
    problems, journal = checked(can_setup, tmp_path, 0, silent, SECONDS)
    assert problems == []
    halted, resumed = journal.find(b"ann: it has not been located"), journal.find(b"resumed by ann")
    assert 0 < halted < resumed


def test_wall_clocks_that_are_set_change_nothing(setup: MatchSetup, tmp_path: Path) -> None:
    clocks = [Fault(FaultKind.CLOCK, name, 5.0, 0.0, 7200.0) for name in (REFEREE, "world", "ann")]
    one, other = (checked(setup, tmp_path / str(len(faults)), 0, faults, SECONDS) for faults in ([], clocks))
    assert one == other


def test_the_fewest_faults_are_found() -> None:
    faults = [Fault(FaultKind.KILL, name, 1.0, 1.0) for name in ("ann", REFEREE, "bob", "world")]
    kept = shortest(faults, lambda fewer: {REFEREE, "world"} <= {fault.process for fault in fewer})
    assert [fault.process for fault in kept] == [REFEREE, "world"]


def test_the_command_names_the_seed_the_faults_and_what_does_not_hold(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "tiny.toml").write_text(MATCH)
    command = ["fuzz", str(tmp_path / "tiny.toml"), "--seed", "3", "--games", "1", "--faults", str(COUNT)]
    good = invoke(*command)
    assert good.exit_code == 0, good.output
    assert "in 0 something did not hold" in good.output
    monkeypatch.setattr(robot, "COMMAND_TIMEOUT", 1e9)  # the processes are forks of this one
    found = invoke(*command)
    assert found.exit_code == 1
    assert "seed 3: " in found.output
    assert "is driven, though" in found.output
