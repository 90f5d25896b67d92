"""The commands that show what goes over the bus, with a bus of the test's making."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
from click.testing import Result
from typer.testing import CliRunner

from vrg.bus.codec import Received, encode
from vrg.bus.messages import Clock
from vrg.bus.stopping import Stop
from vrg.bus.topics import Keys
from vrg.cli import make_app
from vrg.commands import sensors, topic
from vrg.hal.sensors.battery import Battery

KEYS = Keys("m")
BATTERY = KEYS.sensor(Battery, "ann", "main").key


def clock(stamp: float) -> tuple[str, bytes]:
    now = Clock(time=stamp, tick=0, epoch=0, rate=1.0, estop=False)
    return KEYS.clock.key, encode(Received(KEYS.clock.key, stamp, 0, now))


class Bus:
    """Has messages, which come as soon as somebody watches."""

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
            monkeypatch.setattr(module, "which_match", lambda match, router: ("m", "tcp/127.0.0.1:1"))
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
    done = run(Bus(reading, clock(9.5)), "sensors", "ann", "--seconds", "0.5")
    assert "match time 9.5 s" in done.stdout
    assert done.stdout.splitlines()[-1].split() == ["battery", "main", "7.50", "charge", "0.5"]
