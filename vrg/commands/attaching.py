"""What the commands share that attach a window to a running match."""

from pathlib import Path

from vrg.commands.options import which_match
from vrg.config.setup import MatchSetup, read_setup
from vrg.errors import ConfigError


def setup_of(match: str | None, name: str | None, router: str | None, command: str) -> tuple[MatchSetup, str]:
    """The set-up of the running match that is meant, and the endpoint of its router.

    A match that runs on this machine has left its set-up in its run folder.

    Args:
        match: its match file, if that was typed. name: its name. router: the endpoint of its router.
        command: what can be typed to name the match file, for the message.

    Raises:
        ConfigError: it is not clear which match is meant, or nobody here knows its set-up.
    """
    from vrg.launch import running

    if match is not None:
        from vrg.config.loading import load_match, match_path

        setup = load_match(match_path(match))
        if name not in (None, setup.name):
            raise ConfigError([f"{match}: expected the match file of {name!r}, got that of {setup.name!r}"])
        return setup, router or which_match(setup.name, router)[1]
    found, endpoint = which_match(name, router)
    here = next((m for m in running.running() if (m.match, m.router) == (found, endpoint)), None)
    if here is None:
        raise ConfigError([f"{found} runs on another machine: name its match file too, as in `{command}`"])
    from vrg.launch.run_folder import RunFolder

    return read_setup(RunFolder(Path(here.run)).setup), endpoint
