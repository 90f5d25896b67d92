"""Which incidents a journal and a log of events tell of: each once, with its time, its robots and its end."""

import math
from collections.abc import Sequence

import pytest

from vrg.bus.messages import BY_OFFICIAL, EMERGENCY_STOP, Call, Estop, EstopRelease, Stage
from vrg.coordinator.journal import Record
from vrg.coordinator.match import Checkpoint
from vrg.recording.stops import Incident, IncidentKind
from vrg.runs.events import Event, EventKind
from vrg.runs.incidents import LAUNCHER_NAME, RunData, incidents_of

PLAYERS = ("ann", "bob")


class Run:
    """Writes what a match leaves. Times are match time, s; the launcher's clock is 1000 s ahead of it."""

    def __init__(self, *, logged: bool = True) -> None:
        self.records: list[Record] = []
        self.events: list[Event] = []
        self.estops: list[tuple[float, Estop | EstopRelease]] = []
        self._calls = 0
        self._halted: str | None = None
        if logged:
            self.event(EventKind.BEGAN, None, 0.0)

    @classmethod
    def of(cls, plan: str) -> "Run":
        """Calls and events with their times and texts, as in `died/ann 5.0, halt 5.1 called by eve, resume 8.0`."""
        run = cls()
        for step in plan.split(", "):
            what, time, *text = step.split(" ", 2)
            name, _, process = what.partition("/")
            if name in ("begin", "tag", "halt", "resume", "game_over"):
                run.call(name, float(time), *text)
            else:
                run.event(EventKind(name), process or None, float(time), text="".join(text))
        return run

    def call(self, rule: str, time: float, text: str = "") -> "Run":
        """The referee's call, with the standing that follows from it."""
        self._calls += 1
        why = text
        causes = {"emergency stop": EMERGENCY_STOP, "called by": BY_OFFICIAL}
        cause = next((cause for words, cause in causes.items() if text.startswith(words)), "")
        if rule == "halt":
            self._halted = f"{self._halted}; {text}" if self._halted else text
            text = f"play is halted: {text}"
        elif rule in ("resume", "game_over"):
            self._halted = None
        call = Call(number=self._calls, rule=rule, text=text, players=(), poses=(), clock=time, why=why, cause=cause)
        standing = Checkpoint(
            stage=Stage.PLAY_ROUND, halted=self._halted, clock=time, total=time, in_stage=time, calls=self._calls,
            winner=None, game={},
        )  # fmt: skip
        self.records.append(Record(n=self._calls, time=time, stages=[], calls=[call], standing=standing))
        return self

    def event(
        self, what: EventKind, process: str | None, time: float | None, *, heard: dict[str, float] | None = None,
        text: str = "",
    ) -> "Run":  # fmt: skip
        """A line of the log. `heard`: the match time of the newest message of each sender."""
        at = 1000.0 + (time or 0.0)
        event = Event(what=what, process=process, monotonic=at, time=time, text=text, newest=heard or {})
        self.events.append(event)
        return self

    def end(self) -> "Run":
        return self.event(EventKind.ENDED, None, 100.0)

    def incidents(self, *, players: Sequence[str] = PLAYERS, **more: object) -> list[Incident]:
        return incidents_of(RunData(self.records, self.events, self.estops, players, **more))  # type: ignore[arg-type]


HALT, ESTOP, DEATH = IncidentKind.HALT, IncidentKind.ESTOP, IncidentKind.DEATH
BY_EVE = "estop 5.0, halt 5.1 emergency stop by eve"


@pytest.mark.parametrize(
    ("plan", "found"),
    [
        ("begin 1.0, ready/ann 0.5, tag 5.0, game_over 9.0", []),
        ("halt 5.0 called by eve, halt 6.0 ann fails, resume 8.0", [(HALT, 5.0, 8.0)]),
        ("halt 5.0 x", [(HALT, 5.0, math.inf)]),
        ("halt 5.0 x, game_over 7.0", [(HALT, 5.0, 7.0)]),
        ("halt 5.0 x, resume 6.0, halt 7.0 y, resume 8.0", [(HALT, 5.0, 6.0), (HALT, 7.0, 8.0)]),
        ("halt 5.0 called by eve, estop 5.95, halt 6.0 emergency stop by eve, release 7.0, resume 8.0",
         [(HALT, 5.0, 8.0), (ESTOP, 5.95, 8.0)]),
        ("died/referee 5.0, estop 5.1, ready/referee 8.0, halt 8.1 emergency stop, release 9.0, resume 10.0",
         [(DEATH, 5.0, 10.0), (ESTOP, 5.1, 10.0)]),
        (f"{BY_EVE}, release 6.0, halt 7.5 emergency stop by dan, halt 7.6 emergency stop by ann, resume 9.0",
         [(ESTOP, 5.0, 9.0)]),
        (f"{BY_EVE}, release 6.0, resume 7.0, halt 9.0 emergency stop by dan, resume 10.0",
         [(ESTOP, 5.0, 7.0), (ESTOP, 9.0, 10.0)]),
        (f"{BY_EVE}, resume 7.0, estop 8.0, halt 8.1 emergency stop by eve, resume 9.0",
         [(ESTOP, 5.0, 7.0), (ESTOP, 8.0, 9.0)]),
        ("died/ann 5.0, started/ann 5.0, ready/ann 5.5, died/ann 7.0, vacated/ann 7.0",
         [(DEATH, 5.0, 5.5), (DEATH, 7.0, math.inf)]),
        ("replaced/ann 5.0, ready/ann 6.0, closed/spectator 7.0", []),
    ],
    ids=["nothing", "a halt from its decision to the resume", "one that nobody ended", "one that the game ended", "two",
         "an emergency stop in a halt", "the referee is started again meanwhile", "called again before play goes on",
         "its order was not heard", "no release was heard", "two deaths, with a disqualification", "nobody has died"],
)  # fmt: skip
def test_of_a_match_are_found(plan: str, found: list[tuple[IncidentKind, float, float]]) -> None:
    assert [(i.kind, i.time, i.until) for i in Run.of(plan).end().incidents()] == found


def test_where_nothing_was_logged_or_called_there_is_no_incident() -> None:
    assert Run(logged=False).incidents() == []


def test_a_halt_stops_all_robots_and_tells_why() -> None:
    [halt] = Run.of("halt 5.0 called by eve, resume 8.0").end().incidents()
    assert halt.robots is None
    assert "called by eve" in halt.what


def test_an_emergency_stop_begins_with_its_order_and_its_halt_is_a_part_of_it() -> None:
    run = Run().event(EventKind.ESTOP, None, 4.93, text="by eve: a dog", heard={"ann": 4.9, "bob": 4.8})
    run.call("halt", 5.0, "emergency stop by eve: a dog").event(EventKind.ESTOP, None, 5.5, text="by eve")
    run.event(EventKind.RELEASE, None, 6.0).call("resume", 8.0).end()
    [estop] = run.incidents()
    assert (estop.kind, estop.time, estop.until, estop.robots) == (IncidentKind.ESTOP, 4.93, 8.0, None)
    assert estop.resolution == pytest.approx(0.02)


@pytest.mark.parametrize("rate", [1.0, 50.0])
def test_a_halt_that_the_referee_calls_late_belongs_to_the_emergency_stop(rate: float) -> None:
    late = 0.03 * rate
    run = Run().event(EventKind.ESTOP, None, 5.0).call("halt", 5.0 + late, "emergency stop by eve")
    run.event(EventKind.RELEASE, None, 500.0).call("resume", 600.0).end()
    [estop] = run.incidents(rate=rate)
    assert (estop.time, estop.until) == (5.0, 600.0)
    assert estop.resolution == pytest.approx(0.02), "the world knows the tick at which it has latched it"


@pytest.mark.parametrize("rate", [1.0, 50.0])
def test_a_halt_of_a_referee_that_is_behind_the_launcher_belongs_to_the_emergency_stop(rate: float) -> None:
    run = Run().call("halt", 3.0, "emergency stop by dan").call("resume", 4.0)
    run.call("halt", 15.0 - 0.03 * rate, "emergency stop by eve").event(EventKind.ESTOP, None, 15.0)
    run.call("resume", 60.0).end()
    assert [(i.time, i.until) for i in run.incidents(rate=rate)] == [(3.0, 4.0), (15.0, 60.0)]


def test_without_a_log_the_recording_tells_of_emergency_stops_and_without_it_the_journal() -> None:
    run = Run(logged=False).call("halt", 5.0, "emergency stop by eve: a dog").call("resume", 8.0)
    [journal] = run.incidents()
    assert (journal.kind, journal.time, journal.until, journal.resolution) == (IncidentKind.ESTOP, 5.0, 8.0, 0.1)
    run.estops = [(4.94, Estop(by="eve", reason="a dog"))]
    [recorded] = run.incidents()
    assert (recorded.kind, recorded.time, recorded.until) == (IncidentKind.ESTOP, 4.94, 8.0)
    assert recorded.what == journal.what


def test_a_players_death_begins_with_its_newest_message_and_ends_when_the_next_one_is_ready() -> None:
    run = Run().event(EventKind.DIED, "ann", 5.0, heard={"ann": 4.9, "bob": 4.95}, text="was killed by signal 9")
    run.event(EventKind.STARTED, "ann", 5.0).event(EventKind.READY, "ann", 5.6).end()
    [death] = run.incidents()
    assert (death.kind, death.process, death.time, death.until) == (IncidentKind.DEATH, "ann", 4.9, 5.6)
    assert death.soonest == 5.0, "the next process may move the robot before the launcher knows that it is ready"
    assert death.robots == frozenset(["ann"])
    assert death.what == "ann was killed by signal 9"


def test_a_process_that_hangs_is_killed_and_found_dead_and_has_died_once() -> None:
    run = Run().event(EventKind.KILLED, "ann", 7.6, heard={"ann": 4.9}, text="hangs").event(EventKind.DIED, "ann", 7.7)
    [death] = run.event(EventKind.READY, "ann", 8.0).end().incidents()
    assert (death.time, death.what) == (4.9, "ann hangs: killed")


def test_a_world_that_died_begins_anew_where_match_time_goes_on() -> None:
    run = Run().event(EventKind.DIED, "world", 5.1, heard={"world": 5.1}).event(EventKind.STARTED, "world", 5.1)
    run.event(EventKind.STEPPED_BACK, "world", 5.0).call("halt", 5.1, "the world was restarted").call("resume", 9.0)
    death, halt = run.end().incidents()
    assert (death.process, death.time, death.until, death.robots) == ("world", 5.0, 9.0, None)
    assert halt.kind is IncidentKind.HALT


def test_a_referees_death_ends_with_a_resume_and_the_halt_of_its_successor_is_no_call() -> None:
    run = Run().call("begin", 1.0).event(EventKind.DIED, "referee", 5.04, heard={"referee": 5.0, "world": 5.04})
    run.event(EventKind.READY, "referee", 6.0).call("resume", 9.0).end()
    [death] = run.incidents()
    assert (death.time, death.until, death.robots) == (5.0, 9.0, None)


def test_a_routers_death_ends_when_time_is_heard_again_or_with_the_resume_of_a_halt_that_follows() -> None:
    def cut() -> Run:
        run = Run().event(EventKind.DIED, "router", 5.0, heard={"world": 4.98})
        return run.event(EventKind.STARTED, "router", 5.0).event(EventKind.READY, "router", 6.0)

    [death] = cut().end().incidents()
    assert (death.time, death.until, death.robots) == (4.98, 6.0, None)
    assert death.soonest == 4.98, "robots may be connected again before the launcher is"
    death, _ = cut().call("halt", 6.1, "the world's clock has stopped").call("resume", 9.0).end().incidents()
    assert death.until == 9.0
    for why in ("called by eve", "emergency stop by eve"):
        death = cut().call("halt", 7.0, why).call("resume", 9.0).end().incidents()[0]
        assert death.until == 6.0, "play had gone on before somebody stopped it"


def test_who_watches_stops_no_robot_and_emulated_drives_stop_the_physical_ones() -> None:
    run = Run().event(EventKind.DIED, "recorder", 5.0).event(EventKind.DIED, "drives", 6.0).end()
    recorder, drives = run.incidents(companions=["drives"], physical=["bob"])
    assert (recorder.robots, drives.robots) == (frozenset(), frozenset(["bob"]))


def test_a_launcher_that_did_not_end_by_itself_was_killed_at_some_time() -> None:
    run = Run().event(EventKind.READY, "ann", 1.0)
    [death] = run.incidents(end=60.0)
    assert (death.process, death.time, death.robots) == (LAUNCHER_NAME, 60.0, None)
    assert death.resolution == 59.0


def test_a_machine_that_is_away_stops_its_own_robots_from_the_newest_message_of_its_players() -> None:
    heard = {"ann": 9.7, "bob": 4.9, "carol": 4.95, "world": 9.8}
    run = Run().event(EventKind.AWAY, "lab2", 8.0, heard=heard, text="lab2 does not answer (bob, carol)")
    run.call("halt", 8.1, "called by vrg play").event(EventKind.BACK, "lab2", 12.0).call("resume", 15.0).end()
    away, halt = run.incidents(place={"bob": "lab2", "carol": "lab2", "dan": "lab3"}, players=["ann", "bob", "carol"])
    assert (away.kind, away.what, away.process) == (IncidentKind.AWAY, "lab2 does not answer (bob, carol)", "lab2")
    assert (away.time, away.until, away.robots) == (4.95, 15.0, frozenset(["bob", "carol"]))
    assert halt.kind is IncidentKind.HALT
    assert not away.timeless


def test_a_machine_that_comes_back_while_play_goes_on_holds_its_robots_up_to_then() -> None:
    run = Run().event(EventKind.AWAY, "lab2", 8.0, heard={"bob": 4.9}).event(EventKind.BACK, "lab2", 12.0).end()
    [away] = run.incidents(place={"bob": "lab2"})
    assert away.until == 12.0
    assert Run().event(EventKind.AWAY, "lab2", 8.0).end().incidents()[0].until == math.inf


def test_the_loss_of_the_machine_of_the_world_stops_all_robots_and_match_time() -> None:
    run = Run().event(EventKind.AWAY, "lab2", 8.0, heard={"world": 7.9, "bob": 7.8})
    [away] = run.event(EventKind.STEPPED_BACK, "world", 7.5).end().incidents(place={"world": "lab2", "bob": "lab2"})
    assert (away.time, away.robots, away.timeless) == (7.5, None, True)
