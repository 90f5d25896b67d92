"""Frames of capture systems: from real packets, and when nothing, or nonsense, comes."""

import io
import math
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator

import msgspec
import pytest

from mocap.natnet import Server, Shown
from mocap.vrpn import Trackers
from vrg.testing.waiting import wait_until
from vrg_locate import stream as streams
from vrg_locate.mocap import stream as module
from vrg_locate.mocap.frames import MocapFrame, Request, Trouble, encode, read
from vrg_locate.mocap.stream import FrameStream

Make = Callable[..., FrameStream]
ANN = Shown((1.0, 2.0, 0.2), (0.0, 0.0, math.sin(0.5), math.cos(0.5)))
MOCK = Request(
    "mock", {"rigid_bodies": "ann(1,2,0.25,1,0,0,0);bob(3,4,0.25,0.6,0,0,0.8)", "frequency": "100"}, 50.0, 3.0
)


@pytest.fixture
def make(monkeypatch: pytest.MonkeyPatch) -> Iterator[Make]:
    monkeypatch.setattr(streams, "RETRY_PERIOD", 0.05)
    made: list[FrameStream] = []

    def begun(*values: object) -> FrameStream:
        made.append(FrameStream(*values))  # type: ignore[arg-type]
        made[-1].start()
        return made[-1]

    yield begun
    for stream in made:
        stream.close()
        stream.close()
        process = stream._process
        assert process is None or process.poll() is not None, "a process that nobody needs goes on"


@pytest.fixture
def server() -> Iterator[Server]:
    made = Server(["ann", "bob"])
    yield made
    made.close()


def natnet(server: Server, patience: float = 3.0) -> Request:
    options = {"hostname": "localhost", "port_command": str(server.port), "interface_ip": "127.0.0.1"}
    return Request("optitrack", options, 50.0, patience)


def newest(stream: FrameStream) -> MocapFrame:
    """The newest of the next frames."""
    found: list[MocapFrame] = []
    wait_until(lambda: found.extend(stream.take()) or found, "a frame")
    return found[-1]


def until(stream: FrameStream, words: str) -> None:
    """Wait for a problem of which these words tell."""
    wait_until(lambda: words in (stream.problem() or ""), words)


def test_the_library_s_own_mock_is_read(make: Make) -> None:
    frame = newest(make(MOCK))
    bodies = {body.name: body for body in frame.bodies}
    assert bodies["ann"].position == (1.0, 2.0, 0.25)
    assert bodies["bob"].rotation == pytest.approx((0.6, 0.0, 0.0, 0.8), abs=1e-6)


def test_packets_of_natnet_are_read_but_not_bodies_that_are_not_tracked(make: Make, server: Server) -> None:
    server.shown = {"ann": ANN, "bob": Shown((3.0, 4.0, 0.2), tracked=False)}
    stream = make(natnet(server))
    (ann,) = newest(stream).bodies
    assert ann.name == "ann"
    assert ann.position == pytest.approx((1.0, 2.0, 0.2), abs=2e-3)
    assert ann.rotation == pytest.approx((math.cos(0.5), 0.0, 0.0, math.sin(0.5)), abs=1e-6)
    assert stream.problem() is None
    server.shown = {"ann": ANN, "bob": Shown((3.0, 4.0, 0.2))}
    wait_until(lambda: [body.name for body in newest(stream).bodies] == ["ann", "bob"], "both bodies")


def test_a_system_that_falls_silent_is_told_of_and_found_again(make: Make, server: Server) -> None:
    server.shown = {"ann": ANN}
    stream = make(natnet(server, patience=0.5))
    newest(stream)
    server.silent = True
    until(stream, "nothing was received from localhost for 0.5 s")
    stream.take()
    server.silent = False
    newest(stream)
    assert stream.problem() is None
    assert server.connections >= 2


def test_a_body_that_is_made_later_has_no_name_before_the_next_connection(make: Make, server: Server) -> None:
    server.names = ["ann", "bob", "late"]
    stream = make(natnet(server, patience=0.5))
    server.shown = {"ann": ANN}
    newest(stream)
    server.names = ["ann", "bob", "late", "later"]
    server.shown = {"ann": ANN, "late": ANN, "later": ANN}
    wait_until(lambda: [body.name for body in newest(stream).bodies] == ["", "ann", "late"], "a body without a name")
    server.silent = True
    until(stream, "nothing was received")
    server.silent = False
    wait_until(lambda: [body.name for body in newest(stream).bodies] == ["ann", "late", "later"], "its name")


def test_a_system_that_is_not_there_holds_nothing_up(make: Make) -> None:
    """The library would wait for an answer without an end, and keep all threads of its process from running."""
    server = Server([])
    server.silent = True
    stream = make(natnet(server, patience=0.3))
    until(stream, "nothing was received from localhost for 0.3 s")
    server.close()
    until(make(Request("optitrack", {"hostname": "no.such.host.invalid"}, 50.0, 30.0)), "no.such.host.invalid: ")
    until(make(Request("nonsense", {}, 50.0, 3.0)), "Unknown motion capture type")


def test_a_system_that_sees_no_body_is_told_of(make: Make, server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "SILENCE", 0.3)
    stream = make(natnet(server))
    assert newest(stream).bodies == []
    until(stream, "localhost has shown no rigid body for")
    server.shown = {"ann": ANN}
    wait_until(lambda: stream.problem() is None, "a body")


def test_each_pose_of_each_tracker_of_vrpn_is_used_although_empty_frames_come_between(make: Make) -> None:
    """The library looks a hundred times a second for what has come by then."""
    trackers = Trackers(["ann", "bob"])
    stream = make(Request("vrpn", {"hostname": f"127.0.0.1:{trackers.port}"}, 50.0, 30.0))
    frames: list[MocapFrame] = []

    def came(name: str, x: float) -> bool:
        frames.extend(stream.take())
        return any((body.name, body.position[0]) == (name, x) for frame in frames for body in frame.bodies)

    def some_empty_frames_came() -> bool:
        frames.extend(stream.take())
        return sum(not frame.bodies for frame in frames) >= 5

    try:
        wait_until(trackers.connected.is_set, "the library")
        for name in ("ann", "bob"):
            # The library listens to a tracker some time after it has heard its name.
            wait_until(lambda name=name: trackers.show(name, -1.0) or came(name, -1.0), f"{name} for the first time")
        for number in range(20):
            frames.clear()
            wait_until(some_empty_frames_came, "empty frames, so that the next pose is due")
            for name in ("ann", "bob"):
                trackers.show(name, number)
            for name in ("ann", "bob"):
                wait_until(lambda name=name, x=number: came(name, x), f"pose {number} of {name}")
    finally:
        trackers.close()


def test_a_library_that_crashes_is_told_of_and_started_again(make: Make) -> None:
    code = "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)"
    until(make(MOCK, lambda: 0.0, (sys.executable, "-c", code)), "has ended with status -11: does `system` fit")


def test_the_reader_ends_with_the_match_that_started_it() -> None:
    command = (sys.executable, "-P", "-m", "vrg_locate.mocap.reader", msgspec.json.encode(MOCK).decode())
    with subprocess.Popen(command, stdout=subprocess.PIPE) as reader:
        assert reader.stdout is not None
        assert isinstance(read(reader.stdout), MocapFrame)
        reader.send_signal(signal.SIGINT)
        assert isinstance(read(reader.stdout), MocapFrame), "what is typed at the terminal is for the match"
        reader.stdout.close()
        assert reader.wait(60.0) == 0


def test_messages_are_whole_or_none() -> None:
    data = encode(Trouble("no")) + encode(MocapFrame(1.0, []))
    stream = io.BytesIO(data[:-1])
    assert read(stream) == Trouble("no")
    assert read(stream) is None
