"""The newest of everything that there is to see, encoded once for all viewers. Each viewer gets what is new to it.

The parts, such as `frame`, replace each other: a viewer that is slow misses some, and gets the newest. Calls are a
list, and no viewer misses any. A part whose name begins with PRIVATE goes to those alone who have asked for it.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

CALLS_KEPT: Final = 200
"""The number of the referee's calls that a late viewer gets."""
PRIVATE: Final = "drawer/"
"""The beginning of the names of the parts that are not for all."""


@dataclass(frozen=True)
class Delivered:
    """A viewer's state: the versions of the parts, by name, and the number of calls."""

    parts: Mapping[str, int] = field(default_factory=dict)
    calls: int = 0


class Gallery:
    """Holds texts of JSON."""

    def __init__(self) -> None:
        self._texts: dict[str, str] = {}
        self._versions: dict[str, int] = {}
        self._calls: list[str] = []
        self._forgotten = 0
        self._count = 0
        self._joined: tuple[tuple[object, ...], str] = ((), "")

    def put(self, parts: Mapping[str, str], calls: Sequence[str] = ()) -> None:
        """Replace parts, and add calls. A part with the same text as before is not new."""
        for name, text in parts.items():
            if self._texts.get(name) != text:
                self._texts[name] = text
                self._count += 1
                self._versions[name] = self._count
        self._calls += calls
        if (excess := len(self._calls) - CALLS_KEPT) > 0:
            del self._calls[:excess]
            self._forgotten += excess

    def forget(self, wanted: Collection[str]) -> None:
        """Forget the private parts that nobody wants: what is old by then is not shown to those who ask again.

        Args:
            wanted: their names behind PRIVATE.
        """
        for name in [name for name in self._texts if name.startswith(PRIVATE)]:
            if name.removeprefix(PRIVATE) not in wanted:
                del self._texts[name], self._versions[name]

    def since(self, seen: Delivered, private: str | None = None) -> tuple[str, Delivered]:
        """Return the news for a viewer, as a list of JSON without its brackets, and the viewer's next state.

        Args:
            private: the name of the private part that it gets; None for none.
        """
        now = {name: n for name, n in self._versions.items() if not name.startswith(PRIVATE) or name == private}
        new = tuple(name for name, version in now.items() if seen.parts.get(name) != version)
        first = max(0, seen.calls - self._forgotten)
        total = self._forgotten + len(self._calls)
        if not new and first == len(self._calls):
            return "", seen
        # Viewers that keep up all want the same, which is joined once.
        wanted = (*((name, self._versions[name]) for name in new), first, total)
        if self._joined[0] != wanted:
            texts = [self._texts[name] for name in new]
            if calls := self._calls[first:]:
                texts.append(f'{{"t":"calls","calls":[{",".join(calls)}]}}')
            self._joined = wanted, ",".join(texts)
        return self._joined[1], Delivered(now, total)
