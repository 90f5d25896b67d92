"""What happened in a match after which robots must stop, from its journal and its log of events. It reads no files.

A HALT begins with the referee's decision, an emergency stop with its order, and the death of a process or the loss of
a machine with the newest message that came from it: nobody knows how much later it died.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from vrg.coordinator.coordinator import PERIOD
from vrg.coordinator.journal import Record
from vrg.launch.events import Event, Link, What
from vrg.launch.listening import REFEREE, WORLD
from vrg.recording.records import EstopRecord
from vrg.recording.stops import Incident, Kind

LAUNCHER = "vrg play"
"""The name of the launcher in an incident."""
ROUTER = "router"
SETTLES = 3.0
"""The real time in s after a router's return in which the referee may still halt play because of its absence."""
LATE = 1.0
"""The real time in s after the release of an emergency stop in which the referee may still halt play because of it."""
BEHIND = 0.2
"""The real time in s by which the referee may be behind the launcher: its HALT then seems to come before the order."""
_TIME = (WORLD, ROUTER)
"""The processes without which match time stands for all others."""
_ENDS = (What.KILLED, What.DIED, What.VACATED)
_GOES_ON = ("resume", "ended", "game_over")
"""The rules of the calls after which a HALT is over."""
_ESTOP = "emergency stop"
"""How the reason of a HALT begins that the referee has called because of the emergency stop."""
_BY_SOMEBODY = ("called by", _ESTOP)
"""How the reasons of those HALTs begin that somebody asked for."""

_Told = tuple[Incident, Event | None]
"""An incident, and the event that tells of it, if one does."""


@dataclass(frozen=True)
class Evidence:
    """What is known of a run.

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
    estops: Sequence[tuple[float, EstopRecord]]
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


def incidents_of(of: Evidence) -> list[Incident]:
    """Every HALT, emergency stop and death of a process, in the order of match time."""
    estops = [*_ordered(of), *_lost_orders(of)]
    found = [*_halts(of), *estops, *_deaths(of), *_machines(of), *_launcher(of)]
    return sorted(_with_losses(found, of.events), key=lambda incident: (incident.time, incident.kind, incident.what))


def goes_on(records: Iterable[Record], after: float) -> float:
    """The match time, s, at which play goes on or the match ends, after a HALT; infinite if it never does."""
    return next((r.time for r in records if r.time >= after and any(c.rule in _GOES_ON for c in r.calls)), math.inf)


def ages_of(links: dict[str, Link]) -> dict[str, float]:
    """The age of the newest message of each link, s of real time."""
    return {name: link.age for name, link in links.items()}


def _is_estop(text: str) -> bool:
    return text.removeprefix("play is halted: ").startswith(_ESTOP)


def _halts(of: Evidence) -> list[_Told]:
    """The HALTs that stopped play, but for those that belong to an emergency stop."""
    found: list[_Told] = []
    heard = {event.number: event for event in of.events if event.what is What.HALT}
    before: str | None = None
    for record in of.records:
        calls = [call for call in record.calls if call.rule == "halt"]
        if before is None and record.standing.halted is not None and calls and not _is_estop(calls[0].text):
            event = heard.get(calls[0].number)
            until = goes_on(of.records, record.time)
            ages = ages_of(event.links) if event else {}
            found.append((Incident(Kind.HALT, calls[0].text, record.time, until, ages=ages), event))
        before = record.standing.halted
    return found


def _orders(of: Evidence) -> list[tuple[float, bool, str, Event | None, float]]:
    """(match time, engaged, by whom, the event, resolution) of each order of the emergency stop."""
    if any(event.what is What.BEGAN for event in of.events):
        return [
            (event.time or 0.0, event.what is What.ESTOP, event.text, event, max(of.tick, of.match_time(of.tick)))
            for event in of.events
            if event.what in (What.ESTOP, What.RELEASE)
        ]
    return [
        (time, order.engaged, f"by {order.by}{f': {order.reason}' if order.reason else ''}", None, PERIOD)
        for time, order in of.estops
    ]


def _ordered(of: Evidence) -> list[_Told]:
    """The emergency stops whose orders were heard. An order to engage one that is engaged changes nothing."""
    found: list[_Told] = []
    engaged = False
    for time, engages, by, event, resolution in _orders(of):
        # Play does not go on before a release: if it has gone on, a release was not heard.
        if engages and (not engaged or time >= found[-1][0].until):
            until = goes_on(of.records, time)
            ages = ages_of(event.links) if event else {}
            incident = Incident(Kind.ESTOP, f"{_ESTOP} {by}", time, until, resolution=resolution, ages=ages)
            found.append((incident, event))
        engaged = engages
    return found


def _engaged(of: Evidence) -> list[tuple[float, float, float]]:
    """(from, up to, until) of each emergency stop whose order was heard: match times, s.

    A HALT of the referee because of an emergency stop, called in that time and ended by the same call, belongs to it.
    """
    spans = []
    orders = _orders(of)
    for number, (time, engages, _, _, _) in enumerate(orders):
        if engages:
            released = next((later for later, engaged, _, _, _ in orders[number:] if not engaged), math.inf)
            begin = time - max(of.tick, of.match_time(BEHIND))
            spans.append((begin, released + of.match_time(LATE), goes_on(of.records, time)))
    return spans


def _lost_orders(of: Evidence) -> list[_Told]:
    """The emergency stops that only the journal tells of, each once, however often it is called until play goes on."""
    spans = _engaged(of)
    found: list[_Told] = []
    for record in of.records:
        until = goes_on(of.records, record.time)
        told = any(begin <= record.time <= end and until == over for begin, end, over in spans)
        told |= bool(found) and until == found[-1][0].until
        calls = [call for call in record.calls if call.rule == "halt" and _is_estop(call.text)]
        if calls and not told:
            what = calls[0].text.removeprefix("play is halted: ")
            found.append((Incident(Kind.ESTOP, what, record.time, until, resolution=PERIOD), None))
    return found


def _deaths(of: Evidence) -> list[_Told]:
    """The deaths of processes. One that is killed because it hangs, and then found dead, has died once."""
    found: list[_Told] = []
    gone: set[str] = set()
    for number, event in enumerate(of.events):
        name = event.process or ""
        if event.what in (What.STARTED, What.READY, What.REPLACED):
            gone.discard(name)
        if event.what not in _ENDS or name in gone:
            continue
        gone.add(name)
        time = _onset(of, number, event, [name])
        incident = Incident(
            Kind.DEATH,
            f"{name} {_how(event)}",
            time,
            _until(of, number, event, time),
            _soonest(of, number, event, time),
            name,
            timeless=name in _TIME,
            robots=_robots(of, [name]),
            ages=ages_of(event.links),
        )
        found.append((incident, event))
    return found


def _machines(of: Evidence) -> list[_Told]:
    """The losses of machines: of the agent that supervises the processes there, or of the link to it."""
    found: list[_Told] = []
    for number, event in enumerate(of.events):
        if event.what is not What.AWAY:
            continue
        names = [name for name, machine in of.place.items() if machine == event.process]
        time = _onset(of, number, event, names)
        back = next((e for e in of.events[number:] if (e.what, e.process) == (What.BACK, event.process)), None)
        # Its robots may move again when play goes on, or when the machine is back in play that was not halted.
        until = goes_on(of.records, time)
        if back is not None and back.time is not None and not _halted(of.records, back.time):
            until = min(until, back.time)
        incident = Incident(
            Kind.AWAY,
            event.text,
            time,
            until,
            process=event.process,
            timeless=any(name in _TIME for name in names),
            robots=_robots(of, names),
            ages=ages_of(event.links),
        )
        found.append((incident, event))
    return found


def _halted(records: Iterable[Record], at: float) -> bool:
    """Whether play is halted at a match time, s."""
    last = None
    for record in records:
        if record.time > at:
            break
        last = record
    return last is not None and last.standing.halted is not None


def _how(event: Event) -> str:
    return f"{event.text}: killed" if event.what is What.KILLED else event.text


def _onset(of: Evidence, number: int, event: Event, names: Sequence[str]) -> float:
    """The stamp of the newest message of processes that are gone, s; the time at which it was noticed if none came."""
    noticed = event.time or 0.0
    links = {WORLD if name in _TIME else name for name in names} & set(event.links)
    time = min(noticed, max((event.links[link].time for link in links), default=noticed))
    if WORLD not in names:
        return time
    # What the world has published after its last snapshot did not happen: it goes on from there.
    later = of.events[number:]
    back = next((e.time for e in later if e.what is What.STEPPED_BACK and e.time is not None), time)
    return min(time, back)


def _until(of: Evidence, number: int, event: Event, time: float) -> float:
    """The match time, s, at which robots may move again after a death; infinite if that is not known."""
    name = event.process or ""
    ready = next(
        (e.time for e in of.events[number:] if e.process == name and e.what is What.READY and e.time is not None),
        math.inf,
    )
    if name in (REFEREE, WORLD):
        return goes_on(of.records, time)
    if name == ROUTER:
        latest = ready + of.match_time(SETTLES)
        halted = [(r.time, r.standing.halted) for r in of.records if time <= r.time <= latest and r.standing.halted]
        halts = [at for at, why in halted if not why.startswith(_BY_SOMEBODY)]
        return goes_on(of.records, halts[0]) if halts else ready
    if name in of.companions:
        return goes_on(of.records, time)
    return ready


def _soonest(of: Evidence, number: int, event: Event, time: float) -> float:
    """The match time, s, from which a new process may move robots; infinite where a call of the referee tells it."""
    name = event.process or ""
    if name == ROUTER:
        return time  # a robot may be connected again before the launcher is
    if name not in of.players:
        return math.inf
    starts = [e for e in of.events[number:] if e.process == name and e.what in (What.STARTED, What.REPLACED)]
    return next((start.time for start in starts if start.time is not None), math.inf)


def _robots(of: Evidence, names: Sequence[str]) -> frozenset[str] | None:
    """The robots that must stop without some processes; None for all."""
    if any(name in (REFEREE, *_TIME) for name in names):
        return None
    driven = of.physical if any(name in of.companions for name in names) else ()
    return frozenset([*driven, *(name for name in names if name in of.players)])


def _launcher(of: Evidence) -> list[_Told]:
    """The death of the launcher, which nobody could log: its log lacks the last line."""
    if not of.events or of.events[-1].what is What.ENDED:
        return []
    last = of.events[-1].time or 0.0
    end = of.end if math.isfinite(of.end) else last
    what = f"{LAUNCHER} was killed: at some time after {last:.2f} s, all processes then ended by themselves"
    return [(Incident(Kind.DEATH, what, end, process=LAUNCHER, resolution=max(0.0, end - last)), None)]


def _with_losses(found: Sequence[_Told], events: Sequence[Event]) -> list[Incident]:
    """The incidents, each with what was lost up to the next one, or to the end of the log.

    That messages are missing is only known when the next one of their sender has come: after a router's death, for
    example, when the new one is there. So not the next event tells it, but the next incident does.
    """
    places = {id(event): place for place, event in enumerate(events)}
    told = sorted(
        (places[id(event)], number) for number, (_, event) in enumerate(found) if event is not None and event.links
    )
    counting: list[tuple[int, dict[str, Link]]] = []
    for place, number in told:
        incident, before = found[number][0], found[counting[-1][0]][0] if counting else None
        # A HALT that follows from a death, and ends with the same call, loses nothing of its own.
        follows = before is not None and before.robots is None and incident.until == before.until
        if not (follows and incident.kind not in (Kind.DEATH, Kind.AWAY)):
            counting.append((number, events[place].links))
    last = next((event.links for event in reversed(events) if event.links), {})
    ends = [*(links for _, links in counting[1:]), last]
    lost = {number: _lost(links, end) for (number, links), end in zip(counting, ends, strict=False)}
    return [replace(incident, lost=lost.get(number, "")) for number, (incident, _) in enumerate(found)]


def _lost(begin: dict[str, Link], end: dict[str, Link]) -> str:
    """How many messages were lost on each link between two events, in words."""
    lost = {name: link.lost - (begin[name].lost if name in begin else 0) for name, link in end.items()}
    return ", ".join(f"{count} of {name}" for name, count in lost.items() if count > 0)
