"""A match of a run folder, judged again by the rule book."""

from vrg.config.rules import rulebook_of
from vrg.config.setup import MatchSetup
from vrg.coordinator.cases import cases_of
from vrg.coordinator.evidence import read_evidence
from vrg.coordinator.journal import read_journal
from vrg.coordinator.judging import Disagreement, Judgement, judge_again, unproved
from vrg.games import game_of
from vrg.launch.run_folder import RunFolder


def judge_run(setup: MatchSetup, folder: RunFolder) -> tuple[Judgement, list[Disagreement]]:
    """Let the rule book judge a match again.

    Returns:
        what came of it; and all disagreements, with the calls whose deciding numbers are not as the rules want them.

    Raises:
        JournalError: the journal or the evidence cannot be read.
    """
    book, records = rulebook_of(setup), read_journal(folder.journal)[1]
    judgement = judge_again(book, read_evidence(folder.evidence), records)
    cases = cases_of(book, read_evidence(folder.evidence), records)
    measured = unproved(game_of(setup.game).load_prover(), book, cases)
    return judgement, [*judgement.disagreements, *measured]
