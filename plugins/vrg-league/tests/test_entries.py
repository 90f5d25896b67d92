"""The entries of a league, whatever its authors put into the folder."""

import hashlib
import os
from pathlib import Path

import pytest
from experiments import OWN

from vrg.runs.run_folder import delete
from vrg_league import entries
from vrg_league.entries import LARGEST, MAX_FILES, Source, entries_in

CODE = f"{OWN}return STILL\n"


def found(folder: Path, *, owners: dict[str, str] | None = None) -> dict[str, Source]:
    sources = entries_in(folder, without=(folder / "league",), owner=lambda entry: (owners or {}).get(entry, ""))
    assert len({source.entry for source in sources}) == len(sources)
    return {source.entry: source for source in sources}


def test_a_file_is_an_entry_and_so_is_a_folder_with_a_strategy(tmp_path: Path) -> None:
    (tmp_path / "Anna Maria.py").write_text(CODE)
    (tmp_path / "bob.npz").write_bytes(b"\0weights")
    for name, text in {"team/team.py": CODE, "team/other.py": "x = 1\n", "team/parts/a.bin": "a"}.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    for name in ("_notes.py", ".git/hook.py", "docs/read.md", "league/mine.py", "team/.secret", "readme.txt"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("no entry")
    sources = found(tmp_path)
    assert list(sources) == ["Anna Maria", "bob", "team"]
    assert sources["Anna Maria"].files == {"Anna Maria.py": CODE.encode()}
    assert sources["Anna Maria"].digest == hashlib.sha256(CODE.encode()).hexdigest()
    assert sources["team"].main == "team.py"
    assert sorted(sources["team"].files) == ["other.py", "parts/a.bin", "team.py"]
    (tmp_path / "team/parts/a.bin").write_text("b")
    assert found(tmp_path)["team"].digest != sources["team"].digest


def test_what_cannot_be_read_is_an_entry_with_a_problem(tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "secret").write_text("of another user")
    folder = tmp_path / "class"
    folder.mkdir()
    os.mkfifo(folder / "pipe.py")
    (folder / "link.py").symlink_to(elsewhere / "secret")
    (folder / "round.py").symlink_to(folder / "round.py")
    (folder / "link").symlink_to(elsewhere)
    with (folder / "huge.npz").open("wb") as file:
        file.truncate(1 << 40)
    (folder / "old.py").mkdir()
    for name in ("two", "linked", "many"):
        (folder / name).mkdir()
    (folder / "two" / "a.py").write_text(CODE)
    (folder / "two" / "b.py").write_text(CODE)
    (folder / "linked" / "mine.py").write_text(CODE)
    (folder / "linked" / "weights.bin").symlink_to(elsewhere / "secret")
    (folder / "many" / "many.py").write_text(CODE)
    for number in range(MAX_FILES):
        (folder / "many" / str(number)).mkdir()
    (folder / os.fsdecode(b"\xe9ve.py")).write_text(CODE)
    problems = {entry: source.problem for entry, source in found(folder).items()}
    assert not any(source.files or source.digest for source in found(folder).values())
    assert problems.pop("--udce9ve-") == "its name is not in UTF-8: give it another one"
    assert "found a link" in problems["link"]
    assert "found a link" in problems["round"]
    assert "weights.bin: expected a file, found a link" in problems["linked"]
    assert "expected a file, found none" in problems["pipe"]
    assert "expected a file, found none" in problems["old"]
    assert f"expected at most {LARGEST / 1e6:g} MB" in problems["huge"]
    assert "expected the strategy in two.py, or in the only file, found a.py, b.py" in problems["two"]
    assert f"expected at most {MAX_FILES} files" in problems["many"]
    assert len(problems) == 8


@pytest.mark.parametrize(("depth", "name"), [(3 * MAX_FILES, "d"), (30, "d" * 200)])
def test_a_folder_without_end_is_a_problem_of_its_entry_alone(tmp_path: Path, depth: int, name: str) -> None:
    """Also where the path of a file is longer than any program can open it by."""
    (tmp_path / "ann.py").write_text(CODE)
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "deep.py").write_text(CODE)
    before = os.getcwd()
    os.chdir(tmp_path / "deep")
    try:
        for _ in range(depth):
            os.mkdir(name)
            os.chdir(name)
        Path("weights").write_text("x")
    finally:
        os.chdir(before)
    sources = found(tmp_path)
    assert sources["deep"].problem
    assert not sources["ann"].problem
    delete(tmp_path / "deep")


def test_nobody_takes_the_name_of_another_entry(tmp_path: Path) -> None:
    (tmp_path / "ann.py").write_text(CODE)
    (tmp_path / "ann.npz").write_bytes(b"weights")
    sources = found(tmp_path, owners={"ann": "ann.py"})
    assert sources["ann"].name == "ann.py"
    assert "ann.py is the entry ann already" in sources["ann-ann-npz"].problem
    (tmp_path / "ann.py").unlink()
    assert found(tmp_path, owners={"ann": "ann.py"})["ann"].name == "ann.npz"


def test_names_become_such_as_are_safe_in_paths_and_pages(tmp_path: Path) -> None:
    hostile = ["<script>alert(1)<", "a\nb", "\u202egnp", "x" * 200, "a.vs.b", "[red]", "{}"]
    for name in hostile:
        (tmp_path / f"{name}.py").write_text(CODE)
    sources = found(tmp_path)
    assert len(sources) == len(hostile)
    for entry, source in sources.items():
        assert all(sign.isalnum() or sign in "-_ " for sign in entry)
        assert len(entry.encode()) <= 60
        assert source.main == f"{entry}.py"


def test_all_entries_together_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(entries, "ENTRY_SIZE", 2500)
    for name in ("ann", "bob", "cid"):
        with (tmp_path / f"{name}.py").open("wb") as file:
            file.truncate(1000)
    found = entries_in(tmp_path, owner=lambda _: "")
    assert [bool(source.problem) for source in found] == [False, False, True]
    assert "all entries together may have" in found[2].problem
