"""The numbers that decided the calls of a run."""

from contextlib import suppress
from typing import Any

from vrg.config.setup import MatchSetup
from vrg.coordinator.evidence import book_at, read_evidence
from vrg.coordinator.journal import read_journal
from vrg.coordinator.judging import cases_of
from vrg.coordinator.proof import Case, Measure, with_deviation
from vrg.coordinator.rulebook import RuleBook
from vrg.games import game_of
from vrg.geometry import circumradius
from vrg.runs.change import books_of
from vrg.runs.run_folder import RunFolder


def measures_of(setup: MatchSetup, book: RuleBook[Any], case: Case) -> tuple[Measure, ...]:
    """The numbers that decided a call."""
    call, prover = case.call, game_of(setup.game).load_prover()
    bodies = [
        (pose, circumradius(setup.player(name).robot.size), call.uncertainty[name])
        for name, pose in zip(call.players, call.poses, strict=False)
        if name in call.uncertainty
    ]
    return () if prover is None else tuple(with_deviation(measure, bodies) for measure in prover(book, case))


def reasons(folder: RunFolder, setup: MatchSetup) -> dict[int, list[str]]:
    """The numbers that decided the calls of a run, in sentences, by the number of the call.

    Raises:
        JournalError: the journal or the evidence cannot be read.
    """
    (book, later), (_, records) = books_of(setup, folder), read_journal(folder.journal)
    cases = cases_of(book, read_evidence(folder.evidence), records, later)
    found: dict[int, list[str]] = {}
    for case in cases:
        with suppress(Exception):  # the rules of any game, on numbers that anybody may have changed
            measures = measures_of(setup, book_at(case.now.time, book, later), case)
            found[case.call.number] = [f"{measure}." for measure in measures]
    return found
