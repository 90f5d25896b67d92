"""What the user of a replay does; time is told, not measured."""

import math

import pytest

from vrg.ui.playback import SPEEDS, Playback

INSTANTS = [tick / 10 for tick in range(10, 201)]
CALLS = [3.0, 8.0, 8.0, 15.0]


def begun(**changes):
    playback = Playback.of(INSTANTS, CALLS, 20.5)
    return playback if not changes else Playback(**{**vars(playback), **changes})


def paused(time):
    return begun(time=time, playing=False)


def test_it_begins_at_the_first_instant_and_plays():
    playback = begun()
    assert (playback.time, playback.begin, playback.end, playback.speed, playback.playing) == (
        1.0,
        1.0,
        20.5,
        1.0,
        True,
    )


@pytest.mark.parametrize("speed", SPEEDS)
def test_match_time_passes_at_the_speed(speed):
    assert begun(speed=speed).advance(0.5).time == pytest.approx(1.0 + 0.5 * speed)


def test_frames_of_any_length_come_to_the_same_time():
    short = begun()
    for _ in range(30):
        short = short.advance(1 / 30)
    assert short.time == pytest.approx(begun().advance(1.0).time)


def test_time_stands_still_while_it_is_paused():
    playback = begun().toggle()
    assert not playback.playing
    assert playback.advance(3.0) == playback
    assert playback.toggle().advance(3.0).time == 4.0


def test_it_pauses_at_the_end_and_not_beyond():
    playback = begun(time=20.0).advance(7.0)
    assert (playback.time, playback.playing, playback.over) == (20.5, False, True)


def test_to_go_on_at_the_end_is_to_begin_again():
    playback = paused(20.5).toggle()
    assert (playback.time, playback.playing) == (1.0, True)


@pytest.mark.parametrize(("asked", "there"), [(-5.0, 1.0), (1.0, 1.0), (7.25, 7.25), (20.5, 20.5), (math.inf, 20.5)])
def test_no_instant_is_outside_of_the_recording(asked, there):
    assert begun().to(asked).time == there


def test_going_elsewhere_neither_pauses_nor_goes_on():
    for move in (Playback.skip_on, Playback.skip_back, Playback.next_call, Playback.previous_call, Playback.to_begin):
        assert move(begun(time=9.0)).playing
        assert not move(paused(9.0)).playing


def test_a_step_is_to_the_next_instant_that_was_recorded_and_pauses():
    playback = begun(time=5.0).step_on()
    assert (playback.time, playback.playing) == (5.1, False)
    assert playback.step_back().time == 5.0


def test_a_step_from_between_two_instants_goes_to_one_of_them():
    assert paused(5.04).step_on().time == 5.1
    assert paused(5.04).step_back().time == 5.0


def test_steps_end_at_the_ends():
    assert paused(1.0).step_back().time == 1.0
    assert paused(20.0).step_on().time == 20.5, "the referee was heard after the last poses"
    assert paused(20.5).step_on().time == 20.5
    assert paused(20.5).step_back().time == 20.0


def test_every_instant_is_reached_by_steps_in_both_directions():
    playback, there = paused(1.0), [1.0]
    while not playback.over:
        playback = playback.step_on()
        there.append(playback.time)
    assert there == [*INSTANTS, 20.5]
    while playback.time > playback.begin:
        playback = playback.step_back()
        there.append(playback.time)
    assert there[len(INSTANTS) + 1 :] == INSTANTS[::-1]


def test_speeds_go_from_a_quarter_to_sixteen():
    playback, up = begun(), []
    for _ in range(6):
        playback = playback.faster()
        up.append(playback.speed)
    assert up == [2.0, 4.0, 8.0, 16.0, 16.0, 16.0]
    down = []
    for _ in range(8):
        playback = playback.slower()
        down.append(playback.speed)
    assert down == [8.0, 4.0, 2.0, 1.0, 0.5, 0.25, 0.25, 0.25]


def test_a_change_of_speed_does_not_move_time():
    assert begun(time=6.0).faster().time == begun(time=6.0).slower().time == 6.0


def test_skips_are_five_seconds():
    assert begun(time=9.0).skip_on().time == 14.0
    assert begun(time=9.0).skip_back().time == 4.0
    assert begun(time=3.0).skip_back().time == 1.0
    assert begun(time=18.0).skip_on().time == 20.5


def test_calls_one_after_the_other():
    playback, there = paused(1.0), []
    for _ in range(4):
        playback = playback.next_call()
        there.append(playback.time)
    assert there == [3.0, 8.0, 15.0, 15.0], "two calls at once are one place; after the last one there is none"
    there = []
    for _ in range(4):
        playback = playback.previous_call()
        there.append(playback.time)
    assert there == [8.0, 3.0, 1.0, 1.0]


def test_back_from_a_call_that_has_just_been_played_is_to_the_one_before():
    assert begun(time=8.4).previous_call().time == 3.0
    assert begun(time=9.4).previous_call().time == 8.0
    assert begun(time=10.0, speed=4.0).previous_call().time == 3.0
    assert paused(8.4).previous_call().time == 8.0


def test_without_calls_the_keys_of_calls_do_no_harm():
    playback = Playback.of(INSTANTS, [], 20.0).to(5.0)
    assert playback.next_call().time == 5.0
    assert playback.previous_call().time == 1.0


def test_time_stands_still_while_the_knob_is_held_and_goes_on_after():
    held = begun().grab(6.0)
    assert (held.advance(2.0).time, held.playing) == (6.0, True)
    dragged = held.drag(11.0)
    assert dragged.advance(2.0).time == 11.0
    assert dragged.release().advance(2.0).time == 13.0


def test_a_paused_replay_stays_paused_when_the_knob_is_let_go():
    assert paused(2.0).grab(6.0).release().advance(2.0).time == 6.0


def test_a_mouse_that_holds_no_knob_moves_nothing():
    assert begun(time=4.0).drag(11.0).time == 4.0


def test_a_recording_of_one_instant():
    playback = Playback.of([2.0], [], 2.0)
    for move in (Playback.step_on, Playback.step_back, Playback.skip_on, Playback.previous_call, Playback.toggle):
        assert move(playback).time == 2.0
    assert not playback.advance(0.1).playing
