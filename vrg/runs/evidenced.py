"""A match as its evidence has it, in place of a recording: where the referee saw everybody, and what was decided."""

import math
from typing import TypeVar

from vrg.bus import messages as m
from vrg.config.setup import MatchSetup
from vrg.coordinator.evidence import read_evidence, replayed
from vrg.coordinator.journal import read_journal
from vrg.coordinator.rulebook import Observation
from vrg.recording.recorded import RecordedMatch, Timed
from vrg.runs.change import books_of
from vrg.runs.run_folder import RunFolder
from vrg.types import Twist

T = TypeVar("T")


def read_evidenced(folder: RunFolder, setup: MatchSetup) -> RecordedMatch:
    """The poses, the states and the calls of a match, as far as the evidence reaches.

    A speed is the mean one between two looks.

    Raises:
        JournalError: the journal or the evidence cannot be read.
    """
    book, later = books_of(setup, folder)
    found, before = RecordedMatch(), Observation({})
    for exhibit, _, match, _, _ in replayed(book, read_evidence(folder.evidence), later):
        tick = exhibit.tick
        # A world that was started again steps back: what was beyond did not happen; decisions count from then.
        while found.poses and found.poses[-1][0] >= tick.time:
            found.poses.pop()
        found.states[:] = _not_beyond(found.states, tick.time)
        found.poses.append(
            (tick.time, m.Poses(bodies=_bodies(before, tick.field), things=tuple(tick.field.things.values())))
        )
        found.states.append((tick.time, match.state(tick.field, estop=False)))
        before = tick.field
    for record in read_journal(folder.journal)[1]:
        found.calls[:] = _not_beyond(found.calls, record.time)
        found.calls.extend((record.time, call) for call in record.calls)
    return found


def _not_beyond(entries: Timed[T], time: float) -> Timed[T]:
    return entries if not entries or entries[-1][0] <= time else [(min(stamp, time), entry) for stamp, entry in entries]


def _bodies(before: Observation, now: Observation) -> tuple[m.Body, ...]:
    seconds = now.time - before.time
    return tuple(
        m.Body(
            name=name, pose=pose, twist=Twist(_way(before, now, name) / seconds if seconds > 0.0 else 0.0, 0.0),
            physical=name in now.physical, uncertainty=now.uncertainty.get(name),
        )
        for name, pose in now.poses.items()
    )  # fmt: skip


def _way(before: Observation, now: Observation, name: str) -> float:
    old, new = before.poses.get(name), now.poses[name]
    return 0.0 if old is None else math.dist((old.x, old.y), (new.x, new.y))
