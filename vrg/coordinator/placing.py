"""Assigns marks to players, and requests of the world to place robots, with the answers."""

from collections.abc import Mapping, Sequence

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Call, WorldRequest
from vrg.bus.topics import Keys
from vrg.coordinator.outcome import Answer, Effects
from vrg.navigation.assignment import assign
from vrg.portable.scalars import square
from vrg.types import Pose


def assigned(poses: Mapping[str, Pose], marks: Sequence[Pose]) -> dict[str, Pose]:
    """The mark of each player by the least sum of squared distances, by which no two ways cross.

    They are whole square millimetres, so that sums of them are exact, and equal ones stay equal.

    Args:
        poses: where the players are. marks: at least as many as there are players.
    """
    costs = [
        [float(round(1e6 * (square(pose.x - mark.x) + square(pose.y - mark.y)))) for mark in marks]
        for pose in poses.values()
    ]
    return {name: marks[column] for name, (_, column) in zip(poses, assign(costs), strict=True)}


class Placing:
    """Asks the world to put virtual robots somewhere. Only the world knows whether there is room for them.

    Args:
        mailbox: the coordinator's mailbox. keys: the keys of the match.
    """

    def __init__(self, mailbox: Mailbox, keys: Keys) -> None:
        self._mailbox = mailbox
        self._topic = keys.world_request
        self._answers = mailbox.subscribe(keys.world_answer)
        self._count = 0
        self._asked: dict[str, Call] = {}
        """The calls that are announced when the world has granted a request, by the request's id."""

    def ask(self, outcome: Effects) -> None:
        """Ask for what an outcome wants to be placed."""
        if not outcome.place:
            return
        number = None
        if outcome.once_placed is not None:
            self._count += 1
            number = outcome.once_placed.answers or f"place-{self._count}"
            self._asked[number] = outcome.once_placed
        self._mailbox.publish(self._topic, WorldRequest(places=dict(outcome.place), id=number))

    def hear(self) -> list[Answer]:
        """Return the world's answers to officials: done, or refused."""
        answered = []
        for answer in (received.body for received in self._answers.take()):
            asked = None if answer.id is None else self._asked.pop(answer.id, None)
            if answer.refused is not None:
                answers = None if asked is None else asked.answers
                text = f"the world refuses: {answer.refused}"
                answered.append(Answer(rule="refused", text=text, answers=answers, why=answer.refused))
            elif asked is not None:
                answered.append(Answer(rule=asked.rule, text=asked.text, answers=asked.answers))
        return answered
