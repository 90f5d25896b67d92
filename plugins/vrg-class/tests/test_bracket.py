"""Brackets of single and double elimination."""

import itertools
from collections import Counter
from collections.abc import Callable
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg_class.bracket import Pairing, Source, champion, double, entrants, is_needed, single

ALL = range(2, 65)
Choice = Callable[[int, int], int]


def played(pairings: list[Pairing], choice: Choice) -> dict[int, int]:
    """The winners of all that is needed, each chosen from the two seeds that meet."""
    winners: dict[int, int] = {}
    for number in range(len(pairings)):
        if is_needed(pairings, number, winners):
            first, second = entrants(pairings, number, winners)
            assert first is not None
            assert second is not None
            assert first != second
            winners[number] = choice(first, second)
    return winners


def losses(pairings: list[Pairing], winners: dict[int, int]) -> Counter[int | None]:
    """How often each seed has lost."""
    return Counter(
        seed for number, winner in winners.items() for seed in entrants(pairings, number, winners) if seed != winner
    )


@pytest.mark.parametrize("number", ALL)
def test_in_single_elimination_each_but_the_champion_loses_once(number: int) -> None:
    pairings = single(number)
    winners = played(pairings, max)
    assert len(pairings) == number - 1
    assert champion(pairings, winners) == number - 1
    assert losses(pairings, winners) == dict.fromkeys(range(number - 1), 1)
    assert [(pairing.side, pairing.round) for pairing in pairings if pairing.side == "final"] == [("final", 1)]


@pytest.mark.parametrize("number", ALL)
def test_in_double_elimination_each_but_the_champion_loses_twice(number: int) -> None:
    pairings = double(number)
    winners = played(pairings, max)
    assert len(pairings) == 2 * number - 1
    assert len(winners) == 2 * number - 2
    assert champion(pairings, winners) == number - 1
    assert losses(pairings, winners) == dict.fromkeys(range(number - 1), 2)
    assert [pairing.again for pairing in pairings] == [False] * (2 * number - 2) + [True]


@pytest.mark.parametrize("number", ALL)
@pytest.mark.parametrize("make", [single, double])
def test_the_two_best_meet_in_the_final_if_the_better_one_always_wins(
    make: Callable[[int], list[Pairing]], number: int
) -> None:
    pairings = make(number)
    winners = played(pairings, min)
    final = next(number for number, pairing in enumerate(pairings) if pairing.side == "final")
    assert entrants(pairings, final, winners) == (0, 1)
    if make is single:
        assert all({0, 1} != {*entrants(pairings, other, winners)} for other in range(final))


@pytest.mark.parametrize("number", ALL)
@pytest.mark.parametrize("make", [single, double])
def test_the_best_seeds_have_the_byes_and_rounds_count_from_one(
    make: Callable[[int], list[Pairing]], number: int
) -> None:
    pairings = make(number)
    byes = (1 << (number - 1).bit_length()) - number
    seeds = [
        source.number for pairing in pairings if (pairing.side, pairing.round) == (pairings[0].side, 1)
        for source in pairing[:2]
    ]  # fmt: skip
    assert sorted(seeds) == list(range(byes, number))
    for side in ("winners", "losers", "final"):
        rounds = [pairing.round for pairing in pairings if pairing.side == side]
        assert sorted(set(rounds)) == list(range(1, 1 + len(set(rounds))))
        assert rounds == sorted(rounds)


@given(st.data(), st.integers(2, 64), st.sampled_from([single, double]), st.randoms(use_true_random=False))
def test_whoever_wins_there_is_one_champion(
    data: st.DataObject, number: int, make: Callable[[int], list[Pairing]], random: Random
) -> None:
    pairings = make(number)
    winners = played(pairings, lambda first, second: random.choice((first, second)))
    best = champion(pairings, winners)
    assert best is not None
    lost = losses(pairings, winners)
    allowed = 1 if make is single else 2
    assert {seed: lost[seed] for seed in range(number) if seed != best} == {
        seed: allowed for seed in range(number) if seed != best
    }
    assert lost[best] < allowed
    so_far = dict(itertools.islice(winners.items(), data.draw(st.integers(0, len(winners)))))
    assert (champion(pairings, so_far) is None) == (len(so_far) < len(winners))


@pytest.mark.parametrize(("number", "soonest"), [(8, 3), (16, 4), (32, 5), (64, 6)])
def test_those_who_have_met_do_not_meet_again_soon(number: int, soonest: int) -> None:
    pairings = double(number)
    below: list[set[int]] = []
    """The seeds that can be in each pairing."""
    together: set[tuple[int, int]] = set()
    first: int | None = None
    for pairing in pairings[:-2]:
        two = [{s.number} if s.kind == "seed" else below[s.number] for s in pairing[:2]]
        pairs = {(min(a, b), max(a, b)) for a in two[0] for b in two[1] if a != b}
        if pairing.side == "losers" and pairs & together:
            first = first or pairing.round
        together |= pairs if pairing.side == "winners" else set()
        below.append(two[0] | two[1])
    assert first == soonest


def test_a_bracket_of_four_reads_like_a_sheet_of_paper() -> None:
    def text(source: Source) -> str:
        return f"{source.kind[0]}{source.number}"

    assert [(text(p.first), text(p.second), p.side, p.round) for p in double(4)] == [
        ("s0", "s3", "winners", 1), ("s1", "s2", "winners", 1),
        ("l0", "l1", "losers", 1),
        ("w0", "w1", "winners", 2),
        ("l3", "w2", "losers", 2),
        ("w3", "w4", "final", 1),
        ("l5", "w5", "final", 2),
    ]  # fmt: skip


def test_the_second_final_is_played_only_if_the_first_one_leaves_both_with_one_defeat() -> None:
    pairings = double(2)
    assert is_needed(pairings, 2, {0: 0}) is None
    assert is_needed(pairings, 2, {0: 0, 1: 0}) is False
    assert champion(pairings, {0: 0, 1: 0}) == 0
    assert is_needed(pairings, 2, {0: 0, 1: 1}) is True
    assert entrants(pairings, 2, {0: 0, 1: 1}) == (0, 1)
    assert champion(pairings, {0: 0, 1: 1}) is None


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match="got 1"):
        single(1)
    with pytest.raises(ValueError, match="got 65"):
        double(65)
    with pytest.raises(ValueError, match="pairing 0"):
        entrants(single(4), 0, {0: 2})
