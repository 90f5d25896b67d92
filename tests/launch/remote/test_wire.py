import os

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import inspect

from tests.bus.test_codec import drawn
from vrg.errors import MessageError
from vrg.launch.remote import wire
from vrg.launch.remote.channel import MAX_BATCH, Channel
from vrg.launch.remote.wire import BANNER, MAX_MESSAGE_SIZE, Frames, ToAgent, ToLauncher, frame

TO_LAUNCHER = drawn(inspect.type_info(ToLauncher))


def fed(frames: Frames[wire.ToLauncher], data: bytes) -> list[wire.ToLauncher]:
    frames.feed(data)
    return list(iter(frames.next, None))


def launcher_frames(banner: bytes = b"") -> Frames[ToLauncher]:
    return Frames(ToLauncher, banner)  # type: ignore[arg-type]


def agent_frames() -> Frames[ToAgent]:
    return Frames(ToAgent)  # type: ignore[arg-type]


@given(messages=st.lists(TO_LAUNCHER, max_size=6), cuts=st.lists(st.integers(1, 60), min_size=1, max_size=20))
def test_messages_come_through_however_the_stream_is_cut(messages: list[wire.ToLauncher], cuts: list[int]) -> None:
    stream = b"Welcome to lab2\n" + BANNER + b"".join(frame(message) for message in messages)
    frames, found = launcher_frames(BANNER), []
    while stream:
        size = cuts[len(stream) % len(cuts)]
        found += fed(frames, stream[:size])
        stream = stream[size:]
    assert found == messages
    assert frames.skipped.startswith(b"W") or not messages


def test_what_came_in_place_of_the_banner_can_be_told() -> None:
    frames = launcher_frames(BANNER)
    assert fed(frames, b"x" * 5000 + b"vrg: unknown command 'host'\n") == []
    assert frames.skipped.endswith(b"unknown command 'host'\n")
    assert len(frames.skipped) == 2000


@pytest.mark.parametrize(
    "data", [b"\xff" * 8, (MAX_MESSAGE_SIZE + 1).to_bytes(4, "big"), b"\0\0\0\x01\x05", b"\0\0\0\x02[]"]
)
def test_other_bytes_are_refused(data: bytes) -> None:
    with pytest.raises(MessageError, match="expected"):
        fed(launcher_frames(), data)


def test_an_answer_is_no_order() -> None:
    frames = agent_frames()
    frames.feed(frame(wire.Done(1)))
    with pytest.raises(MessageError):
        frames.next()


def test_a_message_that_is_too_long_is_not_sent() -> None:
    with pytest.raises(ValueError, match="at most"):
        frame(wire.Failed("x" * (MAX_MESSAGE_SIZE + 1)))


class Pipes:
    """Two channels that are connected to one another."""

    def __init__(self) -> None:
        to_agent, to_launcher = os.pipe(), os.pipe()
        self.launcher = Channel(to_launcher[0], to_agent[1], launcher_frames())
        self.agent = Channel(to_agent[0], to_launcher[1], agent_frames())


def test_a_channel_does_not_wait_for_a_side_that_does_not_read() -> None:
    pipes = Pipes()
    parts = [wire.FilePart(f"file{n}", bytes([n]) * wire.PART, begins=True) for n in range(8)]
    for part in parts:
        pipes.launcher.send(part)
    assert pipes.launcher.backlog > 0
    found: list[wire.ToAgent] = []
    while len(found) < len(parts):
        pipes.launcher.pump()
        found += pipes.agent.pump(1.0)
    assert found == parts
    assert pipes.launcher.backlog == 0


def test_what_is_sent_without_end_is_taken_in_bit_by_bit() -> None:
    pipes = Pipes()
    for number in range(2 * MAX_BATCH):
        pipes.agent.send(wire.Done(number))
    found = pipes.launcher.pump()
    assert 0 < len(found) < MAX_BATCH
    while len(found) < 2 * MAX_BATCH:
        found += pipes.launcher.pump()
    assert found == [wire.Done(number) for number in range(2 * MAX_BATCH)]


def test_a_channel_tells_that_the_other_side_is_gone_and_keeps_what_came_before() -> None:
    pipes = Pipes()
    pipes.agent.send(wire.Failed("no disk"))
    pipes.agent.close()
    assert pipes.launcher.pump() == [wire.Failed("no disk")]
    pipes.launcher.send(wire.Fetch())
    pipes.launcher.pump()
    assert pipes.launcher.closed
    assert pipes.launcher.pump() == []
    pipes.launcher.close()
    pipes.launcher.close()
