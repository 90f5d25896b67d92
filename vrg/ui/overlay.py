"""The overlay of a replay's field: why a call was made, or how a match is taken up from an instant."""

import pygame

from vrg.bus.messages import Call
from vrg.ui.branching import Brancher, Choice, Taken
from vrg.ui.explaining import Card, Explain, Explainer
from vrg.ui.scene import clock_text


class Overlay:
    """Shows one thing at a time.

    Args:
        explain: works out why a call was made; None explains none.
        brancher: what takes the match up from an instant; None if nothing can.

    Attributes:
        begun: the match time, s, from which the match was taken up last.
    """

    def __init__(self, explain: Explain | None, brancher: Brancher | None) -> None:
        self.begun = 0.0
        self._explainer = Explainer(explain)
        self._brancher = brancher
        self._choice: Choice | None = None
        self._message: Card | None = None

    @property
    def card(self) -> Card | None:
        """The card that is shown now; None if there is none."""
        return self._choice.card if self._choice is not None else self._message or self._explainer.card

    def close(self) -> None:
        """Show nothing any more, and break off what was begun. Idempotent."""
        self._message = self._choice = None
        self._explainer.close()
        if self._brancher is not None:
            self._brancher.close()

    def explain(self, call: Call, game: str) -> None:
        """Show why a call was made.

        Args:
            game: the name of the game.
        """
        self.close()
        self._explainer.ask(call, game)

    def choose(self, time: float) -> None:
        """Ask who plays by another strategy from a match time, s, on."""
        self.close()
        brancher = self._brancher
        cannot = "this replay cannot take matches up" if brancher is None else brancher.cannot
        if brancher is None or cannot:
            self._message = Card("From here on: not with this match", (cannot,))
        else:
            self._choice = Choice(time, brancher.players, brancher.strategies)

    def press(self, key: int) -> bool:
        """Go on choosing by a key; return whether it was one for that."""
        choice = self._choice
        if choice is None:
            return False
        match key:
            case pygame.K_UP | pygame.K_DOWN:
                self._choice = choice.move(1 if key == pygame.K_DOWN else -1)
            case pygame.K_RETURN | pygame.K_KP_ENTER:
                taken = choice.take()
                self._choice = taken if isinstance(taken, Choice) else None
                if not isinstance(taken, Choice):
                    self._begin(choice.time, *taken)
            case _:
                return False
        return True

    def look(self) -> Taken | None:
        """Take in, without waiting, what has been worked out; return the match that was taken up, when it is over."""
        self._explainer.look()
        brancher = self._brancher
        if brancher is None or not brancher.busy or self._message is None:
            return None
        found = brancher.look()
        if isinstance(found, Taken):
            self.close()
            self._explainer = Explainer(found.explain)
            return found
        if found is not None:
            self._message = Card(self._message.heading, (found,), busy=brancher.busy)
        return None

    def _begin(self, time: float, player: str, strategy: str) -> None:
        assert self._brancher is not None
        self._brancher.begin(time, player, strategy)
        self.begun = time
        self._message = Card(f"From {clock_text(time)} on, {player} plays {strategy}", (), busy=True)
