"""The server in this process: what its tools ask for, and how it refuses what they cannot take."""

import asyncio
import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from mcp_client import SMALL, answer_of

from vrg.errors import ConfigError
from vrg.launch.sandbox.seal import missing
from vrg.testing.command_line import invoke
from vrg_mcp.knowledge import matches
from vrg_mcp.players import PlayerFolder
from vrg_mcp.server import Server, Tools, server_of
from vrg_mcp.work import KEPT, _tidy


@pytest.fixture
def server(tmp_path: Path) -> Server:
    (tmp_path / "small.toml").write_text(SMALL)
    return server_of(PlayerFolder(tmp_path / "players"), matches([tmp_path / "small.toml"]), official=True)


def called(server: Server, tool: str, **arguments: Any) -> dict[str, Any]:
    result = asyncio.run(server.call_tool(tool, arguments))
    return answer_of(result)  # type: ignore[arg-type]


def test_an_optional_argument_that_is_null_has_its_default(server: Server) -> None:
    assert called(server, "read_api", topic=None) == called(server, "read_api")
    assert not called(server, "read_api", topic=None)["wrong"]


def test_no_schema_has_additional_properties_which_some_clients_refuse(server: Server) -> None:
    tools = asyncio.run(server.list_tools())
    assert len(tools) > 10
    for tool in tools:
        assert "additionalProperties" not in json.dumps(tool.input_schema), tool.name
        assert tool.input_schema["type"] == "object"
    [strategies] = [t.input_schema["properties"]["strategies"] for t in tools if t.name == "play_match"]
    assert strategies["type"] == "object"
    assert "minnows" in strategies["description"]


@pytest.mark.parametrize(
    ("tool", "arguments", "words"),
    [
        ("read_api", {"topic": 5}, "topic: expected a text, got 5"),
        ("read_player", {}, "file: missing"),
        ("write_player", {"file": "ann.py", "code": None}, "code: missing"),
        ("picture", {"run": "x", "time": "noon"}, "time: expected a number, got 'noon'"),
        ("play_match", {"match": "small", "strategies": {"minnows": None}}, "strategies.minnows: expected a text"),
        ("play_match", {"match": "small", "strategies": ["ann.py"]}, "strategies: expected a table, got"),
        ("play_match", {"match": "small", "strategies": {}, "seed": 10**400}, "from 0 to 1e+06, got one far outside"),
        ("compare", {"first": "x", "second": "y", "match": "small", "games": 2.5}, "games: expected a whole number"),
        ("decide", {"action": "pause", "reason": ""}, "action: expected 'halt', 'resume' or 'end'"),
        ("play_mach", {}, "did you mean 'play_match'"),
    ],
)
def test_what_a_tool_cannot_take_is_refused_in_words(
    server: Server, tool: str, arguments: dict[str, Any], words: str
) -> None:
    found = called(server, tool, **arguments)
    assert found["wrong"]
    assert words in found["answer"]
    assert not {"pydantic", "Traceback", "validation error"} & {word for word in str(found).split() if word}
    assert "\n" not in found["answer"]


def test_a_folder_that_is_gone_is_told_and_so_is_a_mistake_of_a_tool(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.rmtree(tmp_path / "players")
    assert "the folder of the players cannot be read: No such file" in called(server, "list_folder")["answer"]

    def broken(_: object) -> list[str]:
        raise ZeroDivisionError("division by zero in /home/ann/secret.py")

    monkeypatch.setattr(PlayerFolder, "names", broken)
    found = called(server, "list_folder")
    assert found["wrong"]
    assert "mistake in VRG" in found["answer"]
    [fault] = found["quoted"]["faults"]
    assert fault["text"].startswith("ZeroDivisionError: division by zero")
    assert "/home/ann" not in str(found)


@pytest.mark.skipif(missing() is not None, reason="this machine cannot seal")
def test_a_path_may_begin_with_the_home_folder_as_no_shell_has_read_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.toml").write_text(SMALL)
    served: list[Tools] = []
    monkeypatch.setattr(Server, "run", lambda self, _: served.append(self))
    done = invoke("mcp", "~/players", "--match", "~/small.toml")
    assert done.exit_code == 0, done.output
    assert len(served) == 1
    assert (tmp_path / "players" / "agent-runs").is_dir()
    assert not (tmp_path / "~").exists()
    done = invoke("mcp", "~nobody-of-this-name/players")
    assert isinstance(done.exception, ConfigError)
    assert "found no home folder for ~nobody-of-this-name: write it out" in str(done.exception)


def test_runs_and_comparisons_keep_little_of_what_code_has_written_and_the_newest_alone(tmp_path: Path) -> None:
    for number in range(KEPT + 3):
        folder = tmp_path / f"compare-{number}"
        for name in ("failures/a-1/logs/ann.log", "logs/bob.log", "players/ann/big.bin", "playing/a-1/ann/big.bin"):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(b"x" * 300_000)
        (folder / "games.jsonl").write_text("{}")
    _tidy(folder)
    assert len(list(tmp_path.iterdir())) == KEPT
    kept = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
    assert "games.jsonl" in kept
    assert not [name for name in kept if name.endswith(".bin")]
    assert max(path.stat().st_size for path in folder.rglob("*.log")) <= 100_000
