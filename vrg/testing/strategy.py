"""The contract of every strategy. Its test subclasses StrategyContract and gives it a match file in which it plays."""

from pathlib import Path

import pytest

from vrg.config.loading import load_match
from vrg.launch.nodes.referee import open_journal
from vrg.launch.strategy_class import strategy_of
from vrg.playing.in_process import Ending, play
from vrg.runs.run_folder import RunFolder


class StrategyContract:
    """Subclasses provide the fixture `match_file`: the path of a match of virtual robots in which the strategy plays.

    Attributes:
        seconds: of match time that are played.
    """

    seconds = 60.0

    def played(self, match_file: Path, folder: Path) -> tuple[Ending, bytes]:
        """Play in one process with every message passed through the codec; how it ended, and the journal."""
        folder.mkdir()
        setup, run = load_match(match_file), RunFolder(folder)
        with open_journal(setup, run) as journal:
            ending = play(setup, journal, limit=self.seconds, strict=True)
        return ending, run.journal.read_bytes()

    def test_it_can_be_made_for_every_player(self, match_file: Path) -> None:
        setup = load_match(match_file)
        for player in setup.players:
            assert strategy_of(setup, player.name).name == player.name

    def test_it_plays_over_the_wire_and_the_same_seed_gives_the_same_match(
        self, match_file: Path, tmp_path: Path
    ) -> None:
        (ending, first), (_, second) = (self.played(match_file, tmp_path / name) for name in ("first", "second"))
        assert ending.time > 0.0
        if first != second:
            pytest.fail("two matches of one seed differ: does it use a random source or a clock of its own?")
