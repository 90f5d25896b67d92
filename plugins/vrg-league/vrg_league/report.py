"""Reports on the games of one pairing, in words and as tables of texts."""

from collections.abc import Iterable, Mapping, Sequence

from vrg.bus.messages import shortened
from vrg.runs.fingerprint import Fingerprint, unlike
from vrg_league.games import BROKEN_OFF, FAILED, INVALID, GameRecord, Pairing
from vrg_league.series import Series

TextTable = list[list[str]]
"""Rows of cells; the first row is the head."""
PROBLEM_LENGTH = 200
"""The characters of what is wrong with a game; `games.jsonl` has all."""


def sentence(pairing: Pairing, series: Series, confidence: float) -> str:
    """The result of a pairing, in one sentence."""
    now, first, second = series.standing, pairing.first, pairing.second
    if now is None:
        return f"nothing is known about {pairing}: no pair of games was finished"
    missing = None if now.decided else series.missing
    if now.share < 0.5 and (now.decided or missing is not None):
        now, first, second = now.mirrored, second, first
    interval = f"{100 * confidence:g} % interval {between(now.low, now.high)}"
    numbers = f"{percent(now.share)} of {now.games} games, {interval}"
    if now.decided:
        return f"{first} beats {second}: {numbers}"
    if missing is not None:
        return f"not proved yet: {first} has {numbers}; {missing} more games like these would prove that it is better"
    yet = "" if series.over else f" yet (the comparison was to have up to {2 * series.pairs} games)"
    return f"no difference was found between {pairing}{yet}: {first} has {numbers}"


def percent(share: float) -> str:
    """A share as people read it, such as `64 %`."""
    return f"{100 * share:.0f} %"


def between(low: float, high: float) -> str:
    """An interval of shares, such as `57 to 70 %`. An end that is not one half is not written as if it were."""
    ends = [f"{100 * end:.0f}" for end in (low, high)]
    if ends[0] == "50" and low > 0.5:
        ends[0] = "over 50"
    if ends[1] == "50" and high < 0.5:
        ends[1] = "under 50"
    return f"{' to '.join(ends)} %"


def sides(rows: Sequence[GameRecord], teams: tuple[str, str]) -> TextTable:
    """The wins by role: a row for each way to give the teams to the strategies.

    The columns with the names of the teams tell who played them.
    """
    if not rows:
        return []
    pairing = rows[0].game.pairing
    columns = [f"{pairing.first} wins", "draws", f"{pairing.second} wins"]
    table = [[*teams, "games", *(columns if rows[0].game.only is None else ["won", "drawn", "lost"]), "mean score"]]
    for team in teams:
        of_side = [row for row in rows if row.game.first_team == team]
        if of_side:
            players = [of_side[0].label(team) or "as recorded" for team in teams]
            order = (0.0, 0.5, 1.0) if of_side[0].game.only == of_side[0].game.second_team else (1.0, 0.5, 0.0)
            wins = [str(sum(row.points == points for row in of_side)) for points in order]
            scores = [mean([row.played.score[t] for row in of_side if t in row.played.score]) for t in teams]
            table.append([*players, str(len(of_side)), *wins, " : ".join(scores)])
    return table


def calls(rows: Sequence[GameRecord]) -> TextTable:
    """The mean number of calls of each rule in a game, and of those on players of each strategy."""
    if not rows:
        return []
    pairing = rows[0].game.pairing
    table = [["calls in a game", "all", f"on {pairing.first}", f"on {pairing.second}"]]
    for rule in called_rules(rows):
        on = [
            mean([n for row in rows if (n := row.calls_on(rule, label)) is not None])
            for label in (pairing.first, pairing.second)
        ]
        table.append([rule, mean([row.total(rule) for row in rows]), *on])
    return table


def called_rules(rows: Iterable[GameRecord]) -> list[str]:
    """All rules that were called, sorted."""
    return sorted({rule for row in rows for rule in row.played.calls})


def mean(values: Sequence[float]) -> str:
    """The mean of numbers as a text; a dash if there is none."""
    return f"{sum(values) / len(values):.2f}" if values else "-"


def irregular(rows: Sequence[GameRecord]) -> list[str]:
    """The irregularities of these games, in words: a line for each kind, with its games."""
    found = []
    for ended, what in ((BROKEN_OFF, "came to no end"), (FAILED, "ended abnormally")):
        games = [row for row in rows if row.played.ended == ended]
        if games:
            why = f" ({games[0].played.problem})" if games[0].played.problem else ""
            found.append(f"{_games(len(games))} {what} and {_counts(len(games))}: {_named(games)}{why}")
    labels = dict.fromkeys(label for row in rows for label in (row.game.pairing.first, row.game.pairing.second))
    for winner in (None, *labels):
        games = [row for row in rows if row.played.ended == INVALID and row.winner == winner]
        if games:
            what = _counts(len(games)) if winner is None else f"won by {winner}, as only its opponent can have done it"
            why = f"the record of {_games(len(games))} is not what the rule book says, so it was tampered with"
            found.append(
                f"{why}: {what}: {_named(games)} (such as {shortened(games[0].played.problem, PROBLEM_LENGTH)})"
            )
    for label in labels:
        out = [row for row in rows if any(row.label(row.teams.get(n, "")) == label for n in row.played.disqualified)]
        if out:
            found.append(f"a player of {label} was disqualified in {_games(len(out))}: {_named(out)}")
    failing = [row for row in rows if row.played.failures]
    if failing:
        first = failing[0].played.failures[0]
        found.append(f"a strategy failed in {_games(len(failing))}: {_named(failing)} (such as {first})")
    return found + computed(rows)


def computed(rows: Sequence[GameRecord]) -> list[str]:
    """What differs between the computers that have played these games, in words."""
    found: list[Fingerprint] = []
    for row in rows:
        if (one := row.played.fingerprint) is not None and one not in found:
            found.append(one)
    differences = "; ".join(unlike(found))
    if not differences:
        return []
    return [f"the games were computed with different {differences}"]


def _games(number: int) -> str:
    return "1 game" if number == 1 else f"{number} games"


def _counts(number: int) -> str:
    return "counts as a draw" if number == 1 else "count as draws"


def _named(rows: Sequence[GameRecord]) -> str:
    """Games by what plays them again."""
    words = [f"seed {game.seed} ({', '.join(game.sides)})" for game in (row.game for row in rows[:3])]
    return ", ".join(words) + (f" and {len(rows) - 3} more" if len(rows) > 3 else "")


def schedule(series: Mapping[Pairing, Series], jobs: int, seconds: float | None, minute: float | None = None) -> str:
    """The games that are still to be played and the time that they take, in one sentence.

    Args:
        jobs: the number of games at a time. seconds: the time at most, s; None if no game has been measured.
        minute: the real time in s that a minute of one game takes, for which it says how long all take then.
    """
    left, pairings = sum(s.left for s in series.values()), sum(not s.over for s in series.values())
    took = "the first games will show how long that takes"
    if seconds is not None:
        took = f"about {lasting(seconds)}"
    elif minute is not None:
        took = f"about {lasting(left * minute / jobs)} for each minute that a game lasts"
    number = "1 pairing" if pairings == 1 else f"{pairings} pairings"
    return f"at most {_games(left)} of {number}, {jobs} at a time: {took}"


def lasting(seconds: float) -> str:
    """A time as people say it, such as `40 s`, `12 min` or `2 h 5 min`."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    hours, minutes = divmod(round(seconds / 60), 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"


def pairings(series: Mapping[Pairing, Series]) -> TextTable:
    """The schedule: a row for each pairing, in the order in which they play."""
    rows = [[p.first, p.second, str(s.counted), str(s.left)] for p, s in series.items()]
    return [["first", "second", "games that count", "to play at most"], *rows]


def markdown(table: TextTable) -> str:
    """A table as Markdown."""
    if not table:
        return ""
    head, *body = table
    lines = [head, ["---", *("---:" for _ in head[1:])], *body]
    return "\n".join(f"| {' | '.join(cell.replace('|', '/') for cell in line)} |" for line in lines) + "\n"


def scores(
    rows: Sequence[GameRecord], teams: Sequence[str], words: Mapping[str, str]
) -> dict[str, dict[str, list[float]]]:
    """For each team, under the words for its score, the scores that each strategy reached as this team.

    Args:
        words: what the points of a team count, by team.
    """
    found: dict[str, dict[str, list[float]]] = {}
    for team in teams:
        of_team = found.setdefault(f"score of {team} ({words[team]})" if team in words else f"score of {team}", {})
        for row in rows:
            if team in row.played.score:
                of_team.setdefault(row.label(team) or "as recorded", []).append(row.played.score[team])
    return found


def times(rows: Sequence[GameRecord]) -> dict[str, list[float]]:
    """The time of play of the games in s, by who played which team."""
    found: dict[str, list[float]] = {}
    for row in sorted(rows, key=lambda row: row.game.number % 2):
        if row.played.play_time is not None:
            found.setdefault(row.game.sides[0], []).append(row.played.play_time)
    return found
