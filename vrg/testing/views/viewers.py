"""Those who look at the page of a match, without a server."""

import json
from collections.abc import Mapping, Sequence

from vrg.errors import LaunchError
from vrg.ui.web.requests import Inspect, Wishes


class Viewers:
    """Keeps what it was shown; wants what a test says."""

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
        self.events.append("start")

    def stop(self) -> None:
        self.events.append("stop")

    def check(self) -> None:
        if self.failure is not None:
            raise self.failure

    def show(self, parts: Mapping[str, str], calls: Sequence[str] = ()) -> None:
        self.frames.append({name: json.loads(text) for name, text in parts.items()})
        self.calls += map(json.loads, calls)

    def tell(self, guest: int, text: str, *, released: bool = False) -> None:
        self.told.append((guest, text))
        self.released += [guest] * released

    def wishes(self) -> Wishes:
        wish, self.wish = self.wish, Wishes()
        return wish
