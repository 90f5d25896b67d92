"""What officials decide: halt, resume, end, overrule, recover robots, and tell where robots stand. Pure."""

import math
from collections.abc import Sequence
from dataclasses import replace

from vrg.bus.messages import Official, OfficialAction
from vrg.coordinator.match import NOBODY, Match
from vrg.coordinator.outcome import Outcome, announce
from vrg.coordinator.rulebook import Field
from vrg.errors import ConfigError
from vrg.types import Pose


def decide(match: Match, official: Official, now: Field, absent: Sequence[str]) -> Outcome:
    """Apply an official's decision; an impossible one is answered by a call that says why.

    Args:
        absent: why play cannot be resumed, for reasons outside the rules.
    """
    refusal = _refusal(match, official.action, absent)
    if refusal:
        return _refused(official, refusal)
    action, number = official.action, official.id
    why = f" ({official.reason})" if official.reason else ""
    who = f"{official.by}{why}"
    try:
        if action is OfficialAction.HALT:
            outcome = match.halt(f"called by {who}")
            text = outcome.calls[0].text if outcome else f"halted already: {match.halted}"
            return announce("halt", text, number)
        if action is OfficialAction.RESUME:
            match.resume()
            return announce("resume", f"resumed by {who}", number)
        if action is OfficialAction.END:
            stage = match.end(NOBODY)
            return Outcome(announce("ended", f"ended by {who}", number).calls, [stage])
        if action is OfficialAction.RECOVER:
            return _recover(match, official, who)
        if action is OfficialAction.PLACE:
            return _place(match, official, now, who)
        match.overrule(action, official.subject or "", official.value or "")
    except ConfigError as error:
        return _refused(official, str(error))
    return announce("overruled", f"{official.by}: {action} {official.subject} {official.value}{why}", number)


def _refused(official: Official, why: str) -> Outcome:
    return announce("refused", f"{official.by} asks for {official.action}: {why}", official.id)


def _refusal(match: Match, action: OfficialAction, absent: Sequence[str]) -> str | None:
    """Why an official cannot do this now."""
    if match.over:
        return "the game is over"
    if action is not OfficialAction.RESUME:
        return None
    if match.halted is None:
        return "play is not halted"
    return "; ".join(absent) or None


def _recover(match: Match, official: Official, who: str) -> Outcome:
    """Ask robots to clear the faults that they have latched. It ends no halt: what is wrong may come back."""
    subject = official.subject
    names = match.names if subject is None else [_player(match, subject)]
    asked = announce("recover", f"recover {subject or 'all robots'}: asked by {who}", official.id)
    return replace(asked, recover=names, by=official.by)


def _place(match: Match, official: Official, now: Field, who: str) -> Outcome:
    """Put a virtual robot somewhere, or tell a physical one where a person has put it.

    Raises:
        ConfigError: no such player, no such place.
    """
    name = _player(match, official.subject or "")
    pose = _pose(official.value) if official.value else match.mark(name, now)
    if pose is None:
        raise ConfigError([f"{name} has no mark now: say where it is, x and y in m and its heading in degrees"])
    at = f"({pose.x:.2f}, {pose.y:.2f}), {math.degrees(pose.theta):.0f} degrees"
    physical = name in now.physical
    verb = "stands" if physical else "is put"
    outcome = announce("place", f"{name} {verb} at {at}: by {who}", official.id)
    places = {name: pose}
    if physical:
        return replace(outcome, by=official.by, placed=places)
    return replace(outcome, by=official.by, place=places)


def _player(match: Match, name: str) -> str:
    if name not in match.names:
        raise ConfigError([f"expected a player of this match ({', '.join(match.names)}), got {name!r}"])
    return name


def _pose(text: str) -> Pose:
    try:
        x, y, degrees = (float(word) for word in text.split())
    except ValueError:
        raise ConfigError([f"expected x and y in m and a heading in degrees, got {text!r}"]) from None
    if not all(map(math.isfinite, (x, y, degrees))) or max(abs(x), abs(y)) > 1e5:
        raise ConfigError([f"expected a place on the field, got {text!r}"])
    return Pose(x, y, math.radians(math.remainder(degrees, 360.0)))
