"""What computed a run, and what `vrg run diff` says of it."""

import shutil
import sys
from pathlib import Path

import pytest
from msgspec.structs import replace

from vrg import __version__
from vrg.config.setup import write_setup
from vrg.coordinator.journal import read_journal
from vrg.errors import LaunchError
from vrg.launch.nodes.referee import open_journal
from vrg.packages import release_of
from vrg.runs.fingerprint import (
    Fingerprint,
    _musl,
    features_in,
    fingerprint,
    keep_fingerprint,
    read_fingerprint,
    unlike,
)
from vrg.runs.run_folder import RunFolder
from vrg.testing.command_line import invoke
from vrg.testing.matches import played, written

ONE = Fingerprint(
    releases={"vrg": "0.2.0", "python": "3.13.5", "numpy": "2.3.1"},
    engine="planar",
    portable=1,
    libc="glibc 2.36",
    machine="x86_64",
    features=["avx", "avx2", "fma"],
    settings={},
    system="Linux",
)


def test_what_differs_is_named_with_its_values() -> None:
    assert unlike([]) == unlike([ONE]) == unlike([ONE, ONE]) == []
    assert unlike([ONE, replace(ONE, libc="musl 1.2.5")]) == ["C libraries: glibc 2.36 and musl 1.2.5"]
    assert unlike([ONE, replace(ONE, features=["avx"])]) == ["features of the processor: avx2 fma and none"]
    assert unlike([ONE, replace(ONE, libc="", portable=2)]) == [
        "versions of the portable arithmetic: 1 and 2",
        "C libraries: glibc 2.36 and none",
    ]
    assert unlike([ONE, replace(ONE, settings={"GLIBC_TUNABLES": "a=b"})]) == ["values of GLIBC_TUNABLES: none and a=b"]
    other = replace(ONE, engine="mujoco", releases=ONE.releases | {"vrg": "0.3.0", "mujoco": "4.0.1"})
    assert unlike([other, ONE]) == [
        "releases of VRG: 0.3.0 and 0.2.0",
        "releases of mujoco: 4.0.1 and none",
        "engines: mujoco and planar",
    ]
    three = [replace(ONE, machine=machine) for machine in ("x86_64", "aarch64", "x86_64", "riscv64")]
    assert unlike(three) == ["machines: x86_64, aarch64 and riscv64"]


def test_the_features_of_a_processor_are_those_that_change_last_bits() -> None:
    intel = ["processor\t: 0\n", "flags\t\t: fpu vme fma sse4_1 avx ht\n", "\n", "flags\t\t: avx512f\n"]
    assert features_in(intel) == ["avx", "fma", "sse4_1"]
    assert features_in(["processor\t: 0\n", "Features\t: fp asimd sve\n"]) == ["sve"]
    assert features_in(["isa\t: rv64imafdc\n"]) == []


def test_the_release_of_a_package_is_told_without_loading_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("some_engine-1.2.3.dist-info", "older-0.4-py3.11.egg-info", "single-7.dist-info"):
        (tmp_path / name).mkdir()
    for module in ("some_engine", "older", "bare"):
        (tmp_path / module).mkdir()
        (tmp_path / module / "__init__.py").write_text("raise AssertionError")
    (tmp_path / "single.py").write_text("raise AssertionError")
    monkeypatch.syspath_prepend(tmp_path)
    releases = [release_of(name) for name in ("some_engine", "older", "single", "bare", "not_there")]
    assert releases == ["1.2.3", "0.4", "7", "", ""]


def test_musl_tells_its_version_by_its_loader(tmp_path: Path) -> None:
    loader = tmp_path / "ld-musl-x86_64.so.1"
    assert _musl([loader]) == ""
    loader.write_text(
        "#!/bin/sh\nprintf 'musl libc (x86_64)\\nVersion 1.2.5\\nDynamic Program Loader\\n' >&2\nexit 1\n"
    )
    loader.chmod(0o755)
    assert _musl([loader]) == "musl 1.2.5"


def test_a_fingerprint_tells_of_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-FMA")
    found = fingerprint("planar")
    assert found.releases["vrg"] == __version__
    assert found.releases["python"] == ".".join(map(str, sys.version_info[:3]))
    assert found.releases["numpy"] == release_of("numpy") != ""
    assert found.settings["GLIBC_TUNABLES"] == "glibc.cpu.hwcaps=-FMA"
    assert fingerprint("mujoco").releases.keys() == {*found.releases, "mujoco"}


def test_only_a_new_journal_gets_a_fingerprint(tmp_path: Path) -> None:
    """A match that goes on after a crash keeps that of what began it; one of an earlier release goes on without."""
    setup = written(tmp_path)
    _, run = played(setup, tmp_path / "run", limit=3.0)
    assert read_fingerprint(run) == fingerprint("planar")
    run.fingerprint.unlink()
    with open_journal(setup, run):
        assert read_fingerprint(run) is None


def test_a_folder_that_takes_no_fingerprint_stops_no_match(tmp_path: Path) -> None:
    run = RunFolder(tmp_path)
    run.fingerprint.mkdir()
    keep_fingerprint(run, "planar")
    with pytest.raises(LaunchError, match="found a folder"):
        read_fingerprint(run)


@pytest.fixture
def runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[RunFolder, RunFolder]:
    """A match that was played twice, the second time where the C library is set otherwise."""
    (tmp_path / "match").mkdir()
    setup = written(tmp_path / "match")
    found = []
    for name, value in (("one", ""), ("two", "glibc.cpu.hwcaps=-FMA")):
        monkeypatch.setenv("GLIBC_TUNABLES", value)
        _, run = played(setup, tmp_path / name, limit=10.0)
        shutil.copy(tmp_path / "match" / "match.toml", run.match_file)
        write_setup(setup, run.setup)
        found.append(run)
    return found[0], found[1]


def diffed(*runs: RunFolder) -> tuple[int, list[str]]:
    done = invoke("run", "diff", *(str(run.path) for run in runs))
    return done.exit_code, done.output.splitlines()


UNLIKE = "The runs were computed with different values of GLIBC_TUNABLES: none and glibc.cpu.hwcaps=-FMA."


def test_two_runs_with_different_fingerprints(runs: tuple[RunFolder, RunFolder]) -> None:
    one, two = runs
    assert one.journal.read_bytes() == two.journal.read_bytes(), "no fingerprint is in it"
    assert read_fingerprint(one) != read_fingerprint(two)
    status, lines = diffed(one, two)
    assert status == 0
    assert lines[0] == UNLIKE
    assert lines[1].startswith("Nevertheless the same: the journals")
    records = read_journal(two.journal)[1]
    text = two.journal.read_text()
    two.journal.write_text(text.replace(f'"time":{records[-1].time}', '"time":77.7'))
    assert two.journal.read_text() != text
    with two.match_file.open("a") as match:
        match.write("\n# a remark\n")
    status, lines = diffed(one, two)
    assert status == 1
    assert lines[0] == UNLIKE
    assert [line.partition(" ")[0] for line in lines[1:]] == ["The", "Journals:"]


def test_runs_without_a_fingerprint_and_with_a_damaged_one_are_compared(runs: tuple[RunFolder, RunFolder]) -> None:
    one, two = runs
    one.fingerprint.unlink()
    two.fingerprint.write_text('{"releases": {}, "engine": "planar"}')
    status, lines = diffed(one, two)
    assert status == 0
    assert lines[0] == f"{one.path} does not tell what computed it: it has no fingerprint."
    assert lines[1].startswith(f"{two.fingerprint}: expected the fingerprint of a run: Object missing required field")
    assert lines[1].endswith("delete this file, which nothing else needs.")
    assert lines[2].startswith("The same")


def test_a_strangers_fingerprint_forges_no_line() -> None:
    one = fingerprint("planar")
    [words] = unlike([one, replace(one, libc="glibc 9.\nThe same: " + "x" * 5000)])
    assert "\n" not in words
    assert len(words) < 500
