"""The commands that show what goes over the bus and what a camera sees, with a bus of the test's making."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result

from vrg.bus.codec import Received, encode
from vrg.bus.mailbox import Outgoing
from vrg.bus.messages import CameraRequest, Clock, PlayerStatus, Stage
from vrg.bus.stopping import Stop
from vrg.bus.topics import Keys
from vrg.commands import sensors, topic
from vrg.commands.matches import Attached
from vrg.config.setup import unknown_match
from vrg.errors import BusError, ConfigError, LaunchError
from vrg.hal.sensors import png
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.camera import Camera
from vrg.testing.command_line import invoke
from vrg.testing.views import synthetic

KEYS = Keys("m")
BATTERY = KEYS.sensor(Battery, "ann", "main").key
TAKEN = Camera(fov=1.0, data=png.encode(np.full((4, 6, 3), 90, dtype=np.uint8)))


def clock(stamp: float) -> tuple[str, bytes]:
    now = Clock(time=stamp, tick=0, epoch=0, rate=1.0, estop=False)
    return KEYS.clock.key, encode(Received(KEYS.clock.key, stamp, 0, now))


ANN = PlayerStatus(name="ann", team="red", role="red", state="active", may_move=True, radius=0.3, pose=None, mark=None)
OVER = synthetic.state(0.0, stage=Stage.GAME_OVER, players=(ANN,))


class Bus:
    """Has messages, which come as soon as somebody watches, and pictures of ann's, one for each request."""

    connected = True

    def __init__(self, *messages: tuple[str, bytes], pictures: tuple[bytes, ...] = ()) -> None:
        self.messages, self.pictures = list(messages), list(pictures)
        self.asked: list[CameraRequest] = []

    def watch_raw(self, expression: str, arrived: Callable[[str, bytes], None]) -> None:
        self.watched, self._arrived = expression, arrived
        while self.messages:
            arrived(*self.messages.pop(0))

    def send(self, outgoing: list[Outgoing]) -> None:
        [out] = outgoing
        assert out.message.key == KEYS.camera_request("ann").key
        assert isinstance(out.message.body, CameraRequest)
        self.asked.append(out.message.body)
        if self.pictures:
            self._arrived(KEYS.sensor(Camera, "ann", "main").key, self.pictures.pop(0))


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Result]:
    def command(bus: Bus, *arguments: str) -> Result:
        @contextmanager
        def listening(endpoint: str, _keys: object = None) -> Iterator[tuple[Stop, Bus]]:
            yield Stop(), bus

        for module in (sensors, topic):
            monkeypatch.setattr(module, "listening", listening)
        monkeypatch.setattr(topic, "which_match", lambda _: ("m", "tcp/127.0.0.1:1"))
        monkeypatch.setattr(sensors, "attached", lambda _: Attached("m", "tcp/127.0.0.1:1", None, unknown_match("m")))
        monkeypatch.setattr(sensors, "first_state", lambda *_: OVER)
        monkeypatch.setattr(sensors, "RENEW", 0.0)
        monkeypatch.setattr(sensors, "PICTURE_TIMEOUT", 5.0 if bus.pictures else 0.2)
        return invoke(*arguments)

    return command


Run = Callable[..., Result]


def test_an_echo_that_is_too_slow_loses_the_oldest_messages(run: Run) -> None:
    done = run(Bus(*(clock(float(number)) for number in range(1500))), "topic", "echo", "clock", "--count", "1")
    assert json.loads(done.stdout)["stamp"] == 500.0


def test_a_key_on_which_nothing_comes_has_no_gap(run: Run) -> None:
    key = KEYS.clock.key
    assert json.loads(run(Bus(), "topic", "hz", "clock", "--json", "--count", "1").stdout) == {
        "key": key,
        "hz": 0,
        "gap_max_ms": None,
    }
    said = run(Bus(), "topic", "hz", "clock", "--count", "1").stdout
    assert said == f"{key}: nothing came in the last second\n"


def test_each_key_of_a_pattern_has_its_line(run: Run) -> None:
    bus = Bus(*[clock(0.1 * n) for n in range(3)], (BATTERY, encode(Received(BATTERY, 2.0, 0, Battery(charge=0.5)))))
    lines = run(bus, "topic", "hz", "**", "--count", "1").stdout.splitlines()
    assert [line.split(": ")[0] for line in lines] == [KEYS.clock.key, BATTERY]
    assert run(Bus(), "topic", "hz", "robot/*/state", "--count", "1").stdout.endswith("nothing has come yet\n")


def test_the_table_of_sensors_tells_how_old_the_newest_readings_are(run: Run) -> None:
    reading = BATTERY, encode(Received(BATTERY, 2.0, 0, Battery(charge=0.5)))
    done = run(Bus(reading, clock(9.5)), "show", "sensors", "ann", "--for", "0.5")
    assert "match time 9.5 s" in done.stdout
    assert done.stdout.splitlines()[-1].split() == ["battery", "main", "7.50", "charge", "0.5"]


def test_what_sensors_measure_is_told_in_a_pipe_until_the_match_is_over(run: Run) -> None:
    key = KEYS.referee_state.key
    reading = BATTERY, encode(Received(BATTERY, 2.0, 0, Battery(charge=0.5)))
    done = run(Bus(reading, (key, encode(Received(key, 3.0, 0, OVER)))), "show", "sensors", "ann")
    assert (done.exit_code, done.stdout) == (0, "2.00 battery main: charge 0.5\n")


def test_the_sensors_of_nobody_are_refused_with_a_guess(run: Run) -> None:
    done = run(Bus(), "show", "sensors", "anne")
    assert isinstance(done.exception, LaunchError)
    assert "expected one of ann, got 'anne', did you mean 'ann'?" in str(done.exception)


def seen(stamp: float) -> bytes:
    return encode(Received(KEYS.sensor(Camera, "ann", "main").key, stamp, 0, TAKEN))


def test_a_picture_is_asked_for_and_saved_and_what_is_none_is_passed_over(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "seen.png"
    bus = Bus(pictures=(b"junk", seen(1.0).replace(b"PNG", b"GIF"), seen(12.5)))
    done = run(bus, "show", "camera", "ann", "--output", str(file))
    assert (done.exit_code, bus.watched) == (0, KEYS.sensor(Camera, "ann").key), done.output
    assert done.output == f"{file}: what ann saw at match time 12.5 s, 6 x 4 pixels\n"
    assert file.read_bytes() == TAKEN.data
    assert [request.lease > 0 for request in bus.asked] == [True] * 3, "it goes on asking"


def test_a_robot_that_nobody_knows_ends_in_words(run: Run, tmp_path: Path) -> None:
    done = run(Bus(), "show", "camera", "ann", "--output", str(tmp_path / "seen.png"))
    assert isinstance(done.exception, BusError)
    assert "ann: no picture from its camera within 0.2 s" in str(done.exception)


@pytest.mark.parametrize(("file", "words"), [("seen.jpg", "ends in .png"), ("no/where.png", "cannot be written")])
def test_a_file_that_cannot_be_written_is_told(run: Run, tmp_path: Path, file: str, words: str) -> None:
    done = run(Bus(pictures=(seen(1.0),)), "show", "camera", "ann", "--output", str(tmp_path / file))
    assert isinstance(done.exception, ConfigError)
    assert words in str(done.exception)
