"""What an agent may change on the launcher's machine, and what it may not."""

from pathlib import Path

import pytest

from vrg.config.setup import Machine
from vrg.launch.events import NoNotes
from vrg.launch.remote import wire
from vrg.launch.remote.conversation import Conversation, Visit
from vrg.launch.run_folder import RunFolder


@pytest.fixture
def run(tmp_path: Path) -> RunFolder:
    folder = RunFolder(tmp_path / "run")
    folder.prepare()
    (folder.logs / "referee.log").write_bytes(b"the referee's\n")
    return folder


def test_an_agent_changes_what_its_own_processes_have_written_and_nothing_else(run: RunFolder) -> None:
    told: list[str] = []
    visit = Visit(run="run", window=False, record=False)
    talk = Conversation("lab", Machine(host="lab"), run, visit, told.append, NoNotes())
    run.journal.write_bytes(b"the journal\n")  # once the match runs
    talk.fetch()
    for _ in range(2):
        talk._take(wire.LogText("ann", b"hello\n", 6))
        talk._take(wire.LogText("referee", b"forged\n", 7))
        talk._take(wire.LogText("../../evil", b"forged\n", 7))
        talk._take(wire.FilePart("players/ann/notes", b"a note", begins=True))
        talk._take(wire.FilePart("journal.jsonl", b"forged\n", begins=True))
        talk._take(wire.FilePart("../evil", b"forged\n", begins=True))
    assert (run.logs / "ann.log").read_bytes() == b"hello\nhello\n"
    assert (run.path / "players" / "ann" / "notes").read_bytes() == b"a note"
    assert (run.logs / "referee.log").read_bytes() == b"the referee's\n"
    assert run.journal.read_bytes() == b"the journal\n"
    assert not list(run.path.parent.rglob("*evil*"))
    assert len(told) == 4, "each is told once"
    assert told[0] == "lab: 'logs/referee.log' cannot be kept: the run folder has such a file already"
