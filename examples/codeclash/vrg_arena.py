"""VRG as an arena of CodeClash, in which language models write players and play tournaments by their code.

In a clone of CodeClash (https://github.com/CodeClash-ai/CodeClash), in its environment; VRG is the folder of VRG:

    docker build -f VRG/deploy/container/Containerfile -t vrg VRG
    python VRG/examples/codeclash/vrg_arena.py run VRG/examples/codeclash/vrg.yaml

The words after its name are those of the command `codeclash`.
"""

import csv
import random
import re
import shlex
from collections.abc import Iterable
from pathlib import Path
from typing import Any, ClassVar

import codeclash.arenas
from codeclash.agents.player import Player
from codeclash.arenas.arena import CodeArena, RoundStats
from codeclash.cli.app import app
from codeclash.constants import RESULT_TIE

GAMES = "games.csv"
"""The file with a line for each game. It has `first`, `second`, and the points of the first: 1, 0.5 or 0."""
PLACE = "/tmp/round"
"""The folder in the container where a round is played."""
_PRIVATE = ("problem", "play_again")
"""Its columns that the players do not find: others' code could choose the text of an error."""


def labels(names: Iterable[str]) -> dict[str, str]:
    """The name of each player in files and tables: of letters, digits and _ alone, and no two alike."""
    return {name: f"p{n}_{re.sub(r'[^A-Za-z0-9]+', '_', name)[:40]}" for n, name in enumerate(sorted(names), 1)}


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
The logs of each round have `games.csv`: each game, with the referee's calls by rules.
"""
    default_args: ClassVar[dict[str, Any]] = {
        "match": "match.toml", "seed": None, "sandbox": True, "timeout": 3600,
    }  # fmt: skip
    _able: tuple[str, ...] = ()
    """The players that could play where no round could be played."""

    def _setting(self, name: str) -> Any:
        return self.game_config.get(name, self.default_args[name])

    def _match(self) -> str:
        sealing = "" if self._setting("sandbox") else " --no-sandbox"
        return f"--match {shlex.quote(self._setting('match'))}{sealing}"

    def validate_code(self, agent: Player) -> tuple[bool, str | None]:
        """Let it play alone, and a game of each side."""
        command = f"vrg league check {self.submission} --match {shlex.quote(self._setting('match'))}"
        done = agent.environment.execute(command, timeout=self._setting("timeout"))
        if done["returncode"] == 0:
            return True, None
        # What its code has raised is in there, and all players find what is returned here.
        self.logger.warning(done["output"])
        return False, f"it cannot play: `{command}` tells why"

    def execute_round(self, agents: list[Player]) -> None:
        """Let each play against each other, as often as `sims_per_round` says, on both sides."""
        # Each in a file of its own name, by which the tables call it.
        known = labels(agent.name for agent in agents)
        sources = {name: shlex.quote(f"/{name}/{self.submission}") for name in known}
        copies = " && ".join(f"cp {sources[name]} {PLACE}/{label}.py" for name, label in known.items())
        files = " ".join(f"{PLACE}/{label}.py" for label in known.values())
        seed = self._setting("seed")
        # Others each round, or players would be written for the noise of a few games.
        seed = random.randrange(1_000_000) if seed is None else seed
        command = (
            f"rm -rf {PLACE} && mkdir {PLACE} && {copies} && vrg tournament {files} {self._match()} --all"
            f" --games {self.game_config['sims_per_round']} --seed {seed} --output {PLACE}/played"
            f" && cd {PLACE}/played && cp {GAMES} {self.log_env}"
        )
        self.logger.info(f"Running game: {command}")
        done = self.environment.execute(command, timeout=self._setting("timeout"))
        self._able = ()
        if done["returncode"] != 0:
            # Somebody plays in its own container and not here: the others win.
            lines = done["output"].splitlines()
            failing = {name for name, label in known.items() if any(line.startswith(f"{label}: ") for line in lines)}
            if not failing or failing == known.keys():
                raise RuntimeError(done["output"])
            self.logger.error(done["output"])
            self._able = tuple(known.keys() - failing)

    def get_results(self, agents: list[Player], round_num: int, stats: RoundStats) -> None:
        """The points of all games: 1 for a win, and a half for a draw."""
        scores = {agent.name: float(agent.name in self._able) for agent in agents}
        names = {label: name for name, label in labels(scores).items()}
        for game in _published(self.log_round(round_num) / GAMES, names):
            first, second, points = game["first"], game["second"], float(game["first_points"])
            scores[first] += points
            scores[second] += 1.0 - points
            stats.details.append(
                f"{first} ({game['first_team']}) against {second} ({game['second_team']}):"
                f" {game['first_score']} to {game['second_score']}"
            )
        stats.scores = scores
        for name, score in scores.items():
            stats.player_stats[name].score = score
        best = [name for name, score in scores.items() if score == max(scores.values())]
        stats.winner = best[0] if len(best) == 1 else RESULT_TIE


def _published(table: Path, names: dict[str, str]) -> list[dict[str, str]]:
    """The games of a round, whose file is written anew as the players find it; none where it is missing."""
    if not table.exists():
        return []
    with table.open(encoding="utf-8", newline="") as file:
        reader = csv.DictReader(file)
        games = [{key: names.get(text, text) for key, text in game.items()} for game in reader]
    with table.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(
            file, [key for key in reader.fieldnames or () if key not in _PRIVATE], extrasaction="ignore"
        )
        writer.writeheader()
        writer.writerows(games)
    return games


if __name__ == "__main__":
    codeclash.arenas.ARENAS.append(VRGArena)
    app()
