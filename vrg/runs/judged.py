"""A match of a run folder, judged again by the rule book."""

from collections.abc import Sequence

from vrg.config.setup import MatchSetup
from vrg.coordinator.cases import cases_of
from vrg.coordinator.evidence import read_evidence
from vrg.coordinator.journal import Record, read_journal
from vrg.coordinator.judging import Disagreement, Judgement, judge_again, unproved
from vrg.errors import JournalError
from vrg.games import game_of
from vrg.runs.change import books_of
from vrg.runs.run_folder import RunFolder


def judge_run(
    setup: MatchSetup, folder: RunFolder, records: Sequence[Record] | None = None, damage: list[str] | None = None
) -> tuple[Judgement, list[Disagreement]]:
    """Let the rule book judge a match again.

    Args:
        records: those of its journal; None reads them. damage: where to note what of its files is damaged, in words.

    Returns:
        what came of it; and all disagreements, with the calls whose deciding numbers are not as the rules want them.

    Raises:
        JournalError: the journal or the evidence cannot be read.
    """
    book, later = books_of(setup, folder)
    records = read_journal(folder.journal, damage)[1] if records is None else records
    judgement = judge_again(book, read_evidence(folder.evidence, damage), records, later)
    cases = cases_of(book, read_evidence(folder.evidence), records, later)
    try:
        measured = unproved(game_of(setup.game).load_prover(), book, cases, later)
    except JournalError:
        raise
    except Exception as error:  # the rules of any game, on numbers that anybody may have changed
        what = f"calls cannot be proved by what the evidence says: {type(error).__name__}: {error}"
        return judgement, [*judgement.disagreements, Disagreement(0.0, what)]
    return judgement, [*judgement.disagreements, *measured]
