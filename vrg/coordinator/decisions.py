"""The decisions of officials: to halt, resume, end, overrule, recover robots, and tell where robots stand.

This module uses no bus and no clock.
"""

import math
from collections.abc import Collection, Sequence
from dataclasses import replace

from msgspec import structs

from vrg.bus.messages import BY_OFFICIAL, FAILED, Call, Official, OfficialAction
from vrg.coordinator.match import Match
from vrg.coordinator.outcome import Effects
from vrg.coordinator.rulebook import NOBODY, Observation
from vrg.errors import ConfigError
from vrg.registry import did_you_mean
from vrg.types import Pose


def decide(
    match: Match, official: Official, now: Observation, absent: Sequence[str], silent: Collection[str] = ()
) -> Effects:
    """Apply an official's decision. An impossible one is answered by a call `refused` with the reason.

    Args:
        now: the field.
        absent: the reasons outside the rules why play cannot be resumed.
        silent: the players that do not report, so that their robots cannot be commanded.
    """
    refusal = _refusal(match, official.action, absent)
    if refusal:
        return _refused(official, refusal)
    try:
        return _done(match, official, now, silent)
    except ConfigError as error:
        return _refused(official, str(error))


def _done(match: Match, official: Official, now: Observation, silent: Collection[str]) -> Effects:
    action, number = official.action, official.id
    why = f" ({official.reason})" if official.reason else ""
    who = f"{official.by}{why}"
    match action:
        case OfficialAction.HALT:
            halt = match.halt(f"called by {who}", BY_OFFICIAL)
            text = halt.calls[0].text if halt else f"halted already: {match.halted}"
            reason = halt.calls[0].why if halt else match.halted or ""
            call = Call(rule="halt", text=text, answers=number, why=reason, cause=BY_OFFICIAL)
            outcome = Effects([call])
        case OfficialAction.RESUME:
            match.resume()
            outcome = Effects([Call(rule="resume", text=f"resumed by {who}", answers=number)])
        case OfficialAction.END:
            stage = match.end(NOBODY, f"ended by {who}")
            call = Call(rule="ended", text=f"ended by {who}", answers=number, why=official.reason)
            outcome = Effects([call], [stage])
        case OfficialAction.RECOVER:
            outcome = _recover(match, official, who)
        case OfficialAction.DISQUALIFY | OfficialAction.REINSTATE:
            outcome = _take_out(match, official, now, who)
        case OfficialAction.PLACE:
            outcome = _place(match, official, now, who, silent)
        case _:
            match.overrule(action, official.subject or "", official.value or "")
            text = f"{official.by}: {action} {official.subject} {official.value}{why}"
            outcome = Effects([Call(rule="overruled", text=text, answers=number)])
    return outcome


def _refused(official: Official, why: str) -> Effects:
    text = f"{official.action}, asked for by {official.by}, is refused: {why}"
    return Effects([Call(rule="refused", text=text, answers=official.id, why=why)])


def _refusal(match: Match, action: OfficialAction, absent: Sequence[str]) -> str | None:
    """The reason why an official cannot do this now, or None."""
    if match.over:
        return "the game is over"
    if action is not OfficialAction.RESUME:
        return None
    if match.halted is None:
        return "play is not halted"
    return "; ".join(absent) or None


def _recover(match: Match, official: Official, who: str) -> Effects:
    """Ask robots to clear the faults that they have latched. Play stays halted, because a fault may come back."""
    subject = official.subject
    names = match.names if subject is None else [_player(match, subject)]
    text = f"recover {subject or 'all robots'}: asked by {who}"
    return Effects([Call(rule="recover", text=text, answers=official.id)], recover=names, by=official.by)


def _take_out(match: Match, official: Official, now: Observation, who: str) -> Effects:
    """Disqualify a player, or let it play again.

    Raises:
        ConfigError: there is no such player, or it is out already, or is not.
    """
    name = _player(match, official.subject or "")
    if official.action is OfficialAction.REINSTATE:
        outcome, wrong = match.reinstate(name, now), f"{name} is not disqualified, or will already play again"
    elif official.value == FAILED:
        outcome, wrong = match.disqualify(name, official.reason, now), f"{name} is disqualified already"
    else:
        outcome = match.disqualify(name, f"by {who}", now, by_official=True)
        wrong = f"{name} is disqualified already"
    if not outcome:
        raise ConfigError([wrong])
    return replace(outcome, calls=[structs.replace(call, answers=official.id) for call in outcome.calls])


def _place(match: Match, official: Official, now: Observation, who: str, silent: Collection[str]) -> Effects:
    """Put a virtual robot somewhere, or tell a physical one where a person has put it.

    Raises:
        ConfigError: there is no such player, the pose cannot be read or is missing, or a physical robot has no room
            there.
    """
    name = _player(match, official.subject or "")
    pose = _pose(official.value) if official.value else match.mark(name, now)
    if pose is None:
        raise ConfigError(f"{name} has no mark now: say where it is, x and y in m and its heading in degrees")
    at = f"at ({pose.x:.2f}, {pose.y:.2f}), {math.degrees(pose.theta):.0f} degrees"
    if name in now.poses and name not in match.public(now).poses:
        at = "somewhere"  # not everybody may know where
    physical = name in now.physical
    if physical and name in silent:
        raise ConfigError(f"{name} does not report, so its robot cannot take the pose: try again when it does")
    if physical and (why := match.no_room(name, pose)):
        raise ConfigError(f"{name}: {why}")
    verb = "stands" if physical else "is put"
    call = Call(rule="place", text=f"{name} {verb} {at}: by {who}", answers=official.id)
    if physical:
        return Effects([call], by=official.by, placed={name: pose})
    # Only the world knows whether there is room, so what it does is announced when it has been done.
    return Effects(by=official.by, place={name: pose}, once_placed=call)


def _player(match: Match, name: str) -> str:
    if name not in match.names:
        known, guess = ", ".join(match.names), did_you_mean(name, match.names)
        raise ConfigError(f"expected a player of this match ({known}), got {name!r}{guess}")
    return name


def _pose(text: str) -> Pose:
    try:
        x, y, degrees = (float(word) for word in text.split())
    except ValueError:
        raise ConfigError(f"expected x and y in m and a heading in degrees, got {text!r}") from None
    if not all(map(math.isfinite, (x, y, degrees))) or max(abs(x), abs(y)) > 1e5:
        raise ConfigError(f"expected a place on the field, got {text!r}")
    return Pose(x, y, math.radians(math.remainder(degrees, 360.0)))
