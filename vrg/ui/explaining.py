"""Works out why the referee made a call, for a window that must not wait: `vrg run why` in a process of its own."""

import json
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

from vrg.bus.messages import Call
from vrg.games import game_of
from vrg.ui.scene import clock_text


@dataclass(frozen=True)
class Card:
    """What a window shows of a call.

    Args:
        heading: the call. lines: what is known of it, in sentences.
        picture: a picture of the instant, to scale; None if there is none. busy: more is being worked out.
    """

    heading: str
    lines: tuple[str, ...]
    picture: Path | None = None
    busy: bool = False


class Explainer:
    """Has one card at a time.

    Args:
        run: the run folder of the match, on this machine; None if there is none.

    Attributes:
        card: what is to be shown now; None if nothing is.
    """

    def __init__(self, run: Path | None) -> None:
        self.card: Card | None = None
        self._run = run
        self._process: subprocess.Popen[str] | None = None

    def ask(self, call: Call | None, game: str) -> None:
        """Begin to explain a call; `look` takes in what comes of it.

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
        if self._run is None:
            where = f"`vrg run why RUN --call {call.number}`"
            further = f"What decided it is with the referee: type {where} where the run folder is."
            self.card = Card(heading, (*lines, further))
            return
        self.card = Card(heading, lines, busy=True)
        words = ["run", "why", str(self._run.resolve()), "--call", str(call.number), "--json"]
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "vrg", *words],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip

    def look(self) -> bool:
        """Take in, without waiting, what has been worked out. Return whether the card has changed."""
        if self._process is None or self._process.poll() is None or self.card is None:
            return False
        said, problem = self._process.communicate()
        if self._process.returncode == 0:
            found = json.loads(said)
            picture = None if found["picture"] is None else Path(found["picture"])
            self.card = replace(self.card, lines=tuple(found["lines"]), picture=picture, busy=False)
        else:
            told = problem.strip().splitlines()[-1:] or ["vrg run why has ended without a word"]
            self.card = replace(self.card, lines=(*self.card.lines, *told), busy=False)
        self._process = None
        return True

    def close(self) -> None:
        """Show nothing any more. Idempotent."""
        self.card = None
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None
