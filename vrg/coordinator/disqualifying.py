"""Players that are out whatever the game, because they or their processes have failed. Functions of a game's state."""

from collections.abc import Sequence
from typing import TypeVar

from msgspec import structs

from vrg.bus.messages import DISQUALIFIED, Call, PlayerStatus
from vrg.coordinator.outcome import Effects
from vrg.coordinator.rulebook import Disqualification, GameState, Observation

S = TypeVar("S", bound=GameState)


def disqualify(state: S, name: str, why: str, now: Observation, *, by_official: bool) -> tuple[S, Effects]:
    """Take a player out. One that is out already gets the new reason, unless an official has decided the old one."""
    before = state.disqualified.get(name)
    known = before is not None and before.why == why and not before.returns
    if known or (before is not None and before.by_official and not by_official):
        return state, Effects()
    text = f"{name} is disqualified: {why}"
    state = _with(state, name, Disqualification(why=why, by_official=by_official))
    return state, _call("disqualified", text, name, now, why)


def reinstate(state: S, name: str, now: Observation, *, later: str) -> tuple[S, Effects]:
    """Let a player that is out play again.

    Args:
        later: when it plays, such as `the next pass`; empty if at once.
    """
    before = state.disqualified.get(name)
    if before is None or before.returns:
        return state, Effects()
    state = _with(state, name, structs.replace(before, returns=True) if later else None)
    return state, _call("reinstated", f"{name} plays again{f' from {later}' if later else ''}", name, now)


def readmitted(state: S) -> S:
    """The state for the next round, in which reinstated players are not out any more."""
    return structs.replace(state, disqualified={n: d for n, d in state.disqualified.items() if not d.returns})


def kept_out(state: GameState, players: Sequence[PlayerStatus]) -> tuple[PlayerStatus, ...]:
    """The same players; those that are out may not move and have no mark."""
    return tuple(
        structs.replace(player, state=DISQUALIFIED, may_move=False, mark=None)
        if player.name in state.disqualified
        else player
        for player in players
    )


def _with(state: S, name: str, what: Disqualification | None) -> S:
    others = {n: d for n, d in state.disqualified.items() if n != name}
    return structs.replace(state, disqualified=others if what is None else {**others, name: what})


def _call(rule: str, text: str, name: str, now: Observation, why: str = "") -> Effects:
    poses = (now.poses[name],) if name in now.poses else ()
    return Effects([Call(rule=rule, text=text, players=(name,), poses=poses, why=why)])
