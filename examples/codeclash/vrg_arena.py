"""VRG as an arena of CodeClash, in which language models write players and play tournaments by their code.

In a clone of CodeClash (https://github.com/CodeClash-ai/CodeClash), in its environment, once VRG's image is built:

    docker build -f deploy/container/Containerfile -t vrg .       in the top folder of VRG
    python .../examples/codeclash/vrg_arena.py run .../examples/codeclash/vrg.yaml

The words after its name are those of the command `codeclash`.
"""

import csv
import random
import shlex
from typing import Any, ClassVar

import codeclash.arenas
from codeclash.agents.player import Player
from codeclash.arenas.arena import CodeArena, RoundStats
from codeclash.cli.app import app
from codeclash.constants import RESULT_TIE
from codeclash.utils.environment import assert_zero_exit_code

GAMES = "games.csv"
"""The file with a line for each game. It has `first`, `second`, and the points of the first: 1, 0.5 or 0."""
PLACE = "/tmp/round"
"""The folder in the container where a round is played."""
_SHOWN = f"{GAMES} ratings.csv report.md tournament.png"
"""What the players find of a round: neither code nor errors of others."""


class VRGArena(CodeArena):
    """Robots play Sharks and Minnows by physics and under a referee."""

    name = "VRG"
    submission = "player.py"
    description = """VRG: robots with physics and sensors play games that a referee decides.

Your bot is `player.py` alone, with one class that extends `vrg.agents.Strategy`. It plays for each robot of its team,
in turn each team of the match: as the shark, and as the minnows. `match.toml` is a match like those of the arena.
    vrg league check player.py --match match.toml                             what the arena checks
    vrg compare player.py sharks-and-minnows --match match.toml --games 20    against VRG's own player
    vrg play match.toml --headless, and then vrg run why                      a match, and its calls with their reasons
The logs of each round have the games (`games.csv`, with the referee's calls by rules) and a report.
"""
    default_args: ClassVar[dict[str, Any]] = {
        "sims_per_round": 20, "match": "match.toml", "seed": None, "sandbox": True, "timeout": 3600,
    }  # fmt: skip

    def _setting(self, name: str) -> Any:
        return self.game_config.get(name, self.default_args[name])

    def _match(self) -> str:
        sealing = "" if self._setting("sandbox") else " --no-sandbox"
        return f"--match {shlex.quote(self._setting('match'))}{sealing}"

    def validate_code(self, agent: Player) -> tuple[bool, str | None]:
        """Let it play alone, and a game of each side."""
        done = agent.environment.execute(
            f"vrg league check {self.submission} --match {shlex.quote(self._setting('match'))}",
            timeout=self._setting("timeout"),
        )
        return (True, None) if done["returncode"] == 0 else (False, done["output"])

    def execute_round(self, agents: list[Player]) -> None:
        """Let each play against each other, as often as `sims_per_round` says, on both sides."""
        # Each in a file of its own name, by which the tables call it.
        place, names = PLACE, [shlex.quote(agent.name) for agent in agents]
        copies = " && ".join(f"cp /{name}/{self.submission} {place}/{name}.py" for name in names)
        files = " ".join(f"{place}/{name}.py" for name in names)
        seed = self._setting("seed")
        # Others each round, or players would be written for the noise of a few games.
        seed = random.randrange(1_000_000) if seed is None else seed
        command = (
            f"rm -rf {place} && mkdir {place} && {copies} && vrg tournament {files} {self._match()} --all"
            f" --games {self._setting('sims_per_round')} --seed {seed} --output {place}/played"
            f" && cd {place}/played && cp {_SHOWN} {self.log_env}"
        )
        self.logger.info(f"Running game: {command}")
        assert_zero_exit_code(self.environment.execute(command, timeout=self._setting("timeout")), logger=self.logger)

    def get_results(self, agents: list[Player], round_num: int, stats: RoundStats) -> None:
        """The points of all games: 1 for a win, and a half for a draw."""
        scores = {agent.name: 0.0 for agent in agents}
        with (self.log_round(round_num) / GAMES).open(encoding="utf-8", newline="") as file:
            for game in csv.DictReader(file):
                points = float(game["first_points"])
                scores[game["first"]] += points
                scores[game["second"]] += 1.0 - points
                stats.details.append(
                    f"{game['first']} ({game['first_team']}) against {game['second']} ({game['second_team']}):"
                    f" {game['first_score']} to {game['second_score']}, {game['ended'] or game['problem']}"
                )
        stats.scores = scores
        for name, score in scores.items():
            stats.player_stats[name].score = score
        best = [name for name, score in scores.items() if score == max(scores.values())]
        stats.winner = best[0] if len(best) == 1 else RESULT_TIE


if __name__ == "__main__":
    codeclash.arenas.ARENAS.append(VRGArena)
    app()
