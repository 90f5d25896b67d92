"""An interval that holds whenever somebody looks, and what it can find out."""

import math

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg_league.evidence import STAKES, ShareEstimate

VALUES = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
PAIRS = st.lists(st.sampled_from(VALUES.tolist()), min_size=1, max_size=80)


def evidence_of(pairs: list[float], confidence: float = 0.95) -> ShareEstimate:
    evidence = ShareEstimate(confidence)
    for value in pairs:
        evidence.add(value)
    return evidence


def capital(pairs: list[float], share: float) -> float:
    """The gambler's capital, as the formula says it."""
    products = [math.prod(1.0 + stake * (x / share - 1.0) for x in pairs) for stake in STAKES.tolist()]
    return sum(products) / len(products)


@given(PAIRS)
def test_the_mean_of_the_pairs_is_always_in_the_interval(pairs: list[float]) -> None:
    evidence = evidence_of(pairs)
    low, high = evidence.interval()
    assert evidence.share == pytest.approx(np.mean(pairs))
    assert 0.0 <= low <= np.mean(pairs) + 1e-9
    assert np.mean(pairs) - 1e-9 <= high <= 1.0


@given(PAIRS)
def test_the_interval_ends_where_the_gambler_becomes_rich(pairs: list[float]) -> None:
    low, high = evidence_of(pairs).interval()
    mirrored = [1.0 - x for x in pairs]
    if low > 1e-3:
        assert capital(pairs, low - 1e-6) >= 40.0 * (1 - 1e-9) > capital(pairs, low + 1e-6)
    if high < 1.0 - 1e-3:
        assert capital(mirrored, 1.0 - high - 1e-6) >= 40.0 * (1 - 1e-9) > capital(mirrored, 1.0 - high + 1e-6)


@given(PAIRS, st.randoms())
def test_neither_the_order_of_the_pairs_nor_who_is_called_first_matters(pairs: list[float], random: object) -> None:
    low, high = evidence_of(pairs).interval()
    assert evidence_of(sorted(pairs)).interval() == pytest.approx((low, high), abs=1e-9)
    assert evidence_of([1.0 - x for x in pairs]).interval() == pytest.approx((1.0 - high, 1.0 - low), abs=1e-9)


@given(PAIRS)
def test_more_confidence_needs_a_wider_interval(pairs: list[float]) -> None:
    narrow, wide = evidence_of(pairs, 0.8).interval(), evidence_of(pairs, 0.99).interval()
    assert wide[0] <= narrow[0] + 1e-9
    assert narrow[1] <= wide[1] + 1e-9


def test_without_a_pair_nothing_is_known() -> None:
    assert ShareEstimate(0.95).share is None
    assert ShareEstimate(0.95).interval() == (0.0, 1.0)


def test_nothing_but_a_mean_of_points_is_taken() -> None:
    with pytest.raises(ValueError, match="from 0 to 1"):
        ShareEstimate(0.95).add(1.5)


def test_always_winning_is_proved_after_eight_pairs() -> None:
    def proved(n: int) -> bool:
        return evidence_of([1.0] * n).interval()[0] > 0.5

    assert next(n for n in range(1, 20) if proved(n)) == 8


def independent(win: float) -> npt.NDArray[np.float64]:
    """How likely each mean of a pair is, if both games are won with this probability."""
    return np.array([(1 - win) ** 2, 0.0, 2 * win * (1 - win), 0.0, win**2])


def capitals(pairs: npt.NDArray[np.float64], share: float) -> npt.NDArray[np.float64]:
    """The larger of both gamblers' capitals after each pair: a row for each run."""
    largest = np.zeros(pairs.shape)
    for values, mean in ((pairs, share), (1.0 - pairs, 1.0 - share)):
        factors = 1.0 + STAKES[:, None, None] * (values / mean - 1.0)
        largest = np.maximum(largest, factors.cumprod(axis=2).mean(axis=0))
    return largest


CASES = {
    "equal": independent(0.5),
    "better": independent(0.6),
    "much better": independent(0.8),
    "one side nearly always wins": np.array([0.02, 0.0, 0.96, 0.0, 0.02]),
    "draws": np.array([0.1, 0.2, 0.4, 0.2, 0.1]),
    "never loses": np.array([0.0, 0.0, 0.0, 0.5, 0.5]),
}


@pytest.mark.parametrize("confidence", [pytest.param(0.8, marks=pytest.mark.thorough), 0.95])
@pytest.mark.parametrize("chances", CASES.values(), ids=CASES)
def test_whoever_looks_after_every_pair_is_as_rarely_wrong_as_promised(
    chances: npt.NDArray[np.float64], confidence: float
) -> None:
    """In 3000 runs of 150 pairs, all of which are looked at."""
    rng = np.random.default_rng(1)
    pairs = VALUES[rng.choice(5, size=(3000, 150), p=chances)]
    wrong = (capitals(pairs, float(chances @ VALUES)) >= 2.0 / (1.0 - confidence)).any(axis=1)
    assert wrong.mean() <= 1.0 - confidence


@pytest.mark.parametrize(("win", "found"), [(0.6, 0.45), (0.64, 0.8), (0.7, 0.98)])
def test_a_better_strategy_is_mostly_found_within_200_games(win: float, found: float) -> None:
    rng = np.random.default_rng(2)
    pairs = VALUES[rng.choice(5, size=(2000, 100), p=independent(win))]
    assert (capitals(pairs, 0.5) >= 40.0).any(axis=1).mean() >= found


@pytest.mark.parametrize("value", [1.0, 0.0])
def test_it_is_known_how_many_pairs_like_those_so_far_are_missing(value: float) -> None:
    evidence = evidence_of([value] * 4)
    assert evidence.missing(8) == 4
    assert evidence.missing(3) is None, "more than is asked for"
    for more in range(4):
        low, high = evidence.interval()
        assert low <= 0.5 <= high, more
        evidence.add(value)
    low, high = evidence.interval()
    assert low > 0.5 or high < 0.5
    assert evidence.missing(8) == 0


@pytest.mark.parametrize("pairs", [[], [0.5] * 9, [0.0, 1.0], [0.5] * 100 + [0.75]])
def test_without_a_difference_no_number_of_pairs_is_missing(pairs: list[float]) -> None:
    assert evidence_of(pairs).missing(100) is None
