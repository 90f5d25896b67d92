"""A game of an experiment, and its outcome."""

from collections.abc import Iterable, Mapping

from msgspec import Struct

from vrg.runs.fingerprint import Fingerprint

OVER = "game over"
"""The game came to its end by its rules."""
BROKEN_OFF = "broken off"
"""The game reached the limit of match time, or was halted. It counts as a draw."""
FAILED = "failed"
"""The game was given up, or its process died. It counts as a draw."""
INVALID = "not valid"
"""The rule book judges otherwise than the referee of the game: something has changed that referee or its record."""

LIMIT = 3600.0
"""The match time in s after which a game is broken off, if no other one is given."""
OUTCOMES = {1.0: "won", 0.5: "drawn", 0.0: "lost"}
"""What the points of a strategy in a game mean, in words."""


class Pairing(Struct, frozen=True, order=True):
    """Two strategies that play against each other, by their labels. A strategy may play against itself."""

    first: str
    second: str

    @property
    def labels(self) -> tuple[str, str]:
        """The labels of both."""
        return self.first, self.second

    def __str__(self) -> str:
        return f"{self.first} and {self.second}"


class ScheduledGame(Struct, frozen=True, kw_only=True):
    """A game that is to be played.

    Args:
        pairing: the strategies.
        number: the number of the game in this pairing, from 0. Games 2 n and 2 n + 1 are pair number n: they have the
            same seed, and swapped sides.
        seed: the seed of the match.
        first_team, second_team: the teams that play by the first and by the second strategy.
        only: the only team that plays by one of the two, if the other one goes on as it was recorded; None if both do.
    """

    pairing: Pairing
    number: int
    seed: int
    first_team: str
    second_team: str
    only: str | None = None

    @property
    def sides(self) -> list[str]:
        """Each strategy and its team, in words, the first one first."""
        teams = (self.first_team, self.second_team)
        return [f"{label} as {team}" for team in teams if (label := self.label(team)) is not None]

    def label(self, team: str) -> str | None:
        """The label of the strategy that a team plays by; None if it plays by none of the two."""
        if self.only not in (None, team):
            return None
        return {self.first_team: self.pairing.first, self.second_team: self.pairing.second}.get(team)

    @property
    def pair(self) -> int:
        """The number of the pair, from 0."""
        return self.number // 2


class Played(Struct, frozen=True, kw_only=True):
    """The result of a game.

    Args:
        ended: OVER, BROKEN_OFF, FAILED or INVALID. problem: why it did not come to its end, or is not
            valid, in words; empty otherwise.
        winner: the winning team, `draw` or `nobody`; None if the game did not come to its end. A game that is not valid
            is lost for the team whose code alone could change it, and a draw if both could.
        score: the points of each team in the game's own count.
        calls: how often each rule was called, by the team of the player that the call names first; the team is empty
            for calls that name no player.
        match_time: the match time at the end, s. play_time: the time of play, s. None if the game failed.
        disqualified: the players that were disqualified.
        failures: what has failed in the code of players, in words. failing: the player of each of them.
        wall_time: the real time that the game took, s. thinking: that which the code of each player took.
        fingerprint: what computed the game; None if that is not known.
    """

    ended: str
    problem: str = ""
    winner: str | None = None
    score: dict[str, int] = {}
    calls: dict[str, dict[str, int]] = {}
    match_time: float | None = None
    play_time: float | None = None
    disqualified: list[str] = []
    failures: list[str] = []
    failing: list[str] = []
    wall_time: float = 0.0
    thinking: dict[str, float] = {}
    fingerprint: Fingerprint | None = None


class GameRecord(Struct, frozen=True, kw_only=True):
    """One line of the record: a game with its outcome.

    Args:
        teams: the team of each player.
    """

    game: ScheduledGame
    played: Played
    teams: dict[str, str]

    @property
    def points(self) -> float:
        """The points of the first strategy: 1 for a win, 0 for a loss, and 0.5 for everything else."""
        return {self.game.first_team: 1.0, self.game.second_team: 0.0}.get(self.played.winner or "", 0.5)

    @property
    def winner(self) -> str | None:
        """The label of the strategy that has won; None if none has."""
        return self.label(self.played.winner or "")

    def score(self, teams: Iterable[str]) -> str:
        """The points of these teams in the game's own count, such as `2 : 1`; a dash where they are not known."""
        return " : ".join(str(self.played.score.get(team, "-")) for team in teams)

    def calls_on(self, rule: str, label: str) -> int | None:
        """The number of calls of a rule on players of a strategy; None if no team played by it."""
        of_teams = [self.calls(rule, team) for team in dict.fromkeys(self.teams.values()) if self.label(team) == label]
        return sum(of_teams) if of_teams else None

    def label(self, team: str) -> str | None:
        """The label of the strategy that a team played by; None if it played by none of the two."""
        return self.game.label(team)

    def calls(self, rule: str, team: str) -> int:
        """The number of calls of a rule on players of a team."""
        counts: Mapping[str, int] = self.played.calls.get(rule, {})
        return counts.get(team, 0)

    def total(self, rule: str) -> int:
        """The number of calls of a rule."""
        return sum(self.played.calls.get(rule, {}).values())
