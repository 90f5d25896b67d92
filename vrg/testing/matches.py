"""Matches that tests play in one process."""

from pathlib import Path
from typing import Any

from vrg.bus.messages import Call
from vrg.bus.node import Node
from vrg.config.loading import load_match
from vrg.config.setup import CheckedMatch
from vrg.coordinator.journal import read_journal
from vrg.launch.nodes.recorder import recorder_node
from vrg.launch.nodes.referee import open_journal
from vrg.playing.in_process import Ending, play
from vrg.runs.run_folder import RunFolder
from vrg.testing.tiny import TINY


def written(folder: Path, text: str = TINY, **overrides: Any) -> CheckedMatch:
    """The match of a file with this text."""
    (folder / "match.toml").write_text(text, encoding="utf-8")
    return load_match(folder / "match.toml", **overrides)


def played(
    setup: CheckedMatch, folder: Path, *watchers: Node, recorded: bool = False, **options: Any
) -> tuple[Ending, RunFolder]:
    """Play a match: how it ended, and its run folder."""
    run = RunFolder(folder)
    run.prepare()
    recorders = [recorder_node(setup, run)] if recorded else []
    with open_journal(setup, run) as journal:
        ending = play(setup, journal, watchers=[*watchers, *recorders], logs=run.logs, **options)
    return ending, run


def calls_of(run: RunFolder, rule: str | None = None) -> list[Call]:
    """The referee's calls, or those of one rule."""
    calls = [call for record in read_journal(run.journal)[1] for call in record.calls]
    return [call for call in calls if rule in (None, call.rule)]
