"""Authors that are programs: what they find, what they may do, and what becomes of what they write."""

import json
import os
import platform
import re
import shutil
import socket
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from experiments import with_vrg

from vrg.errors import ConfigError
from vrg.launch.sandbox.syscalls import ARCHITECTURES
from vrg.testing.command_line import Vrg
from vrg.testing.processes.sealed import check_unknown
from vrg.testing.requirements import missing as lacking
from vrg_league.league import author_process
from vrg_league.league.authors import read_authors

ARENA = Path(__file__).parents[4] / "examples" / "arena"
STILL = (
    "from vrg.agents import STILL, Strategy\n\n\nclass Own(Strategy):\n    def act(self, view):\n        return STILL\n"
)
LONG = str(1_000_000_000 + os.getpid())
"""The seconds that programs would sleep, which no other program has in its command."""
DEEDS = {
    "good": f"open('player.py', 'w').write({STILL!r}); print('done')",
    "idle": "pass",
    "failing": "raise SystemExit(3)",
    "endless": "while True: pass",
    "large": "open('player.py', 'w').write('#' * 5_000_000)",
    "link": "import os; os.symlink('/etc/passwd', 'player.py')",
    "leaver": "import subprocess; subprocess.Popen(['sleep', '{long}']); print('left')",
    "runaway": "import subprocess; subprocess.Popen(['sleep', '{long}'], start_new_session=True); print('left')",
    "hopper": "import os, time\nif os.fork(): time.sleep(900)\nwhile True: os.fork() and os._exit(0)",
    "folder": "import os; os.remove('report.json'); os.mkdir('report.json'); os.symlink({secret!r}, 'said.txt')",
    "namer": "import socket; print(socket.getaddrinfo('localhost', 80))",
    "many": "import os, time; any(os.fork() == 0 for _ in range(6)); data = b'x' * 60_000_000; time.sleep(900)",
    "shell": "import subprocess; print(subprocess.call('sleep 9 & kill $! && touch x && chmod 600 x', shell=True))",
    "changer": "import os; os.chmod({secret!r}, 0o666); os.utime({secret!r}, (0, 0)); os.chmod('..', 0)",
}
FORBIDDEN = {
    "pipe": ("PermissionError", "import os; os.mkfifo('player.py')"),
    "curious": ("PermissionError", "print(open({secret!r}).read())"),
    "neighbour": ("PermissionError", "print(open({entries!r} + '/good.py').read())"),
    "writer": ("PermissionError", "open({secret!r}, 'w').write('gone')"),
    "caller": ("PermissionError", "import socket; socket.create_connection(('127.0.0.1', {port}))"),
    "datagram": ("PermissionError", "import socket; socket.socket(socket.AF_INET, socket.SOCK_DGRAM)"),
    "file_socket": ("PermissionError", "import socket; socket.socket(socket.AF_UNIX).connect({listening!r})"),
    "parent": ("PermissionError", "import os; os.kill(os.getppid(), 9)"),
    "stranger": ("PermissionError", "import os; os.kill({pid}, 0)"),
    "unnamed_file": ("PermissionError", "import os; os.memfd_create('x')"),
    "namespace": (
        "-1",
        "import ctypes as c; raise SystemExit(str(c.CDLL(None).syscall({clone}, 0x10000011, 0, 0, 0, 0)))",
    ),
    "glutton": ("MemoryError", "bytearray(5_000_000_000)"),
    "tokens": ("KeyError", "import os; print(os.environ['SECRET_TOKEN'])"),
}
"""What ends with an error, and the error."""


@pytest.fixture(autouse=True)
def sealed() -> None:
    if (why := author_process.lacking()) is not None:
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
    secret.chmod(0o600)
    entries = league(vrg, tmp_path)
    table = ["publish = true"]
    listening, inside = socket.create_server(("127.0.0.1", 0)), socket.socket(socket.AF_UNIX)
    inside.bind(str(tmp_path / "listening"))
    inside.listen()
    words = {
        "secret": str(secret), "port": listening.getsockname()[1], "listening": str(tmp_path / "listening"),
        "entries": str(entries), "pid": os.getpid(), "long": LONG,
        "clone": ARCHITECTURES[platform.machine()].numbers["clone"],
    }  # fmt: skip
    for name, deed in [*DEEDS.items(), *((name, deed) for name, (_, deed) in FORBIDDEN.items())]:
        (tmp_path / f"{name}.py").write_text(deed.format(**words))
        table += [f"[authors.{name}]", f'command = ["python3", "{name}.py"]', "memory = 200"]
        table += [f"seconds = {2 if name in ('endless', 'hopper') else 60}"]
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
    assert found["hopper"]["outcome"] == "it took longer than 2 s"
    assert re.fullmatch(r"it used more than 200 MB, in \d programs", found["many"]["outcome"])
    assert "127.0.0.1" in found["namer"]["said"], "names are found without UDP"
    assert found["shell"]["said"] == "0\n", "it may start and stop programs"
    for name, (error, _) in FORBIDDEN.items():
        assert found[name]["outcome"] == "its command has ended with status 1", name
        assert error in found[name]["said"], name
    assert "expected at most 4 MB" in found["large"]["outcome"]
    assert "expected a file, found a link" in found["link"]["outcome"]
    assert found["idle"]["outcome"] == "expected its entry as player.py, found none"
    assert all("a secret of the owner" not in json.dumps(turn) for turn in found.values())
    assert secret.read_text() == "a secret of the owner"
    assert (stat.S_IMODE(secret.stat().st_mode), secret.stat().st_mtime > 0) == (0o600, True)
    assert {file.name for file in entries.iterdir()} == {"good.py", "league"}
    left = [pid for pid in os.listdir("/proc") if pid.isdecimal() and LONG.encode() in _command(pid)]
    assert left == [], "what it has started ends with it"
    told = json.loads((entries / "league" / "authors" / "good" / "report.json").read_text())
    assert "[[players]]" in told["match"]
    assert "secret" not in told["match"], "by it an author would know the random numbers of its games"
    again = vrg("league", "improve", "entries", "authors.toml")
    assert turns(entries)["good"]["outcome"] == "it has changed nothing", again.err


def test_neither_an_author_nor_an_entry_finds_variables_of_who_runs_the_league(vrg: Vrg, tmp_path: Path) -> None:
    league(vrg, tmp_path)
    (tmp_path / "authors.toml").write_text('[authors.one]\ncommand = ["sleep", "900"]\n')
    command = [sys.executable, "-m", "vrg", "league"]
    check_unknown([*command, "improve", "entries", "authors.toml"], tmp_path, "sleep 900")
    check_unknown([*command, "check", "stuck.py", "--match", str(ARENA / "match.toml")], tmp_path, "")


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
        ("[authors.ann]\ncommand = ['']", "command"),
        ('[authors.ann]\ncommand = ["a\\u0000b"]', "command"),
        ("[authors.ann]\ncommand = ['true']\nports = [70000]", "ports"),
        ("[authors.ann]\ncommand = ['true']\nmemory = 100000000000000000000", "memory"),
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
