"""What the referee and the officials say."""

import enum
from typing import Annotated

from msgspec import Meta, Struct

from vrg.bus.messages.base import Message, Reason, Text
from vrg.regions import Region
from vrg.types import Count, Name, Pose, Seconds


class Stage(enum.StrEnum):
    """The stages of a match (thesis, Algorithm 3.1)."""

    INITIALIZE = "initialize"
    PLAY_ROUND = "play_round"
    FOUL = "foul"
    ROUND_OVER = "round_over"
    GAME_OVER = "game_over"


class PlayerStatus(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A player as the referee sees it.

    Args:
        role: the game's word, such as `shark`.
        state: the game's word, such as `active` or `inactive`.
        may_move: its robot may be driven now.
        radius: of the circle around its body, m.
        pose: None where the world has not reported it, or where the game does not publish it.
        mark: where it is asked to line up, None = nowhere.
    """

    name: Name
    team: Name
    role: Name
    state: Name
    may_move: bool
    radius: Annotated[float, Meta(gt=0.0, le=100.0)]
    pose: Pose | None = None
    mark: Pose | None = None


class Zone(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A marked part of the field.

    Args:
        name: the word that is written on it.
        kind: `field`, `safe`, `start` or a word of the game's own: how it is drawn, and how a player finds it.
    """

    name: Name
    kind: Name
    region: Region


class RefereeState(Message, frozen=True, kw_only=True):
    """The whole state of a match that everybody may know.

    Args:
        halted: why the clock is stopped, in words; None while it is not.
        way_out: how the halt is left, in words; None while there is none.
        waiting: what keeps the stage from going on.
        clock: s of play in this round. total: s of play in the match.
        round, rounds: of the match, from 1; for Sharks and Minnows, passes.
        score: by team.
        winner: once the game is over; `draw` is one.
    """

    version = 2

    game: Name
    stage: Stage
    halted: Text | None
    way_out: Text | None
    waiting: list[Text]
    clock: Seconds
    total: Seconds
    round: Count
    rounds: Count
    score: dict[Name, int]
    players: list[PlayerStatus]
    zones: list[Zone]
    winner: Name | None = None
    estop: bool = False

    def player(self, name: str) -> PlayerStatus | None:
        """The player of this name, or None."""
        return next((p for p in self.players if p.name == name), None)


class Call(Message, frozen=True, kw_only=True):
    """A referee's call.

    Args:
        number: counts from 1 in a match, also across restarts of the coordinator.
        rule: the rule's short name, such as `tag` or `out_of_bounds`.
        text: the call in words.
        players: whom it concerns. poses: theirs at that instant, in the same order.
        clock: s of play in the round.
        answers: id of the official's decision that this call answers.
    """

    number: Count
    rule: Name
    text: Text
    players: list[Name]
    poses: list[Pose]
    clock: Seconds
    answers: Name | None = None


class OfficialAction(enum.StrEnum):
    """What a human official may do."""

    HALT = "halt"
    RESUME = "resume"
    END = "end"
    SET_SCORE = "set-score"
    SET_ROLE = "set-role"
    SET_STATE = "set-state"
    RECOVER = "recover"
    PLACE = "place"


class Official(Message, frozen=True, kw_only=True):
    """An official's decision.

    Args:
        by: who decides, for the log. reason: in words, for the log.
        subject: the team (set-score) or the player (set-role, set-state, place; recover, where None is everybody).
        value: the new score, role or state; for place `x y heading` in m and degrees, None for the player's mark.
        id: of this decision, so that its sender knows the answer.
    """

    version = 2

    action: OfficialAction
    by: Name
    reason: Reason = ""
    id: Name | None = None
    subject: Name | None = None
    value: Text | None = None


class Estop(Message, frozen=True, kw_only=True):
    """The emergency stop: engaged latches in every receiver until an explicit release."""

    engaged: bool
    by: Name
    reason: Reason = ""
