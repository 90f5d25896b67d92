"""Works out why the referee made a call, for a window that must not wait: a thread reads what a run has left."""

import logging
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace

from vrg.bus.messages import Call
from vrg.games import game_of
from vrg.ui.plots.proof import Proof
from vrg.ui.scene import clock_text

log = logging.getLogger(__name__)

Explain = Callable[[int], Proof]
"""Returns why the call of a number was made. It may take a moment, and raises a VrgError where that cannot be known."""


@dataclass(frozen=True)
class Card:
    """A window's explanation of a call.

    Args:
        heading: the call. lines: what is known of it, in sentences.
        proof: what is drawn; None if nothing is. busy: more is being worked out.
    """

    heading: str
    lines: tuple[str, ...]
    proof: Proof | None = None
    busy: bool = False


class Explainer:
    """Has one card at a time.

    Args:
        explain: works out why a call was made; None if what the run has left is not on this machine.

    Attributes:
        explain: as given. card: what is to be shown now; None if nothing is.
    """

    def __init__(self, explain: Explain | None) -> None:
        self.card: Card | None = None
        self.explain = explain
        self._executor: ThreadPoolExecutor | None = None
        self._proof: Future[Proof] | None = None

    def ask(self, call: Call | None, game: str) -> None:
        """Begin to explain a call; `look` takes the explanation once it is there.

        Args:
            call: the call; None shows nothing any more.
            game: the name of the game, for the text of the rule.
        """
        self.close()
        if call is None:
            return
        text = game_of(game).rule_text(call.rule)
        lines = () if text is None else (f"Rule{f' ({text.source})' if text.source else ''}: {text.words}",)
        heading = f"Call {call.number}, {clock_text(call.clock)}: {call.text}"
        if self.explain is None:
            further = "What decided it is with the referee: `vrg run why` shows it where the run folder is."
            self.card = Card(heading, (*lines, further))
            return
        self.card = Card(heading, lines, busy=True)
        self._executor = self._executor or ThreadPoolExecutor(1, thread_name_prefix="why")
        self._proof = self._executor.submit(self.explain, call.number)

    def look(self) -> bool:
        """Take in, without waiting, what has been worked out. Return whether the card has changed."""
        if self._proof is None or not self._proof.done() or self.card is None:
            return False
        try:
            proof = self._proof.result()
            self.card = Card(proof.heading, proof.lines, None if proof.now is None else proof)
        except Exception as error:  # a broken run folder must not end a window that has the emergency stop
            log.exception("why call is not known")
            self.card = replace(self.card, lines=(*self.card.lines, f"Why is not known: {error}"), busy=False)
        self._proof = None
        return True

    def close(self) -> None:
        """Show nothing any more. Idempotent."""
        self.card = None
        if self._proof is not None:
            self._proof.cancel()
            self._proof = None
