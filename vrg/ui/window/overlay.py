"""The overlay of a replay's field while a match is continued from an instant: the choice, and its outcome."""

import pygame

from vrg.ui.branching import Brancher, Choice, Taken
from vrg.ui.scene import clock_text
from vrg.ui.window.explaining import Card


class Overlay:
    """Shows one thing at a time.

    Args:
        brancher: what takes the match up from an instant; None if nothing can.

    Attributes:
        begun: the match time, s, from which the match was taken up last.
    """

    def __init__(self, brancher: Brancher | None) -> None:
        self.begun = 0.0
        self._brancher = brancher
        self._choice: Choice | None = None
        self._message: Card | None = None

    @property
    def card(self) -> Card | None:
        """The card that is shown now; None if there is none."""
        return self._choice.card if self._choice is not None else self._message

    def close(self) -> None:
        """Show nothing any more, and break off what was begun. Idempotent."""
        self._message = self._choice = None
        if self._brancher is not None:
            self._brancher.close()

    def choose(self, time: float) -> None:
        """Ask who plays by another strategy from a match time, s, on."""
        self.close()
        brancher = self._brancher
        cannot = "this replay cannot continue matches" if brancher is None else brancher.cannot
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
        brancher = self._brancher
        if brancher is None or not brancher.busy or self._message is None:
            return None
        found = brancher.look()
        if isinstance(found, Taken):
            self.close()
            return found
        if found is not None:
            self._message = Card(self._message.heading, (found,), busy=brancher.busy)
        return None

    def _begin(self, time: float, player: str, strategy: str) -> None:
        assert self._brancher is not None
        self._brancher.begin(time, player, strategy)
        self.begun = time
        self._message = Card(f"From {clock_text(time)} on, {player} plays {strategy}", (), busy=True)
