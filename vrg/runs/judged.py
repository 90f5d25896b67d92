"""A match of a run folder, judged again by the rule book."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from vrg.config.setup import MatchSetup
from vrg.coordinator.evidence import read_evidence
from vrg.coordinator.journal import JournalHeader, Record, read_journal
from vrg.coordinator.judging import Disagreement, Judgement, cases_of, judge_again, refuted
from vrg.errors import JournalError, LaunchError, MessageError
from vrg.games import game_of
from vrg.recording.reader import read_tracks
from vrg.runs.change import books_of
from vrg.runs.crosscheck import cross_check
from vrg.runs.run_folder import RunFolder


def judge_run(
    setup: MatchSetup, folder: RunFolder, records: Sequence[Record] | None = None, damage: list[str] | None = None
) -> tuple[Judgement, list[Disagreement]]:
    """Let the rule book judge a match again.

    Args:
        records: those of its journal; None reads them. damage: where to note what of its files is damaged, in words.

    Returns:
        what followed from it; and all disagreements, with the calls whose deciding numbers break the rules.

    Raises:
        JournalError: the journal or the evidence cannot be read.
    """
    book, later = books_of(setup, folder)
    records = read_journal(folder.journal, damage)[1] if records is None else records
    judgement = judge_again(book, read_evidence(folder.evidence, damage), records, later)
    cases = cases_of(book, read_evidence(folder.evidence), records, later)
    try:
        measured = refuted(game_of(setup.game).load_prover(), book, cases, later)
    except JournalError:
        raise
    except Exception as error:  # the rules of any game, on numbers that anybody may have changed
        what = f"calls cannot be proved by the evidence: {type(error).__name__}: {error}"
        return judgement, [*judgement.disagreements, Disagreement(0.0, what)]
    return judgement, [*judgement.disagreements, *measured]


@dataclass(frozen=True)
class Judged:
    """A run that was judged again, with its recording.

    Args:
        disagreements: where the referee's calls or the recording disagree with the rule book, in the order of time.
        notes: what could not be judged or compared, in sentences. sentence: the result in a sentence or two.
    """

    disagreements: Sequence[Disagreement]
    notes: Sequence[str]
    sentence: str

    def __str__(self) -> str:
        return "\n".join((*self.notes, *map(str, self.disagreements), self.sentence))


def judge_folder(folder: RunFolder, setup: MatchSetup) -> Judged:
    """Let the rule book judge a run again, and compare the recording with the evidence.

    Raises:
        LaunchError: it has no evidence. JournalError: the journal or the evidence cannot be read.
    """
    if not folder.evidence.exists():
        raise LaunchError(
            f"{folder.path}: expected {folder.evidence.name}, found none: an earlier VRG has played this match"
        )
    notes: list[str] = []
    header, records = read_journal(folder.journal, notes)
    judgement, wrong = judge_run(setup, folder, records, notes)
    seen, compared, unread = _recorded(folder)
    found = sorted([*_foreign(setup, header), *wrong, *seen], key=lambda d: d.time)
    notes += unread
    if judgement.reworded:
        calls = "1 call has" if judgement.reworded == 1 else f"{judgement.reworded} calls have"
        notes.append(f"{calls} another text than this release of VRG writes; texts are not compared.")
    notes += [f"From {since:.1f} to {until:.1f} s no evidence could be written." for since, until in judgement.gaps]
    return Judged(found, notes, _sentence(judgement, len(found), compared))


def _recorded(folder: RunFolder) -> tuple[list[Disagreement], int, list[str]]:
    """The differences of the recording, if there is one, from the evidence; the number of compared poses; and what was
    not compared, in sentences."""
    parts = folder.recordings()
    if not parts:
        return [], 0, []
    torn: list[Path] = []
    try:
        found, compared = cross_check(list(read_tracks(parts, torn).values()), read_evidence(folder.evidence))
    except (OSError, MessageError) as error:
        return [], 0, [f"The recording cannot be read, and was not compared: {error}"]
    notes = [f"{part.name} ends in the middle: what it lacks was not compared." for part in torn]
    if not compared:
        notes.append("No recorded pose could be compared with the evidence: is the recording of this match?")
    return found, compared, notes


def _foreign(setup: MatchSetup, header: JournalHeader) -> list[Disagreement]:
    """Says that the journal belongs to another match than the set-up beside it, if it does."""
    if (header.match, header.game, header.seed) == (setup.name, setup.game, setup.seed):
        return []
    of = f"the journal is of {header.match} ({header.game}, seed {header.seed})"
    return [Disagreement(0.0, f"{of}, its set-up of {setup.name} ({setup.game}, seed {setup.seed})")]


def _sentence(judgement: Judgement, wrong: int, compared: int) -> str:
    """The result, in a sentence or two.

    Args:
        wrong: the number of disagreements. compared: the number of poses of the recording that were compared.
    """
    text = (
        f"{judgement.calls} calls were judged again, by {judgement.ticks} looks at the field; "
        f"{compared} recorded poses were compared: "
    )
    text += "no disagreement." if not wrong else f"{wrong} disagreement{'s' if wrong > 1 else ''}."
    if judgement.unjudged:
        why = "The evidence has gaps" if judgement.gaps else "The evidence ends early"
        text += f" {why}: {judgement.unjudged} further calls could not be judged."
    return text
