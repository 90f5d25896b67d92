"""Drivetrains: twists and the speeds of axes."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import astuple

from vrg.hal.models.drivetrain import Drivetrain, Wheel, skid_steer
from vrg.types import STILL, Twist

SKID = skid_steer(wheel_radius=0.1, wheel_width=0.05, wheelbase=0.3, track=0.4, effective_track=0.6)
DIFFERENTIAL = Drivetrain(
    axes=("left", "right"),
    wheels=(Wheel(x=0.0, y=0.2, axis=0), Wheel(x=0.0, y=-0.2, axis=1), Wheel(x=-0.2, y=0.0)),
    wheel_radius=0.1,
    wheel_width=0.05,
)
OMNI = Drivetrain(
    axes=("front left", "rear left", "rear right", "front right"),
    wheels=tuple(
        Wheel(x=0.2 * math.cos(at), y=0.2 * math.sin(at), heading=at + math.pi / 2, axis=n, rollers=True)
        for n, at in enumerate(math.radians(degrees) for degrees in (45, 135, 225, 315))
    ),
    wheel_radius=0.1,
    wheel_width=0.05,
)
parts = st.floats(-3, 3)
EVERY_KIND = pytest.mark.parametrize("drivetrain", [SKID, DIFFERENTIAL, OMNI], ids=["skid", "differential", "omni"])


@EVERY_KIND
@given(v=parts, w=parts, side=parts)
def test_speeds_and_twist_are_inverses(drivetrain: Drivetrain, v: float, w: float, side: float) -> None:
    twist = Twist(v, w, side if drivetrain is OMNI else 0.0)
    assert astuple(drivetrain.twist(drivetrain.speeds(twist))) == pytest.approx(astuple(twist), abs=1e-9)


@EVERY_KIND
@given(v=parts, w=parts, side=parts, v_max=st.floats(0.05, 5))
def test_a_limit_slows_all_parts_alike(drivetrain: Drivetrain, v: float, w: float, side: float, v_max: float) -> None:
    twist = Twist(v, w, side if drivetrain is OMNI else 0.0)
    sent = drivetrain.limited(twist, v_max)
    fastest = max(map(abs, drivetrain.speeds(Twist(v_max, 0.0))))
    assert max(map(abs, drivetrain.speeds(sent))) <= fastest * (1 + 1e-9)
    scale = max((abs(part) for part in astuple(twist)), default=0.0)
    if scale > 1e-3:
        kept = [a / b for a, b in zip(astuple(sent), astuple(twist), strict=True) if abs(b) > 1e-6]
        assert kept == pytest.approx([kept[0]] * len(kept))
    if max(map(abs, drivetrain.speeds(twist))) <= fastest:
        assert sent == twist


def test_what_the_body_cannot_do_is_left_out_and_a_limit_of_nothing_stops_it() -> None:
    assert SKID.limited(Twist(0.2, 0.1, 5.0), 1.0) == Twist(0.2, 0.1)
    assert OMNI.limited(Twist(0.2, 0.1, 0.1), 1.0) == Twist(0.2, 0.1, 0.1)
    for v_max in (0.0, -1.0):
        assert SKID.limited(Twist(0.5, 0.1), v_max) == SKID.limited(STILL, v_max) == STILL


@EVERY_KIND
@pytest.mark.parametrize("twist", [Twist(1e308, 1e308), Twist(-1e308, 0.0), Twist(1e300, -1e308, 1e308)])
def test_a_limit_of_huge_numbers_is_finite(drivetrain: Drivetrain, twist: Twist) -> None:
    sent = drivetrain.limited(twist, 0.7)
    assert sent.is_finite
    assert 0.0 < max(map(abs, drivetrain.speeds(sent))) <= 7.0 * (1 + 1e-9)
    assert sent.v * twist.v >= 0.0


def test_skid_steer_goes_exactly_straight_and_wheels_alone_tell_how_a_differential_drive_turns() -> None:
    assert SKID.twist((3.3, 3.3)).w == SKID.twist((-3.3, 3.3)).v == 0.0
    assert DIFFERENTIAL.effective_track == pytest.approx(0.4)
    assert DIFFERENTIAL.twist((-1.0, 1.0)).w == pytest.approx(2 * 0.1 / 0.4)
    assert DIFFERENTIAL.with_track(0.5).twist((-1.0, 1.0)).w == pytest.approx(2 * 0.1 / 0.5)


def test_an_omni_drive_goes_sideways() -> None:
    speeds = OMNI.speeds(Twist(0.0, 0.0, 0.5))
    assert speeds == pytest.approx([0.5 / 0.1 * math.sin(at) for at in [w.heading for w in OMNI.wheels]])


def test_what_does_not_fit_together_is_refused_when_it_is_made() -> None:
    with pytest.raises(ValueError, match="wheels of the axes 0 to 1, got one of 2"):
        replace(DIFFERENTIAL, wheels=(*DIFFERENTIAL.wheels, Wheel(x=0.0, y=0.0, axis=2)))
    with pytest.raises(ValueError, match="rates of 2 axes, got those of 1"):
        replace(DIFFERENTIAL, rates=SKID.rates[:1])
    toed = tuple(Wheel(x=0.0, y=y, axis=n, heading=0.1 - 0.2 * n) for n, y in enumerate((0.2, -0.2)))
    for wheels, words in ((toed, "oppose each other"), (toed[:1], "'right'")):
        with pytest.raises(ValueError, match=words):
            Drivetrain(axes=("left", "right"), wheels=wheels, wheel_radius=0.1, wheel_width=0.05)
