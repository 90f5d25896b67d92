"""The command `vrg show camera`, with a bus and a world of its own making."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result
from typer.testing import CliRunner

from vrg.bus.codec import Received, encode
from vrg.bus.mailbox import Outgoing
from vrg.bus.messages import CameraRequest
from vrg.bus.stopping import Stop
from vrg.bus.topics import Keys
from vrg.cli import make_app
from vrg.commands import sensors
from vrg.commands.matches import Attached
from vrg.errors import BusError, ConfigError
from vrg.hal.sensors import png
from vrg.hal.sensors.camera import Camera

KEYS = Keys("m")
TAKEN = Camera(fov=1.0, data=png.encode(np.full((4, 6, 3), 90, dtype=np.uint8)))
FROM_ANN = KEYS.sensor(Camera, "ann", "main").key


def seen(stamp: float) -> bytes:
    return encode(Received(FROM_ANN, stamp, 0, TAKEN))


class World:
    """Answers the requests for pictures of one robot."""

    def __init__(self, *answers: bytes) -> None:
        self.answers = list(answers)
        self.asked: list[CameraRequest] = []
        self._arrived: Callable[[str, bytes], None] = lambda key, payload: None

    def watch_raw(self, expression: str, arrived: Callable[[str, bytes], None]) -> None:
        assert expression == KEYS.sensor(Camera, "ann").key
        self._arrived = arrived

    def send(self, outgoing: list[Outgoing]) -> None:
        [out] = outgoing
        assert out.message.key == KEYS.camera_request("ann").key
        assert isinstance(out.message.body, CameraRequest)
        self.asked.append(out.message.body)
        if self.answers:
            self._arrived(FROM_ANN, self.answers.pop(0))


@pytest.fixture
def ask(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Result]:
    def run(world: World, *arguments: str, patience: float = 5.0) -> Result:
        @contextmanager
        def listening(endpoint: str, _keys: object = None) -> Iterator[tuple[Stop, World]]:
            yield Stop(), world

        monkeypatch.setattr(sensors, "listening", listening)
        monkeypatch.setattr(sensors, "attached", lambda _: Attached("m", "tcp/127.0.0.1:1"))
        monkeypatch.setattr(sensors, "first_state", lambda *_: None)
        monkeypatch.setattr(sensors, "RENEW", 0.0)
        monkeypatch.setattr(sensors, "PICTURE_TIMEOUT", patience)
        return CliRunner().invoke(make_app(), ["show", "camera", *arguments])

    return run


def test_a_picture_is_asked_for_and_saved(ask: Callable[..., Result], tmp_path: Path) -> None:
    world, file = World(seen(12.5)), tmp_path / "seen.png"
    done = ask(world, "ann", "--output", str(file))
    assert done.exit_code == 0, done.output
    assert done.output == f"{file}: what ann saw at match time 12.5 s, 6 x 4 pixels\n"
    assert file.read_bytes() == TAKEN.data
    assert world.asked[0].lease > 0


def test_what_is_no_picture_is_passed_over(ask: Callable[..., Result], tmp_path: Path) -> None:
    world = World(b"junk", seen(1.0).replace(b"PNG", b"GIF"), seen(2.0))
    done = ask(world, "ann", "--output", str(tmp_path / "seen.png"))
    assert "match time 2.0 s" in done.output
    assert len(world.asked) == 3, "it goes on asking"


def test_a_robot_that_nobody_knows_ends_in_words(ask: Callable[..., Result], tmp_path: Path) -> None:
    done = ask(World(), "ann", "--output", str(tmp_path / "seen.png"), patience=0.2)
    assert isinstance(done.exception, BusError)
    assert "ann: no picture of its camera within 0.2 s" in str(done.exception)


@pytest.mark.parametrize(("file", "words"), [("seen.jpg", "ends in .png"), ("no/where.png", "cannot be written")])
def test_a_file_that_cannot_be_written_is_told(
    ask: Callable[..., Result], tmp_path: Path, file: str, words: str
) -> None:
    done = ask(World(seen(1.0)), "ann", "--output", str(tmp_path / file))
    assert isinstance(done.exception, ConfigError)
    assert words in str(done.exception)
