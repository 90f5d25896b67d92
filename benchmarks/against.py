"""Whole matches of this version beside those of another commit, in turns: `speed.py --against COMMIT`."""

import json
import os
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from common import median, write_match

HERE = Path(__file__).parent
TREE = HERE.parent
READER = """
from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer
from vrg.hal.sensors.laser import Laser

class Reader(SharksAndMinnowsPlayer):
    def act(self, view):
        view.readings.latest(Laser)
        return super().act(view)
"""
"""A player of Sharks and Minnows that reads its laser whenever it decides."""


def write_reader(folder: Path) -> str:
    """Write the player that reads its laser into a folder, and return its target as in a match file there."""
    (folder / "reader.py").write_text(READER, encoding="utf-8")
    return "reader.py:Reader"


@dataclass
class Whole:
    """A kind of match that both versions play.

    Args:
        name: for the table. match: a match file, or the name of a game. engine: the engine.
        lasers: whether there are any, and whether players read them. players: their strategies, by team.
        rounds: of each round what its matches have cost in the other version and in this one, s for each match second,
            and whether their journals and evidence are equal.
    """

    name: str
    match: str
    engine: str
    lasers: str
    players: dict[str, str] | None = None
    rounds: list[tuple[float, float, bool]] = field(default_factory=list)

    def row(self) -> dict[str, Any]:
        """Of the table."""
        ratios = sorted(there / here for there, here, _ in self.rounds)
        return {
            "match": self.name,
            "engine": self.engine,
            "lasers": self.lasers,
            "x real time": 1.0 / median([here for _, here, _ in self.rounds]),
            "times as fast": median(ratios),
            "from": ratios[0],
            "to": ratios[-1],
            "the same matches": "yes" if all(equal for *_, equal in self.rounds) else "no",
        }


def cases(folder: Path, robots: Sequence[int], engines: Sequence[str]) -> list[Whole]:
    """The default matches without lasers, and yards of Sharks and Minnows with lasers that nobody reads, and all read.

    Args:
        folder: for match files. robots: how many there are in each yard.
    """
    write_reader(folder)
    found = [Whole(game, game, engine, "as in its file") for engine in engines
             for game in ("sharks-and-minnows", "pursuit-evasion", "roboflag")]  # fmt: skip
    for count in robots:
        for engine in engines:
            for lasers, read in ((False, False), (True, False), (True, True)):
                place = folder / f"{count} {engine} {lasers}"
                place.mkdir(exist_ok=True)
                write_match(place, count, engine=engine, lasers=lasers)
                reader = f"{folder}/reader.py:Reader"
                players = dict.fromkeys(("sharks", "minnows"), reader) if read else None
                said = "none" if not lasers else "each player reads its own" if read else "nobody reads them"
                found.append(Whole(f"yard, {count} robots", f"{place}/match.toml", engine, said, players))
    return found


@contextmanager
def checked_out(commit: str) -> Iterator[Path]:
    """The files of a commit, in a folder of their own, with its compiled kernel if it has one."""
    with tempfile.TemporaryDirectory() as name:
        place = Path(name) / "tree"
        git = ["git", "-C", str(TREE), "worktree"]
        subprocess.run([*git, "add", "--quiet", "--detach", str(place), commit], check=True)
        try:
            if (place / "vrg/hal/sim/kernel").is_dir():
                build = [sys.executable, "setup.py", "--quiet", "build_ext", "--inplace"]
                subprocess.run(build, cwd=place, check=True, stderr=subprocess.DEVNULL)
            yield place
        finally:
            subprocess.run([*git, "remove", "--force", str(place)], check=True)


def cost(tree: Path, case: Whole, seeds: Sequence[int]) -> tuple[float, list[Any]]:
    """What a second of the matches of a version has cost, s of processor time, and their digests."""
    options = {"match": case.match, "engine": case.engine, "seeds": list(seeds), "sandbox": False}
    if case.players is not None:
        options["players"] = case.players
    path = os.pathsep.join(map(str, (tree, *sorted(tree.glob("plugins/vrg-*")))))
    done = subprocess.run(
        [sys.executable, "-P", str(HERE / "whole_match.py")], input=json.dumps(options), capture_output=True,
        text=True, env={**os.environ, "PYTHONPATH": path}, check=False,
    )  # fmt: skip
    if done.returncode:
        raise SystemExit(f"{tree}: {case.name}: a match cannot be played:\n{done.stderr}")
    told = [json.loads(line) for line in done.stdout.splitlines()]
    return sum(one["cost"] for one in told) / sum(one["seconds"] for one in told), [one["digests"] for one in told]


def compare(commit: str, found: Sequence[Whole], seeds: Sequence[int], rounds: int) -> list[str]:
    """Play all cases in turns, and return notes for the table."""
    with checked_out(commit) as other:
        for number in range(rounds):
            for case in found:
                (there, theirs), (here, ours) = cost(other, case, seeds), cost(TREE, case, seeds)
                case.rounds.append((there, here, theirs == ours))
                print(f"{number + 1}: {case.name} {case.engine} {case.lasers}: {there / here:.2f}", file=sys.stderr)
    built = "with" if "--enable-optimizations" in (sysconfig.get_config_var("CONFIG_ARGS") or "") else "without"
    return [
        f"against {commit}; {rounds} rounds of the seeds {', '.join(map(str, seeds))}, in turns, by processor time",
        f"this Python was built {built} profile-guided optimisation",
    ]
