"""Plays matches and prints what they leave, in processes that compute as other computers do; it needs VRG alone."""

import hashlib
import tempfile
from pathlib import Path

import vrg

HASH = """
import math
from vrg.agents.strategy import Action, Strategy, View
from {module} import sin
from vrg.types import Twist

class Hash(Strategy):
    def act(self, view: View) -> Action:
        noise = sin(12.9898 * view.pose.x + 78.233 * view.pose.y) * 43758.5453e9
        return Action(Twist(0.5, noise - math.floor(noise) - 0.5))
"""
"""A strategy that makes an error in the last bit visible: the well-known noise of graphics, 10^9 times as strong."""


def played(
    game: str, *seeds: int, engine: str = "planar", noisy: str = "", module: str = "vrg.portable.scalars"
) -> str:
    """The digests of what matches have left: journal, evidence, and what each node has published.

    Args:
        noisy: the player that is a file with HASH. module: where that has its sine from.
    """
    found = []
    for seed in seeds:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            (folder / "noise.py").write_text(HASH.replace("{module}", module), encoding="utf-8")
            players = {noisy: f"{folder}/noise.py"} if noisy else {}
            run = vrg.play(game, players, engine=engine, seed=seed, record=False, runs=folder)
            files = [run.path / file for file in ("journal.jsonl", "evidence.bin", "steps.jsonl")]
            found += [f"{seed}: " + " ".join(hashlib.sha256(file.read_bytes()).hexdigest()[:16] for file in files)]
    return "; ".join(found)
