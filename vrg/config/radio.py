"""What is wrong with the [radio] table of a match file."""

from collections.abc import Collection

from vrg.config.files import RadioTable
from vrg.errors import Problem


def radio_problems(radio: RadioTable | None, names: Collection[str] | None) -> list[Problem]:
    """The links that are not between two players of the match, or that are named twice.

    Args:
        names: the names of the players; None where not all are known, because some of their tables have mistakes.
    """
    problems: list[Problem] = []
    seen: set[frozenset[str]] = set()
    for number, link in enumerate(radio.links if radio else ()):
        where = ("radio", "links", number, "between")
        for name in link.between:
            if names is not None and name not in names:
                problems.append(Problem(f"expected a player of this match, got {name!r}", where))
        pair = frozenset(link.between)
        if len(pair) == 1:
            problems.append(Problem(f"expected two players, got {link.between[0]!r} twice", where))
        elif pair in seen:
            problems.append(Problem(f"the link between {' and '.join(link.between)} is here already", where))
        seen.add(pair)
    return problems
