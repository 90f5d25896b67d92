"""The draw of a qualification: who meets whom on one field, in which order, and in which colours.

A break of a team is counted in matches: how many are played between two of its own. With an even number of teams the
circle method has the longest breaks that there can be, since from round to round each team moves by at most one place.
With an odd number it has not (W. Suksompong, Scheduling asynchronous round-robin tournaments, arXiv 1804.04504, has
another order for them, but of whole round robins), and after fewer rounds than there are teams some have played less
than others. So a short search with restarts takes its place. It is deterministic: the same numbers give the same draw.
We know no package that draws a part of a round robin with even breaks; those on PyPI that we found draw whole round
robins in rounds.
"""

from collections import Counter
from collections.abc import Iterator
from itertools import combinations, count
from random import Random
from typing import Final

_ATTEMPTS: Final = 8
"""How often the search starts again before it does with a break that is shorter by one match."""


def draw(teams: int, each: int) -> list[tuple[int, int]]:
    """The matches of a qualification: pairs of teams, numbered from 0; the first one of a pair has the first colour.

    Nobody meets another team again before it has met all of them. At any time each team has played at most one match
    more in one colour than in the other. The shortest break is `longest_break(teams)` where their number is even. Where
    it is odd, it is the same for up to 4 matches each, at most 1 shorter for up to 13, and at most 2 shorter for up to
    20, as measured for each number of teams.

    Args:
        teams: how many there are, 2 to 64.
        each: how many matches each of them plays, 1 to 20. Where `teams * each` is odd, team 0 plays one more, since
            each match needs two; which one does is of no weight, as the ranking counts per match.

    Raises:
        ValueError: a number is out of its range.
    """
    if not (2 <= teams <= 64 and 1 <= each <= 20):
        raise ValueError(f"expected 2 to 64 teams with 1 to 20 matches each, got {teams} with {each}")
    return _coloured(_circle(teams, each) if teams % 2 == 0 else _search(teams, each))


def longest_break(teams: int) -> int:
    """The longest that the shortest break can be, in matches, where each team plays twice or more.

    Were it longer by one, more different teams than there are would have to play within one break and the matches
    at its two ends, or, with an even number of teams, the same pairs would meet again and again.
    """
    return max(0, (teams - 3) // 2)


def _circle(teams: int, rounds: int) -> list[tuple[int, int]]:
    """Rounds of the circle method, in the order of their tables: team 0 stays, and the others move by one seat."""
    seats, matches = [*range(teams)], list[tuple[int, int]]()
    for _ in range(rounds):
        matches += [(seats[place], seats[-1 - place]) for place in range(teams // 2)]
        seats = [0, *seats[2:], seats[1]]
    return matches


def _search(teams: int, each: int) -> list[tuple[int, int]]:
    """Matches with a break as long as some attempt finds it."""
    longest = longest_break(teams)
    attempts = (_attempt(teams, each, max(0, longest - seed // _ATTEMPTS), seed) for seed in count())
    return next(found for found in attempts if found is not None)


def _attempt(teams: int, each: int, rest: int, seed: int) -> list[tuple[int, int]] | None:
    """Matches with at least `rest` others between two of a team, by a search that goes back where it cannot go on."""
    random = Random(seed)
    wanted = [each + (team == 0 and teams * each % 2) for team in range(teams)]
    played, met, order = [0] * teams, Counter[tuple[int, int]](), list[tuple[int, int]]()

    def choices() -> Iterator[tuple[int, int]]:
        tired = {team for pair in order[max(0, len(order) - rest) :] for team in pair}
        # Those first that lag behind; the noise differs by the seed, so that no two attempts fail alike.
        keys = {a: played[a] - wanted[a] + 0.6 * random.random() for a in range(teams) if played[a] < wanted[a]}
        for a, b in combinations(sorted(keys.keys() - tired, key=keys.__getitem__), 2):
            pair = min(a, b), max(a, b)
            if met[pair] == min(played[a], played[b]) // (teams - 1):
                yield pair

    def change(pair: tuple[int, int], by: int) -> None:
        met[pair] += by
        for team in pair:
            played[team] += by

    open_choices = [choices()]
    for _ in range(2 * teams * each):
        pair = next(open_choices[-1], None)
        if pair is not None:
            order.append(pair)
            change(pair, 1)
            if sum(wanted) == 2 * len(order):
                return order
            open_choices.append(choices())
        elif order:
            open_choices.pop()
            change(order.pop(), -1)
        else:
            return None
    return None


def _coloured(matches: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """The matches, each with its teams in the order of their colours.

    A team has different colours in its matches 1 and 2, in 3 and 4, and so on, and the two of a match have different
    ones, too: what is tied in this way are chains and even rings, so going along each of them settles all.
    """
    # The teams of match n are the halves 2 n and 2 n + 1.
    teams = [team for pair in matches for team in pair]
    single, tied = dict[int, int](), dict[int, int]()
    for half, team in enumerate(teams):
        if team in single:
            tied[half] = single.pop(team)
            tied[tied[half]] = half
        else:
            single[team] = half
    coloured = dict[int, tuple[int, int]]()
    # Chains before rings, and each from its end.
    for start in sorted(range(len(teams)), key=tied.__contains__):
        first: int | None = start
        while first is not None and first // 2 not in coloured:
            coloured[first // 2] = teams[first], teams[first ^ 1]
            first = tied.get(first ^ 1)
    return [coloured[number] for number in range(len(matches))]
