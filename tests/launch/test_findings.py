import functools
from pathlib import Path

import pytest

from tests.test_machines import MACHINES, load
from vrg.config.loading import load_match
from vrg.launch import findings
from vrg.launch.findings import examine
from vrg.localisation.source import SOURCES
from vrg.plugins import Finding
from vrg.testing.tiny import TINY


@pytest.fixture
def quiet(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of other commands only `vrg check` is run, once for each match file: what they find is tested elsewhere."""
    monkeypatch.setattr(findings, "_run", functools.cache(findings._run))
    monkeypatch.setattr(findings, "_doctor", lambda: [Finding("python", True, "3.11.7"), Finding("numpy", True, "2")])


@pytest.mark.usefixtures("quiet")
def test_whether_players_can_be_sealed_is_asked_where_they_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "bob.py").write_text(
        "from vrg.agents import Strategy\nclass Bob(Strategy):\n    def act(self, view):\n        return None\n"
    )
    setup = load(tmp_path, MACHINES, bob='machine = "lab2"\nstrategy = "bob.py:Bob"')
    for lacking in (None, "a sandbox needs Linux"):
        monkeypatch.setattr(findings, "missing", lambda lacking=lacking: lacking)
        here = {finding.what: finding for finding in examine(setup, tmp_path / "match.toml", "here")}
        there = {finding.what: finding for finding in examine(setup, tmp_path / "match.toml", "lab2")}
        assert "sandbox" not in here, "ann's strategy is VRG's own"
        assert there["sandbox"].good == (lacking is None)
        assert there["sandbox"].text == (lacking or "can be sandboxed: bob")
        assert "numpy" not in there, "of what is good only what matters is told"


@pytest.mark.usefixtures("quiet")
def test_sources_of_fixes_are_looked_at_where_they_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "match.toml").write_text(
        TINY.replace("[[players]]", '[localisation.eye]\nsource = "sim"\n[[players]]', 1).replace(
            'name = "ann"', 'name = "ann"\nlocalisation = "fusion"'
        )
    )
    setup, file = load_match(tmp_path / "match.toml"), tmp_path / "match.toml"
    for lacks, good in (([], True), (["no camera"], False)):
        monkeypatch.setattr(SOURCES.get("sim"), "missing_here", lambda _settings, _base, lacks=lacks: lacks)
        found = {finding.what: finding for finding in examine(setup, file, "here")}
        assert found["eye"].good is good
    assert "eye" not in {finding.what for finding in examine(setup, file, "elsewhere")}
