"""The incidents of a match after which robots must stop, from its journal and its log of events. It reads no files.

The journal records each HALT and each emergency stop. A HALT begins with the referee's decision, an emergency stop
with its order if that was heard, and the death of a process or the loss of a machine with the newest message that came
from it: it is not known how much later it died.
"""

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from vrg.bus.messages import EMERGENCY_STOP, Estop, EstopRelease
from vrg.coordinator.coordinator import PERIOD
from vrg.coordinator.journal import Record
from vrg.recording.stops import Incident, IncidentKind
from vrg.runs.events import REFEREE, WORLD, Event, EventKind

LAUNCHER_NAME = "vrg play"
"""The name of the launcher in an incident."""
ROUTER = "router"
SETTLES = 3.0
"""The real time in s after a router's return in which the referee may still halt play because of its absence."""
ESTOP_HALT_DELAY = 1.0
"""The real time in s after the release of an emergency stop in which the referee may still halt play because of it."""
MAX_REFEREE_LAG = 0.2
"""The real time in s by which the referee may be behind the launcher: its HALT then seems to come before the order."""
_TIME = (WORLD, ROUTER)
"""The processes without which match time stands for all others."""
_ENDS = (EventKind.KILLED, EventKind.DIED, EventKind.VACATED)
_GOES_ON = ("resume", "ended", "game_over")
"""The rules of the calls after which a HALT is over."""


@dataclass(frozen=True)
class RunData:
    """The data of a run.

    Args:
        records: the journal. events: the log of events; empty where there is none.
        estops: the orders of the emergency stop in the recording, with their match times, s.
        players: the names of the players. physical: those with physical robots.
        companions: the programs that drive physical robots.
        place: the machine of each process that does not run where the match was launched, by the process' name.
        end: the match time at which the recording ends, s. tick: the time between two ticks of the world, s.
        rate: match seconds per real second; 0 where the match was played as fast as possible.
    """

    records: Sequence[Record]
    events: Sequence[Event]
    estops: Sequence[tuple[float, Estop | EstopRelease]]
    players: Sequence[str]
    physical: Sequence[str] = ()
    companions: Sequence[str] = ()
    place: Mapping[str, str] = field(default_factory=dict)
    end: float = math.inf
    tick: float = 0.02
    rate: float = 1.0

    def match_time(self, real: float) -> float:
        """The match time that passes in a real time, both in s. Without a rate it is in lockstep, without delays."""
        return real * (self.rate or 1.0)


def incidents_of(of: RunData) -> list[Incident]:
    """Every HALT, emergency stop and death of a process, in the order of match time."""
    found = [*_halts(of), *_deaths(of), *_machines(of), *_launcher(of)]
    return sorted(found, key=lambda incident: (incident.time, incident.kind, incident.what))


def goes_on(records: Iterable[Record], after: float) -> float:
    """The match time, s, at which play goes on or the match ends, after a HALT; infinite if it never does."""
    return next((r.time for r in records if r.time >= after and any(c.rule in _GOES_ON for c in r.calls)), math.inf)


def _halts(of: RunData) -> Iterator[Incident]:
    """The HALTs that stopped play, and the emergency stops, each once however often it is called until play goes on."""
    halted: str | None = None
    stopped_until = -math.inf
    for record in of.records:
        calls = [call for call in record.calls if call.rule == "halt"]
        estops = [call for call in calls if call.cause == EMERGENCY_STOP]
        if estops and record.time >= stopped_until:
            stopped_until = goes_on(of.records, record.time)
            yield _estop(of, record.time, stopped_until, estops[0].why)
        elif halted is None and record.standing.halted is not None and calls and not estops:
            yield Incident(IncidentKind.HALT, calls[0].text, record.time, goes_on(of.records, record.time))
        halted = record.standing.halted


def _estop(of: RunData, called: float, until: float, what: str) -> Incident:
    """An emergency stop because of which the referee has called a HALT; it begins with its order if that was heard."""
    logged = any(event.what is EventKind.BEGAN for event in of.events)
    orders = [
        (e.time or 0.0, e.what is EventKind.ESTOP) for e in of.events if e.what in (EventKind.ESTOP, EventKind.RELEASE)
    ]
    orders = orders if logged else [(time, isinstance(order, Estop)) for time, order in of.estops]
    behind, late = max(of.tick, of.match_time(MAX_REFEREE_LAG)), of.match_time(ESTOP_HALT_DELAY)
    engaged = max((time for time, engages in orders if engages and time <= called + behind), default=None)
    released = any(engaged is not None and engaged < time < called - late for time, engages in orders if not engages)
    if engaged is None or released or goes_on(of.records, engaged) != until:
        return Incident(IncidentKind.ESTOP, what, called, until, resolution=PERIOD)
    return Incident(IncidentKind.ESTOP, what, engaged, until, resolution=of.tick if logged else PERIOD)


def _deaths(of: RunData) -> Iterator[Incident]:
    """The deaths of processes. One that is killed because it hangs, and then found dead, has died once."""
    gone: set[str] = set()
    for number, event in enumerate(of.events):
        name = event.process or ""
        if event.what in (EventKind.STARTED, EventKind.READY, EventKind.REPLACED):
            gone.discard(name)
        if event.what not in _ENDS or name in gone:
            continue
        gone.add(name)
        time = _onset(of, number, event, [name])
        yield Incident(
            IncidentKind.DEATH,
            f"{name} {_how(event)}",
            time,
            _until(of, number, event, time),
            _soonest(of, number, event, time),
            name,
            timeless=name in _TIME,
            robots=_robots(of, [name]),
        )


def _machines(of: RunData) -> Iterator[Incident]:
    """The losses of machines: of the agent that supervises the processes there, or of the link to it."""
    for number, event in enumerate(of.events):
        if event.what is not EventKind.AWAY:
            continue
        names = [name for name, machine in of.place.items() if machine == event.process]
        time = _onset(of, number, event, names)
        back = next((e for e in of.events[number:] if (e.what, e.process) == (EventKind.BACK, event.process)), None)
        # Its robots may move again when play goes on, or when the machine is back in play that was not halted.
        until = goes_on(of.records, time)
        if back is not None and back.time is not None and not _halted(of.records, back.time):
            until = min(until, back.time)
        yield Incident(
            IncidentKind.AWAY,
            event.text,
            time,
            until,
            process=event.process,
            timeless=any(name in _TIME for name in names),
            robots=_robots(of, names),
        )


def _halted(records: Iterable[Record], at: float) -> bool:
    """True if play is halted at a match time, s."""
    before = list(itertools.takewhile(lambda record: record.time <= at, records))
    return bool(before) and before[-1].standing.halted is not None


def _how(event: Event) -> str:
    return f"{event.text}: killed" if event.what is EventKind.KILLED else event.text


def _onset(of: RunData, number: int, event: Event, names: Sequence[str]) -> float:
    """The stamp of the newest message of processes that are gone, s; the time at which it was noticed if none came."""
    noticed = event.time or 0.0
    senders = {WORLD if name in _TIME else name for name in names} & set(event.newest)
    time = min(noticed, max((event.newest[sender] for sender in senders), default=noticed))
    if WORLD not in names:
        return time
    # What the world has published after its last snapshot did not happen: it continues from there.
    later = of.events[number:]
    back = next((e.time for e in later if e.what is EventKind.STEPPED_BACK and e.time is not None), time)
    return min(time, back)


def _until(of: RunData, number: int, event: Event, time: float) -> float:
    """The match time, s, at which robots may move again after a death; infinite if that is not known."""
    name = event.process or ""
    ready = next(
        (e.time for e in of.events[number:] if e.process == name and e.what is EventKind.READY and e.time is not None),
        math.inf,
    )
    if name in (REFEREE, WORLD):
        return goes_on(of.records, time)
    if name == ROUTER:
        latest = ready + of.match_time(SETTLES)
        halts = [at for at, cause in _causes(of.records) if time <= at <= latest and not cause]
        return goes_on(of.records, halts[0]) if halts else ready
    if name in of.companions:
        return goes_on(of.records, time)
    return ready


def _causes(records: Iterable[Record]) -> Iterator[tuple[float, str]]:
    """The match time of each record while play is halted, s, and the cause of the first halt since play went on."""
    cause: str | None = None
    for record in records:
        if record.standing.halted is None:
            cause = None
        else:
            if cause is None:
                cause = next((call.cause for call in record.calls if call.rule == "halt"), "")
            yield record.time, cause


def _soonest(of: RunData, number: int, event: Event, time: float) -> float:
    """The match time, s, from which a new process may move robots; infinite where a call of the referee tells it."""
    name = event.process or ""
    if name == ROUTER:
        return time  # a robot may be connected again before the launcher is
    if name not in of.players:
        return math.inf
    starts = [e for e in of.events[number:] if e.process == name and e.what in (EventKind.STARTED, EventKind.REPLACED)]
    return next((start.time for start in starts if start.time is not None), math.inf)


def _robots(of: RunData, names: Sequence[str]) -> frozenset[str] | None:
    """The robots that must stop without some processes; None for all."""
    if any(name in (REFEREE, *_TIME) for name in names):
        return None
    driven = of.physical if any(name in of.companions for name in names) else ()
    return frozenset([*driven, *(name for name in names if name in of.players)])


def _launcher(of: RunData) -> Iterator[Incident]:
    """The death of the launcher, which could not be logged: its log lacks the last line."""
    if of.events and of.events[-1].what is not EventKind.ENDED:
        last = of.events[-1].time or 0.0
        end = of.end if math.isfinite(of.end) else last
        what = f"{LAUNCHER_NAME} was killed some time after {last:.2f} s, and all processes then ended by themselves"
        yield Incident(IncidentKind.DEATH, what, end, process=LAUNCHER_NAME, resolution=max(0.0, end - last))
