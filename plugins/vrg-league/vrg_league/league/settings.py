"""The settings of a league, which are fixed when it is made."""

import secrets
from pathlib import Path

from msgspec import structs

from vrg import __version__
from vrg.config.loading import load_match, match_path
from vrg.config.setup import CheckedMatch
from vrg.errors import ConfigError
from vrg_league.contenders import teams_of
from vrg_league.experiment import Definition, code_of_vrg
from vrg_league.folder import DEFINITION, read_definition
from vrg_league.games import LIMIT
from vrg_league.league.folder import LeagueFolder


def match_of(out: Path, *, lasers: bool | None = None) -> CheckedMatch:
    """The match of a league.

    Args:
        out: the folder of the league. lasers: in place of its own setting.

    Raises:
        ConfigError: there is none.
    """
    return load_match(out / "match" / "match.toml", lasers=lasers)


def open_league(
    out: Path,
    *,
    match: str | None = None,
    engine: str | None = None,
    lasers: bool | None = None,
    limit: float | None = None,
    seed: int | None = None,
    new_release: bool = False,
) -> LeagueFolder:
    """The open folder of a league, which is made if there is none.

    Args:
        match: the match file, or the name of a game. None stands for what the league was made with, and for usual
            values while it is made, for which only the match is needed.
        limit: the match time in s after which a game is broken off. seed: that of the first pair of games of two
            versions.
        new_release: True goes on although VRG has changed.

    Raises:
        ConfigError: it cannot be made with these settings, or was made with others.
    """
    code = {"the code of VRG": code_of_vrg()}
    made = (out / DEFINITION).is_file()
    if not made and match is None:
        raise ConfigError([f"{out}: there is no league yet: name its game or match file, such as `--match roboflag`"])
    secret = match_of(out).secret if made else secrets.token_hex(16)

    def wanted_by(engine: str, lasers: bool | None) -> CheckedMatch:
        return load_match(match_path(match or ""), engine=engine, lasers=lasers, sandbox=True, secret=secret)

    if not made:
        wanted = wanted_by(engine or "planar", lasers)
        definition = Definition(
            match=wanted.text,
            game=wanted.game,
            teams=teams_of(wanted),
            seed=seed or 0,
            limit=limit or LIMIT,
            contenders=[],
            code=code,
        )
        return LeagueFolder(out, definition, wanted)
    before, kept = read_definition(out), match_of(out)
    asked = (None, kept.lasers)
    same = {
        "--match": match is None or before.match in [wanted_by(kept.engine, on).text for on in asked],
        "--engine": engine in (None, kept.engine),
        "--lasers": lasers in asked,
        "--limit": limit in (None, before.limit),
        "--seed": seed in (None, before.seed),
    }
    if other := [option for option in same if not same[option]]:
        what = f"{', '.join(other)}: the league was made with another value, and all its games depend on it"
        raise ConfigError([f"{out}: {what}: leave it out, or make another league with --output"])
    now = structs.replace(before, vrg=__version__, code=code)
    if not new_release and (differences := now.differences(before)):
        what = "older games may not be played again as they were, and count as before"
        raise ConfigError([f"{out}: {'; '.join(differences)}: --new-release continues anyway: {what}"])
    return LeagueFolder(out, now, another=new_release)
