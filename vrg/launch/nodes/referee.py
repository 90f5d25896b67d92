"""The referee of a match, and its journal."""

from vrg.bus.mailbox import Mailbox
from vrg.config.rules import rulebook_of
from vrg.config.setup import MatchSetup, write_setup
from vrg.coordinator.coordinator import Coordinator
from vrg.coordinator.journal import Journal, JournalHeader, NoJournal
from vrg.coordinator.referee_driver import RefereeDriver
from vrg.launch.context import Made, NodeContext
from vrg.runs.fingerprint import keep_fingerprint
from vrg.runs.run_folder import RunFolder


def open_journal(setup: MatchSetup, folder: RunFolder, *, aside: bool = False) -> Journal:
    """Open the journal of a match, a new one or the one that is in the run folder.

    Beside a new one, the fingerprint of what computes the match is written.

    Args:
        aside: see `vrg.coordinator.journal.Journal`.

    Raises:
        JournalError: it cannot be used; see `Journal`.
    """
    header = JournalHeader(match=setup.name, game=setup.game, seed=setup.seed)
    journal = Journal(folder.journal, header, aside=aside)
    if journal.last is None:
        keep_fingerprint(folder, setup.engine)
    return journal


def coordinator_node(setup: MatchSetup, journal: Journal | NoJournal) -> Coordinator:
    """Make the coordinator of a match.

    Raises:
        ConfigError: the rules cannot be played with this set-up.
    """
    driver = RefereeDriver({player.name: player.robot.v_max for player in setup.players}, setup.obstacles)
    disqualify = setup.on_fault == "disqualify"
    return Coordinator(
        Mailbox(),
        setup.keys,
        rulebook_of(setup),
        journal,
        driver=driver,
        sight=setup.sight,
        disqualify=disqualify,
        fused=[player.name for player in setup.fused],
    )


def referee(on: NodeContext) -> Made:
    """The coordinator, which continues from the journal in the run folder."""
    if not on.folder.setup.exists():
        # Where no launcher has written it, `vrg run result` and `vrg run plot` need it.
        write_setup(on.setup, on.folder.setup)
    journal = on.stack.enter_context(open_journal(on.setup, on.folder, aside=True))
    return Made(coordinator_node(on.setup, journal))
