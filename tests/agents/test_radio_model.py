"""The model of the radio: what it loses and delays, by the message alone."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.agents.radio import (
    BACKLOG,
    LinkSettings,
    ModelledLink,
    PerfectLink,
    RadioSettings,
    Transmission,
    draws,
    link_of,
)

WORDS = Transmission("ann", "bob", "vrg/m/team/red/say/ann", 0, 100, 1.0, 5.0)


def link(seed: int = 1, **settings: float) -> ModelledLink:
    return ModelledLink(RadioSettings(every=LinkSettings(**settings)), seed)


def delays(of: ModelledLink, count: int, step: float = 0.1) -> list[float | None]:
    return [of.delay(replace(WORDS, sequence=n, stamp=n * step)) for n in range(count)]


def test_without_settings_everything_arrives_at_once() -> None:
    assert isinstance(link_of(RadioSettings(), 1), PerfectLink)
    assert delays(link(), 50) == [0.0] * 50


def test_nothing_arrives_from_beyond_the_range() -> None:
    near = link(range=5.0)
    assert near.delay(WORDS) == 0.0, "at the range it still arrives"
    assert near.delay(replace(WORDS, distance=5.001)) is None
    assert near.delay(replace(WORDS, distance=None)) == 0.0, "who does not know where it is counts as near"


@pytest.mark.parametrize("share", [0.0, 0.1, 0.3, 0.9, 1.0])
def test_the_share_of_lost_messages_is_as_set(share: float) -> None:
    lost = delays(link(loss=share), 4000).count(None)
    spread = (share * (1 - share) * 4000) ** 0.5
    assert abs(lost - share * 4000) <= 4 * spread


def test_each_message_draws_a_delay_of_its_own_within_the_jitter() -> None:
    found = [delay for delay in delays(link(delay=0.2, jitter=0.1), 2000) if delay is not None]
    assert len(found) == 2000
    assert 0.2 <= min(found) < 0.205
    assert 0.295 < max(found) <= 0.3
    assert sum(found) / 2000 == pytest.approx(0.25, abs=0.003)


@given(st.integers(0, 2**63), st.integers(0, 2**53))
def test_the_draws_depend_on_seed_link_key_and_number_alone(seed: int, number: int) -> None:
    message = replace(WORDS, sequence=number)
    assert draws(seed, message) == draws(seed, replace(message, size=7, distance=None, stamp=9.0))
    assert all(0.0 <= draw < 1.0 for draw in draws(seed, message))
    changes = ({"sequence": number + 1}, {"listener": "eve"}, {"speaker": "eve"}, {"key": "vrg/m/team/red/say/eve"})
    others = [draws(seed, replace(message, **change)) for change in changes]
    assert draws(seed, message) not in [draws(seed + 1, message), *others]


def test_the_two_draws_of_a_message_do_not_hang_together() -> None:
    pairs = [draws(3, replace(WORDS, sequence=n)) for n in range(4000)]
    assert sum(a * b for a, b in pairs) / 4000 == pytest.approx(0.25, abs=0.01)


def test_messages_wait_for_their_turn_on_a_narrow_link_in_each_direction_of_each_pair() -> None:
    narrow = link(bandwidth=1000.0)
    at_once = [narrow.delay(replace(WORDS, sequence=n)) for n in range(3)]
    assert at_once == pytest.approx([0.1, 0.2, 0.3]), "100 bytes take 0.1 s each"
    for other in ({"listener": "eve"}, {"speaker": "bob", "listener": "ann"}):
        assert narrow.delay(replace(WORDS, **other)) == pytest.approx(0.1)
    assert narrow.delay(replace(WORDS, sequence=3, stamp=2.0)) == pytest.approx(0.1), "the link is free again"


def test_a_link_that_is_told_too_much_loses_the_rest() -> None:
    narrow = link(bandwidth=500.0)
    found = delays(narrow, 400)
    assert None in found, "1000 bytes a second do not pass a link of 500"
    passed = [delay for delay in found if delay is not None]
    assert max(passed) <= BACKLOG + 0.2 + 1e-9
    assert len(passed) * 100 == pytest.approx(40 * 500, rel=0.1), "what passes in 40 s is what the link can carry"


def test_one_link_may_be_worse_than_the_others() -> None:
    settings = RadioSettings(every=LinkSettings(delay=0.1), links={"ann>bob": LinkSettings(loss=1.0)})
    model = ModelledLink(settings, 1)
    assert model.delay(WORDS) is None
    assert model.delay(replace(WORDS, speaker="bob", listener="ann")) == 0.1
