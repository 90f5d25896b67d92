"""What a match of an environment leaves behind if it is recorded: a run folder, as `vrg play` makes one."""

from collections.abc import Collection
from datetime import datetime
from pathlib import Path

from msgspec import structs

from vrg.bus.messages import RefereeState, Stage
from vrg.config.setup import CheckedMatch, write_setup
from vrg.launch.nodes.recorder import recorder_node
from vrg.launch.nodes.referee import open_journal
from vrg.runs.keeping import keep
from vrg.runs.result import ended_of, write_result
from vrg.runs.run_folder import RunFolder
from vrg.toml_text import with_value
from vrg_learn.puppet import TARGET


class MatchRecord:
    """The open run folder of one match.

    Args:
        parent: the folder in which it is made. setup: the match as it is played.
        driven: the players that programs drive: in the set-up in the folder their strategy is a puppet.

    Attributes:
        journal: the open journal. recorder: the node that records what is to be seen.

    Raises:
        LaunchError: the folder cannot be made. JournalError: the journal cannot be opened.
    """

    def __init__(self, parent: Path, setup: CheckedMatch, driven: Collection[str] = ()) -> None:
        self._setup = setup = _written(setup)
        self._folder = RunFolder.create(parent, setup.name, datetime.now())
        self._open = True
        keep(setup, self._folder)
        puppets = {name: structs.replace(setup.player(name), strategy=TARGET) for name in driven}
        players = tuple(puppets.get(player.name, player) for player in setup.players)
        write_setup(structs.replace(setup, players=players), self._folder.setup)
        self.journal = open_journal(setup, self._folder)
        self.recorder = recorder_node(setup, self._folder)

    def close(self, state: RefereeState | None) -> None:
        """Close the journal, and write the result. The nodes must have stopped. Idempotent.

        Args:
            state: the last state of the referee; None if there is none.
        """
        if not self._open:
            return
        self._open = False
        self.journal.close()
        over = state is not None and state.stage is Stage.GAME_OVER
        write_result(self._setup, self._folder, state, ended_of(state) if over and state else "broken off")


def _written(setup: CheckedMatch) -> CheckedMatch:
    """The same match, whose text has what an environment plays otherwise than the match file says."""
    text = setup.text
    for path, value in (
        (("seed",), setup.seed),
        (("engine",), setup.engine),
        (("lasers",), setup.lasers),
        (("rules", "lineup"), setup.rules.get("lineup")),
    ):
        if value is not None:
            text = with_value(text, path, value)
    return structs.replace(setup, text=text)
