"""The commands that show what goes over the bus, with a bus of the test's making."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
from click.testing import Result
from typer.testing import CliRunner

from vrg.bus.codec import Received, encode
from vrg.bus.messages import Clock, PlayerStatus, RefereeState, Stage
from vrg.bus.stopping import Stop
from vrg.bus.topics import Keys
from vrg.cli import make_app
from vrg.commands import sensors, topic
from vrg.commands.matches import Attached
from vrg.errors import LaunchError
from vrg.hal.sensors.battery import Battery

KEYS = Keys("m")
BATTERY = KEYS.sensor(Battery, "ann", "main").key


def clock(stamp: float) -> tuple[str, bytes]:
    now = Clock(time=stamp, tick=0, epoch=0, rate=1.0, estop=False)
    return KEYS.clock.key, encode(Received(KEYS.clock.key, stamp, 0, now))


ANN = PlayerStatus(name="ann", team="red", role="red", state="active", may_move=True, radius=0.3, pose=None, mark=None)
OVER = RefereeState(
    game="roboflag", stage=Stage.GAME_OVER, halted=None, way_out=None, waiting=(), clock=0.0, total=0.0, round=1,
    rounds=1, score={}, players=(ANN,), zones=(),
)  # fmt: skip


class Bus:
    """Has messages, which come as soon as somebody watches."""

    connected = True

    def __init__(self, *messages: tuple[str, bytes]) -> None:
        self.messages = list(messages)

    def watch_raw(self, _expression: str, arrived: Callable[[str, bytes], None]) -> None:
        while self.messages:
            arrived(*self.messages.pop(0))


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Result]:
    def command(bus: Bus, *arguments: str) -> Result:
        @contextmanager
        def listening(endpoint: str, _keys: object = None) -> Iterator[tuple[Stop, Bus]]:
            yield Stop(), bus

        for module in (sensors, topic):
            monkeypatch.setattr(module, "listening", listening)
        monkeypatch.setattr(topic, "which_match", lambda _: ("m", "tcp/127.0.0.1:1"))
        monkeypatch.setattr(sensors, "attached", lambda _: Attached("m", "tcp/127.0.0.1:1"))
        monkeypatch.setattr(sensors, "first_state", lambda *_: OVER)
        return CliRunner().invoke(make_app(), list(arguments))

    return command


Run = Callable[..., Result]


def test_an_echo_that_is_too_slow_loses_the_oldest_messages(run: Run) -> None:
    done = run(Bus(*(clock(float(number)) for number in range(1500))), "topic", "echo", "clock", "--count", "1")
    assert json.loads(done.stdout)["stamp"] == 500.0


def test_a_key_on_which_nothing_comes_has_no_gap(run: Run) -> None:
    assert json.loads(run(Bus(), "topic", "hz", "clock", "--json", "--count", "1").stdout) == {
        "hz": 0,
        "gap_max_ms": None,
    }
    assert run(Bus(), "topic", "hz", "clock", "--count", "1").stdout == "nothing came in the last second\n"


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
