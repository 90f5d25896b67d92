"""Those who look at the page of a match, without a server."""

import json
from collections.abc import Mapping, Sequence

from vrg.errors import LaunchError
from vrg.ui.web.requests import Inspect, Wishes


class Viewers:
    """What `vrg.ui.web.node.WebNode` has in place of the server of its page.

    Attributes:
        watched: somebody looks. inspected: what officials look into. wish: what is wanted at the next tick.
        failure: raised when the node looks whether the server runs.
        frames, calls: what was shown, decoded. told, released: words to guests, and guests who drive no longer.
        events: `start` and `stop`.
    """

    def __init__(self) -> None:
        self.watched = True
        self.inspected: frozenset[Inspect] = frozenset()
        self.frames: list[dict[str, object]] = []
        self.calls: list[dict[str, object]] = []
        self.told: list[tuple[int, str]] = []
        self.released: list[int] = []
        self.events: list[str] = []
        self.wish = Wishes()
        self.failure: LaunchError | None = None

    def start(self) -> None:
        """Note it."""
        self.events.append("start")

    def stop(self) -> None:
        """Note it."""
        self.events.append("stop")

    def check(self) -> None:
        """Raise `failure`, if there is one."""
        if self.failure is not None:
            raise self.failure

    def show(self, parts: Mapping[str, str], calls: Sequence[str] = ()) -> None:
        """Keep what is shown."""
        self.frames.append({name: json.loads(text) for name, text in parts.items()})
        self.calls += map(json.loads, calls)

    def tell(self, guest: int, text: str, *, released: bool = False) -> None:
        """Keep what one guest is told."""
        self.told.append((guest, text))
        self.released += [guest] * released

    def wishes(self) -> Wishes:
        """What is wanted since; `wish` is what a test has put there."""
        wish, self.wish = self.wish, Wishes()
        return wish
