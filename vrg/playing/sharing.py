"""A run as one file of HTML that shows its match."""

from contextlib import suppress

from vrg.config.setup import MatchSetup
from vrg.playing.replay import read_for_window
from vrg.runs.reasons import reasons
from vrg.runs.result import headline, read_result
from vrg.runs.run_folder import RunFolder
from vrg.ui.web.share import recorded, shared


def shared_run(folder: RunFolder, setup: MatchSetup) -> str:
    """The file of a run, see `vrg.ui.web.share`; calls of which the evidence knows no reason have none.

    Raises:
        LaunchError: there is nothing to show. JournalError: the journal or the evidence cannot be read.
    """
    why: dict[int, list[str]] = {}
    with suppress(Exception):  # the rules of any game, on numbers that anybody may have changed
        why = reasons(folder, setup)
    title = setup.name
    with suppress(OSError, ValueError, LookupError, TypeError, AttributeError):
        title = f"{setup.name}: {headline(read_result(folder))}"
    return shared(recorded(read_for_window(folder, setup).timeline, setup.name, why), title)
