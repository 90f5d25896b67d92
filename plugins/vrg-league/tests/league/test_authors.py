"""Authors that are programs: what they find, what they may do, and what becomes of what they write."""

import json
import os
import shutil
import socket
import subprocess
from pathlib import Path

import pytest

from tests.command_line import Vrg, with_vrg
from tests.requirements import missing as lacking
from vrg.errors import ConfigError
from vrg.launch.sandbox.seal import missing
from vrg_league.league.authors import read_authors

ARENA = Path(__file__).parents[4] / "examples" / "arena"
STILL = (
    "from vrg.agents import STILL, Strategy\n\n\nclass Own(Strategy):\n    def act(self, view):\n        return STILL\n"
)
DEEDS = {
    "good": f"open('player.py', 'w').write({STILL!r}); print('done')",
    "idle": "pass",
    "failing": "raise SystemExit(3)",
    "endless": "while True: pass",
    "large": "open('player.py', 'w').write('#' * 5_000_000)",
    "link": "import os; os.symlink('/etc/passwd', 'player.py')",
    "pipe": "import os; os.mkfifo('player.py')",
    "curious": "print(open({secret!r}).read())",
    "writer": "open({secret!r}, 'w').write('gone')",
    "caller": "import socket; socket.create_connection(('127.0.0.1', {port}))",
    "glutton": "bytearray(5_000_000_000)",
    "leaver": "import subprocess; subprocess.Popen(['sleep', '1000']); print('left')",
    "runaway": "import subprocess; subprocess.Popen(['sleep', '1001'], start_new_session=True); print('left')",
    "folder": "import os; os.remove('report.json'); os.mkdir('report.json'); os.symlink({secret!r}, 'said.txt')",
    "datagram": "import socket; socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(b'x', ('127.0.0.1', {port}))",
    "file_socket": "import socket; socket.socket(socket.AF_UNIX).connect({listening!r})",
    "namer": "import socket; print(socket.getaddrinfo('localhost', 80))",
    "many": "import os, time; any(os.fork() == 0 for _ in range(6)); data = b'x' * 300_000_000; time.sleep(1000)",
    "shell": "import subprocess; print(subprocess.call('sleep 9 & kill $! && touch x && chmod 600 x', shell=True))",
    "tokens": "import os; print(os.environ['SECRET_TOKEN'])",
}


@pytest.fixture(autouse=True)
def sealed() -> None:
    if (why := missing()) is not None:
        lacking(why)


def league(vrg: Vrg, place: Path) -> Path:
    """A league without entries."""
    (place / "entries").mkdir()
    done = vrg("league", "play", "entries", "--match", str(ARENA / "match.toml"), "--games", "1")
    assert done.status == 0, done.err
    return place / "entries"


def turns(entries: Path) -> dict[str, dict[str, str]]:
    lines = (entries / "league" / "authors" / "turns.jsonl").read_text().splitlines()
    return {turn["author"]: turn for turn in map(json.loads, lines)}


def test_an_author_can_write_its_entry_and_nothing_else(
    vrg: Vrg, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SECRET_TOKEN", "a secret of the owner")
    secret = tmp_path / "secret.txt"
    secret.write_text("a secret of the owner")
    entries = league(vrg, tmp_path)
    table = ["publish = true"]
    listening, inside = socket.create_server(("127.0.0.1", 0)), socket.socket(socket.AF_UNIX)
    inside.bind(str(tmp_path / "listening"))
    inside.listen()
    words = {"secret": str(secret), "port": listening.getsockname()[1], "listening": str(tmp_path / "listening")}
    for name, deed in DEEDS.items():
        (tmp_path / f"{name}.py").write_text(deed.format(**words))
        table += [f"[authors.{name}]", f'command = ["python3", "{name}.py"]', "memory = 1000"]
        table += [f"seconds = {2 if name == 'endless' else 60}"]
    (tmp_path / "authors.toml").write_text("\n".join(table))
    done = vrg("league", "improve", "entries", "authors.toml")
    assert done.status == 0, done.err
    listening.close()
    inside.close()
    found = turns(entries)
    assert found["good"]["outcome"] == "it has written another version"
    assert found["good"]["said"] == "done\n"
    assert {name for name, turn in found.items() if turn["outcome"].endswith("status 3")} == {"failing"}
    assert found["endless"]["outcome"] == "it took longer than 2 s"
    assert found["many"]["outcome"] == "it used more than 1000 MB"
    assert "127.0.0.1" in found["namer"]["said"], "names are found without UDP"
    assert found["shell"]["said"] == "0\n", "it may start and stop programs"
    for name in ("curious", "writer", "caller", "glutton", "tokens", "pipe", "datagram", "file_socket"):
        assert found[name]["outcome"] == "its command has ended with status 1", name
        assert any(error in found[name]["said"] for error in ("PermissionError", "MemoryError", "KeyError")), name
    assert "expected at most 4 MB" in found["large"]["outcome"]
    assert "expected a file, found a link" in found["link"]["outcome"]
    assert found["idle"]["outcome"] == "expected its entry as player.py, found none"
    assert all("a secret of the owner" not in json.dumps(turn) for turn in found.values())
    assert secret.read_text() == "a secret of the owner"
    assert {file.name for file in entries.iterdir()} == {"good.py", "league"}
    left = [pid for pid in os.listdir("/proc") if pid.isdecimal() and b"sleep\x00100" in _command(pid)]
    assert left == [], "what it has started ends with it"
    again = vrg("league", "improve", "entries", "authors.toml")
    assert turns(entries)["good"]["outcome"] == "it has changed nothing", again.err


def _command(pid: str) -> bytes:
    try:
        return Path("/proc", pid, "cmdline").read_bytes()
    except OSError:
        return b""


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "authors"),
        ("[authors.'../x']\ncommand = ['true']", "expected a name of letters"),
        ("[authors.ann]\ncommand = []", "command"),
        ("[authors.ann]\ncommand = ['true']\nseconds = -1", "seconds"),
        ("[authors.ann]\ncommand = ['true']\nsecond = 1", "second"),
        ("[", "cannot be read"),
    ],
)
def test_a_file_of_authors_is_checked(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "authors.toml").write_text(text)
    with pytest.raises(ConfigError, match=words):
        read_authors(tmp_path / "authors.toml")


@pytest.mark.thorough
def test_the_authors_of_the_example_improve_by_their_games(tmp_path: Path) -> None:
    shutil.copytree(ARENA, tmp_path / "arena")
    run = subprocess.run(
        [tmp_path / "arena" / "run.sh", "4"], env=with_vrg() | {"VRG_ARENA": str(tmp_path / "league")}, check=False,
        capture_output=True, text=True, cwd=tmp_path,
    )  # fmt: skip
    assert run.returncode == 0, run.stdout + run.stderr
    report = json.loads((tmp_path / "league" / "league" / "authors" / "ann" / "report.json").read_text())
    assert len(report["versions"]) > 1
    assert any("at most" in " ".join(call["why"]) for game in report["games"] for call in game["calls"])
    ideas = json.loads((tmp_path / "league" / "league" / "authors" / "ann" / "ideas.json").read_text())
    assert ideas["FEAR"] + ideas["LEAD"] > 0.0, "a remedy for what was lost"
