"""What the referee is told of players that have failed for good, and for how long; nothing is started here."""

from pathlib import Path
from typing import Any

import pytest
from msgspec import structs

from vrg.bus import messages as m
from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import DISQUALIFIED, OfficialAction, PlayerStatus, Pulse, RefereeState, SeatAnswer, Stage
from vrg.bus.topics import Keys
from vrg.errors import LaunchError
from vrg.launch.vacancies import Vacancies

KEYS = Keys("seats")


class Bench:
    """The seats of a match with one player, `ann`, whose process never runs; the referee is the test."""

    def __init__(self, folder: Path, *, disqualify: bool) -> None:
        self.mailbox = Mailbox()
        self.announced: list[str] = []
        self.played: list[tuple[str, str]] = []
        self.refusal: str | None = None
        self.seats = Vacancies(
            self.mailbox, KEYS, ["ann"], self.replace, self.announced.append, folder, disqualify=disqualify
        )
        self.now = 100.0
        self.state = RefereeState(
            game="g", stage=Stage.PLAY_ROUND, halted=None, way_out=None, waiting=(), clock=0.0, total=0.0, round=1,
            rounds=1, score={}, zones=(),
            players=(PlayerStatus(name="ann", team="t", role="r", state="active", may_move=True, radius=0.3),),
        )  # fmt: skip

    def hear(self, body: Any) -> None:
        for inlet in self.mailbox.inlets:
            if inlet.topic.type is type(body):
                inlet.offer(Received(inlet.topic.key, 0.0, 0, body))
        self.mailbox.handover(0.0)

    def pulse(self) -> None:
        for inlet in self.mailbox.inlets:
            if inlet.topic.type is Pulse:
                inlet.offer(Received(KEYS.pulse("player", "ann").key, 0.0, 0, Pulse(ticks=1, missed=0)))

    def answer(self, asked: str | None) -> None:
        self.hear(m.Call(number=1, rule="halt", text="play is halted", answers=asked))

    def look(self, seconds: float = 1.1, **state: Any) -> list[Any]:
        """A second later: what is published."""
        self.now += seconds
        self.hear(structs.replace(self.state, **state))
        self.seats.look(self.now)
        return [out.message.body for out in self.mailbox.collect()]

    def vacate(self, why: str) -> None:
        self.seats.vacate("ann", why, self.now)

    def replace(self, name: str, strategy: str) -> None:
        if self.refusal is not None:
            raise LaunchError(self.refusal)
        self.played.append((name, strategy))

    def disqualified(self) -> list[PlayerStatus]:
        return [structs.replace(self.state.players[0], state=DISQUALIFIED)]


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path, disqualify=True)


def test_the_referee_is_told_again_until_it_has_done_it_and_not_longer(bench: Bench) -> None:
    bench.vacate("it hangs")
    for _ in range(3):
        (told,) = bench.look()
        assert (told.action, told.subject, told.reason) == (OfficialAction.DISQUALIFY, "ann", "it hangs")
    assert bench.look(0.2) == [], "not at every look"
    for _ in range(3):
        assert bench.look(players=bench.disqualified()) == []
    assert "ann: it hangs: disqualified" in bench.announced[0]
    assert bench.look() != []
    assert bench.look(stage=Stage.GAME_OVER) == [], "nor when the game is over"


def test_a_match_that_is_to_halt_is_halted_until_the_player_is_out(tmp_path: Path) -> None:
    bench = Bench(tmp_path, disqualify=False)
    bench.vacate("it hangs")
    (told,) = bench.look()
    assert (told.action, told.reason) == (OfficialAction.HALT, "ann: it hangs")
    assert bench.look(halted="called by hannah") != [], "that is another halt"
    bench.answer(told.id)
    assert bench.look(halted="called by launcher (ann: it hangs)") == []
    (again,) = bench.look()
    assert again.subject == "ann", "an official has let play go on without the player"
    assert bench.look(players=bench.disqualified()) == [], "an official has taken it out: play may go on"


def test_somebody_else_who_plays_for_it_is_not_disqualified(bench: Bench) -> None:
    bench.vacate("it hangs")
    bench.now += 0.1
    bench.pulse()
    bench.look(0.0)
    assert "ann" in bench.seats.vacant, "that was the last sign of the process that has ended"
    bench.now += 5.0
    bench.pulse()
    assert bench.look(0.0) == []


@pytest.mark.parametrize(
    ("player", "refusal", "said"),
    [
        ("ann", None, None),
        ("ann", "lab2 does not answer", "lab2 does not answer"),
        ("nemo", None, "PLAYER: expected one of ann, got 'nemo'"),
    ],
    ids=["given", "refused", "for nobody"],
)
def test_who_asks_for_a_seat_is_told_whether_it_was_given(
    bench: Bench, player: str, refusal: str | None, said: str | None
) -> None:
    bench.vacate("it hangs")
    bench.refusal = refusal
    bench.hear(m.SeatRequest(player=player, strategy="mine.py:Mine", by="bob", id="8"))
    (answer,) = [body for body in bench.look() if isinstance(body, SeatAnswer)]
    assert (answer.id, answer.refused) == ("8", said)
    assert bench.played == ([] if said else [("ann", "mine.py:Mine")])
    assert ("ann" in bench.seats.vacant) == bool(said)


def test_no_decision_is_longer_than_its_message(bench: Bench) -> None:
    bench.vacate("x" * 5000)
    (told,) = bench.look()
    assert isinstance(told, m.Official)
    assert len(told.reason) == 300
