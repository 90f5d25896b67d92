"""CiA 402: units, states and error codes."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg_drives.cia402.codec import DriveState, drive_state
from vrg_drives.cia402.errors import describe_error, error_register
from vrg_drives.cia402.units import INCREMENTS_PER_S, UNIT_CODES, Cia402Options, Units, VelocityUnit, units

i32 = st.integers(-(2**31), 2**31 - 1)


def known_units(counts: int, turns: int, velocity: int | None) -> Units:
    found = units(counts, turns, velocity)
    assert found is not None
    return found


class TestCodec:
    @given(st.integers(0, 0xFFFF))
    def test_a_statusword_stands_for_one_state_at_most(self, word: int) -> None:
        fitting = [state for state in DriveState if word & state.value[0] == state.value[1]]
        assert len(fitting) <= 1
        assert drive_state(word) is (fitting[0] if fitting else None)

    @given(st.integers(1, 2**31 - 1), st.integers(1, 1000), i32)
    def test_positions_keep_every_count_and_wrap_after_32_bits(self, counts: int, turns: int, position: int) -> None:
        known = known_units(counts, turns, INCREMENTS_PER_S)
        assert round(known.turns(position) * known.counts) == position
        assert known.turns(2**31 - 1) - known.turns(-(2**31)) == pytest.approx(known.wrap)

    @given(
        st.floats(-500, 500),
        st.sampled_from([INCREMENTS_PER_S, 0x00B44700, 0xFDB44700, 0x00B40300, 0xFEB40300, 0x00B50300]),
    )
    def test_a_velocity_comes_back_to_the_nearest_unit(self, velocity: float, unit: int) -> None:
        known = known_units(4096, 1, unit)
        assert known.turns_per_s(known.velocity_of(velocity)) == pytest.approx(velocity, abs=0.5001 / known.velocity)

    @given(st.floats(allow_nan=False))
    def test_a_velocity_always_fits_the_object(self, velocity: float) -> None:
        known = known_units(4096, 1, 0xFDB44700)
        assert -(2**31) <= known.velocity_of(velocity) < 2**31

    @pytest.mark.parametrize(
        ("unit", "in_one_turn_per_second"),
        [(0x00B44700, 60), (0xFFB44700, 600), (0xFDB44700, 60_000), (0x00B40300, 1), (0x00B50300, 2000)],
    )
    def test_velocity_units_are_what_the_object_says(self, unit: int | None, in_one_turn_per_second: int) -> None:
        known = known_units(4000, 2, unit)
        assert known.velocity_of(1.0) == in_one_turn_per_second

    @pytest.mark.parametrize(
        "bad",
        [(0, 1, 0x00B44700), (1, 0, 0x00B44700), (1, 1, 0x00010300), (1, 1, 0x00B44701), (1, 1, None), (1, 1, 0)],
    )
    def test_units_that_make_no_sense_are_none(self, bad: tuple[int, int, int | None]) -> None:
        assert units(*bad) is None

    @pytest.mark.parametrize(
        ("unit", "in_one_turn_per_second"),
        [
            ("counts/s", 2000), ("counts/min", 120_000), ("1/s", 1), ("1/min", 60),
            ("0.1/min", 600), ("0.01/min", 6000), ("0.001/min", 60_000),
        ],
    )  # fmt: skip
    def test_a_unit_that_a_person_names(self, unit: VelocityUnit, in_one_turn_per_second: int) -> None:
        known = known_units(2000, 1, Cia402Options(velocity_unit=unit).velocity_code)
        assert known.velocity_of(1.0) == in_one_turn_per_second
        assert unit in UNIT_CODES

    @given(st.integers(1, 0xFFFF))
    def test_every_error_has_words_and_its_number(self, code: int) -> None:
        assert f"(0x{code:04X})" in describe_error(code)
        assert error_register(code) & 1
        assert (describe_error(0), error_register(0)) == ("", 0)
