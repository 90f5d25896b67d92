"""The stop certificate of a run: for each HALT, emergency stop and death of a process, how each robot stopped."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from vrg.bus.messages import at_rest
from vrg.config.setup import MatchSetup
from vrg.coordinator.journal import Record, read_journal
from vrg.errors import JournalError, MessageError
from vrg.recording.stops import (
    REST_TIME,
    Incident,
    IncidentKind,
    RobotStop,
    StopOutcome,
    Trajectory,
    rests_of,
    stop_of,
    stops_of,
    worst,
)
from vrg.runs.events import WORLD, Event, EventKind, read_events
from vrg.runs.incidents import LAUNCHER_NAME, RunData, incidents_of
from vrg.runs.run_folder import RunFolder
from vrg.types import Twist

ROUGH = 0.25
"""The time in s above which the line about the worst stop tells how exact it is, as of a death noticed late."""
JUST_BEFORE = 0.001
"""The match time in s by which an instant is put back so that it is before what happens at it."""


@dataclass(frozen=True)
class Certificate:
    """How each robot stopped at each HALT, emergency stop and death of a process.

    Args:
        incidents: what happened, in the order of match time. stops: how each robot stopped; see `RobotStop`.
        rate: match seconds per real second that the match was played at; None where it was as fast as possible.
        notes: what is not known, and why, in sentences.
    """

    incidents: Sequence[Incident]
    stops: Sequence[RobotStop]
    rate: float | None
    notes: Sequence[str] = ()

    @property
    def worst(self) -> RobotStop | None:
        """The stop that took the longest; None if no robot had to stop."""
        return worst(self.stops)

    @property
    def resolution(self) -> float:
        """The largest resolution of a stop, s; 0 if no robot had to stop. The launcher's own death does not count."""
        known = [stop for stop in self.stops if self.incidents[stop.incident].process != LAUNCHER_NAME]
        return max((stop.resolution for stop in known if stop.moved), default=0.0)


def certificate_of(setup: MatchSetup, folder: RunFolder) -> Certificate:
    """Read what a run has left, and find out how the robots stopped. This raises nothing for what is missing."""
    notes: list[str] = []
    records, events = _records(folder, notes), _events(folder, notes)
    if any(call.rule == "halt" and not call.why for record in records for call in record.calls):
        notes.append("An earlier VRG wrote the journal, without the causes of HALTs: emergency stops count as HALTs.")
    motions, estops = _recording(folder, notes)
    end = max((motion.times[-1] for motion in motions if motion.times), default=math.inf)
    evidence = RunData(
        records,
        events,
        estops,
        [player.name for player in setup.players],
        setup.physical,
        [companion.name for companion in setup.companions],
        setup.place,
        end,
        setup.world.tick,
        setup.rate,
    )
    incidents = incidents_of(evidence)
    known = motions or [Trajectory(player.name, player.physical) for player in setup.players]
    stops = [_in_real_time(stop, incidents[stop.incident], events, known) for stop in stops_of(incidents, known)]
    if any(incident.process == LAUNCHER_NAME for incident in incidents):
        last = f"its last event, at {events[-1].time or 0.0:.2f} s,"
        notes.append(
            f"vrg play did not end by itself, and it is not known when it ended. What happened after {last} is known "
            "from the recording."
        )
    return Certificate(incidents, stops, setup.rate or None, notes)


def _records(folder: RunFolder, notes: list[str]) -> list[Record]:
    try:
        return read_journal(folder.journal)[1]
    except JournalError as error:
        notes.append(f"Without the journal no HALT is known: {error}.")
        return []


def _events(folder: RunFolder, notes: list[str]) -> list[Event]:
    try:
        return read_events(folder.events)
    except FileNotFoundError:
        notes.append(
            f"There is no {folder.events.name}, because the match was played in steps, by hand or by an older release: "
            "deaths of processes are not known."
        )
    except OSError as error:
        notes.append(f"{folder.events} cannot be read ({error.strerror}): deaths of processes are not known.")
    return []


def _recording(folder: RunFolder, notes: list[str]) -> tuple[list[Trajectory], list[Any]]:
    parts = folder.recordings()
    if not parts:
        notes.append("There is no recording, so it is not known how the robots stopped: was --no-record given?")
        return [], []
    from vrg.recording.reader import motions_of  # noqa: PLC0415 - numpy takes time to load
    from vrg.recording.recorded import read_recorded  # noqa: PLC0415 - as above

    try:
        recorded = read_recorded(parts)
    except (OSError, MessageError) as error:
        notes.append(f"The recording cannot be read: {error}.")
        return [], []
    motions = list(motions_of(recorded).values())
    if not motions:
        notes.append("The recording holds no pose of a robot: it ended before the match began.")
    if len(parts) > 1:
        notes.append(f"The recorder was started again: the recording has {len(parts)} parts with gaps between them.")
    return motions, recorded.estops


def _in_real_time(
    stop: RobotStop, incident: Incident, events: Sequence[Event], motions: Sequence[Trajectory]
) -> RobotStop:
    """A physical robot rolls on in real time while match time stands: its stop as the launcher has heard it."""
    motion = next(motion for motion in motions if motion.name == stop.robot)
    if not incident.timeless or not motion.physical or not motion.times:
        return stop
    number = next((i for i, e in enumerate(events) if e.process == incident.process and e.what in _ENDS_AT
                   and _near(e, incident)), None)  # fmt: skip
    if number is None:
        return stop
    # The incident lies before the last clock if the next world goes on from a snapshot before it. With physical robots
    # match time is as fast as real time.
    event = events[number]
    began = (event.clock or event.monotonic) - max(0.0, event.newest.get(WORLD, event.time or 0.0) - incident.time)
    samples = [
        (e.monotonic - began, e.x, e.y, Twist(e.v, e.w, e.side))
        for e in events
        if e.what is EventKind.MEASURED and e.process == stop.robot and e.monotonic >= began and _near(e, incident)
    ]
    if not samples:
        return stop
    start = motion.place(min(incident.time, motion.times[-1]))
    times = [0.0, *(t for t, *_ in samples)]
    # The next world begins at the incident with every robot at rest: how this one moved is known from just before.
    before = incident.time - JUST_BEFORE
    rested = motion.rests_at(before)
    rests = rests_of(times, [rested, *(at_rest(twist) for *_, twist in samples)])
    if rested:
        rests[0] = replace(rests[0], begin=-REST_TIME)  # it stood already
    if rests and rests[-1].end == math.inf and times[-1] - rests[-1].begin < REST_TIME:
        rests.pop()  # it is not known whether it stood for more than a moment
    measured = Trajectory(
        stop.robot,
        True,
        times,
        [start[0], *(x for _, x, _, _ in samples)],
        [start[1], *(y for _, _, y, _ in samples)],
        [motion.speed(before), *(twist.speed for *_, twist in samples)],
        rests,
    )
    then = replace(incident, time=0.0, until=math.inf, soonest=incident.soonest - incident.time)
    return replace(stop_of(stop.incident, then, measured), real=True)


_ENDS_AT = (EventKind.KILLED, EventKind.DIED, EventKind.AWAY)


def _near(event: Event, incident: Incident) -> bool:
    """True if an event belongs to the standstill of match time that an incident has caused."""
    return event.time is not None and 0.0 <= event.time - incident.time <= 0.5


def summary_line(certificate: Certificate) -> str:
    """The robots that were not seen to stand, and the worst stop, in a line; empty if nothing happened in the run."""
    if not certificate.incidents:
        return ""
    cut = list(dict.fromkeys(stop.robot for stop in certificate.stops if stop.outcome is StopOutcome.CUT))
    unseen = f"not seen to stand before the recording ended: {', '.join(cut)}; " if cut else ""
    return unseen + _worst(certificate)


def _worst(certificate: Certificate) -> str:
    """The worst stop, in words."""
    stop = certificate.worst
    if stop is None:
        unknown = any(stop.outcome is StopOutcome.UNKNOWN for stop in certificate.stops)
        return "no stop is known: the robots were not recorded" if unknown else "no robot moved when it had to stop"
    after = _after(certificate.incidents[stop.incident], stop.robot)
    clock = " of real time" if stop.real else ""
    least = "at least " if stop.gap else ""
    if stop.again is not None:
        how = f"moved again {stop.again:.2f} s{clock} after {after}"
        return f"worst stop: {stop.robot} {how}: {least}{stop.distance:.2f} m in {stop.seconds:.2f} s"
    if stop.outcome is StopOutcome.STOPPED:
        rough = f" (± {stop.resolution:.2f} s)" if stop.resolution > ROUGH else ""
        return (
            f"worst stop: {stop.robot} {stop.seconds:.2f} s{clock}{rough}, {least}{stop.distance:.2f} m after {after}"
        )
    how = (
        "did not stand before play went on" if stop.outcome is StopOutcome.PLAYED_ON else "moved to the recording's end"
    )
    return f"worst stop: {stop.robot} {how}, {stop.seconds:.2f} s{clock}, {least}{stop.distance:.2f} m after {after}"


def _after(incident: Incident, robot: str) -> str:
    if incident.kind is IncidentKind.HALT:
        return "a HALT"
    if incident.kind is IncidentKind.ESTOP:
        return "the emergency stop"
    if incident.kind is IncidentKind.AWAY:
        return f"{incident.process} was lost"
    if incident.process == robot:
        return "its player died"
    return f"{incident.process if incident.process == LAUNCHER_NAME else f'the {incident.process}'} died"


def data_of(certificate: Certificate) -> dict[str, Any]:
    """The certificate as plain data, for result.json. Times in s of match time, lengths in m."""
    stop = certificate.worst
    return {
        "incidents": [
            {
                "kind": str(incident.kind),
                "what": incident.what,
                "time": round(incident.time, 3),
                "went_on": round(incident.until, 3) if math.isfinite(incident.until) else None,
                "process": incident.process,
                "robots": {stop.robot: _stop_data(stop) for stop in certificate.stops if stop.incident == number},
            }
            for number, incident in enumerate(certificate.incidents)
        ],
        "worst": None if stop is None else {"robot": stop.robot, "incident": stop.incident, **_stop_data(stop)},
        "sentence": summary_line(certificate),
        "resolution": round(certificate.resolution, 3),
        "rate": certificate.rate,
        "notes": list(certificate.notes),
    }


def _stop_data(stop: RobotStop) -> dict[str, Any]:
    return {
        "outcome": str(stop.outcome),
        "seconds": round(stop.seconds, 3),
        "distance": round(stop.distance, 4),
        "speed": round(stop.speed, 3),
        "resolution": round(stop.resolution, 3),
        "gap": round(stop.gap, 3),
        "again": None if stop.again is None else round(stop.again, 3),
        "clock": "real" if stop.real else "match",
    }
