"""What the tests of comparisons share."""

from collections.abc import Callable, Iterator
from pathlib import Path
from unittest import mock

import pytest
from experiments import Never, Play, experiment, match, unsealed

from vrg.bus.stopping import StopSignal
from vrg.launch.fork_server import ForkServer
from vrg.testing.command_line import Vrg, command_line
from vrg.testing.processes.warm import Warm, WarmServers
from vrg_league import game_process
from vrg_league.games import GameRecord
from vrg_league.workers import Workers

__all__ = ["match"]


@pytest.fixture(scope="session", autouse=True)
def _warm_games(warm_servers: WarmServers) -> Iterator[None]:
    """Games are played by forks of one server, too."""
    make = game_process.server_for

    def server_for(game: str, engine: str) -> ForkServer:
        def started() -> Warm:
            with mock.patch.object(game_process, "ForkServer", Warm):
                server = make(game, engine)
            assert isinstance(server, Warm)
            return server

        return warm_servers.kept(started, "game", game, engine)

    with pytest.MonkeyPatch.context() as patch:
        for module in ("contenders", "workers"):
            patch.setattr(f"vrg_league.{module}.server_for", server_for)
        yield


@pytest.fixture
def play(match: Path) -> Play:
    """Plays a comparison of two strategies of `players.py` or of registered ones, and returns the games that count."""

    def run(
        first: str,
        second: str,
        out: str = "out",
        *,
        pairs: int = 2,
        jobs: int = 2,
        seed: int = 0,
        sealed: bool = False,
        limit: float = 3600.0,
        stop: StopSignal | None = None,
        told: Callable[[GameRecord], None] = lambda _: None,
    ) -> list[GameRecord]:
        if not sealed:
            unsealed(match)
        with experiment(match, first, second, out, pairs=pairs, seed=seed, limit=limit) as running:
            running.run(Workers(jobs, running.folder, running.setup), stop or Never(), told)
            return running.rows()

    return run


@pytest.fixture
def vrg(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], match: Path) -> Vrg:
    """Run the command line in this process, in the folder of the match."""
    monkeypatch.chdir(match.parent)
    return command_line(monkeypatch, capsys)
