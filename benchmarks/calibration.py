"""Robots with hidden numbers, found by the figure of `vrg can calibrate --fixes`.

Emulated drives on CAN frames, in one process, have a friction, a delay, a current limit and a top speed of their own,
and wheels and a track that are not as VRG believes; a simulated camera (15 Hz, 1 cm, 1 degree, 100 ms late, 5 % lost)
sees the robot drive the figure for 90 s. `inside` is how often the truth was inside the 95 % interval, `within 5 %` how
often the number found was that near to it: of ratios, speeds and the track themselves, not of what they were off by.
"""

import math
import random
import sys
import tempfile
from pathlib import Path
from typing import Any

import tomlkit
from common import arguments, quantile, show

sys.path.sort(key=lambda folder: folder == str(Path(__file__).resolve().parent))  # there is a can.py there, too

from vrg.config.loading import load_match, read_match
from vrg.hal.can.workshop.motor import MotorModel
from vrg.hal.models import robot_model
from vrg.launch.nodes.recorder import recorder_node
from vrg.launch.nodes.referee import open_journal
from vrg.playing.in_process import play
from vrg.runs.run_folder import RunFolder
from vrg_locate.figure import figure_match
from vrg_locate.robots import findings_of, read_learned

RATIO = 50.0
"""Turns of a motor for one turn of its wheel."""
MATCH: dict[str, Any] = {
    **{"name": "hidden", "game": "practice", "map": "open", "engine": "planar", "rules": {}},
    "players": [{"name": "ann", "role": "player", "backend": "can", "localisation": "fusion", "x": 0.0, "y": 0.0}],
}


def hidden(seed: int) -> tuple[dict[str, Any], dict[str, float]]:
    """The tables of a match file with a robot of hidden numbers, and these numbers as the report names them."""
    rng = random.Random(seed)
    motor = {
        "friction": rng.uniform(0.01, 0.12),
        "delay": rng.uniform(0.0, 0.12),
        "current_limit": rng.uniform(7.0, 12.0),
        "velocity_limit": rng.uniform(42.0, 49.0),
    }
    errors = {"way": rng.gauss(0.0, 0.02), "turn": rng.gauss(0.0, 0.03), "bend": math.degrees(rng.gauss(0.0, 0.02))}
    source = {"source": "sim", "rate": 15.0, "delay": 0.1, "loss": 0.05, "errors": {"ann": errors}}
    wiring = {"left": [0], "right": [1], "ratio": RATIO, "motor": motor}
    backend = {"interface": "virtual", "channel": "hidden", "emulate": True, "robots": {"ann": wiring}}
    own, rim = MotorModel(**motor), math.tau * robot_model("P2AT").drivetrain.wheel_radius / RATIO
    torque, per = own.current_limit * own.torque_constant, rim / (own.inertia * math.tau)
    truth = {
        "delay": own.delay + own.response,
        "acceleration": (torque - own.friction) * per,
        "braking": (torque + own.friction) * per,
        "friction": own.friction * per,
        "top": own.velocity_limit * rim,
        **errors,
        "bend": math.radians(errors["bend"]),
    }
    return {"seed": seed, "backends": {"can": backend}, "localisation": {"overhead": source}}, truth


def found(seed: int, seconds: float) -> tuple[dict[str, tuple[float, float]], dict[str, float], float, float]:
    """What the figure shows of a robot: its numbers with half their intervals, the truth, and how far the robot was
    from its simulation before and after, cm."""
    tables, truth = hidden(seed)
    with tempfile.TemporaryDirectory() as home:
        file = Path(home) / "hidden.toml"
        file.write_text(tomlkit.dumps(MATCH | tables))
        text = figure_match(read_match(file), "ann", speed=0.7, way=1.5, seconds=seconds)
        file.write_text(text)
        setup, folder = load_match(file, seed=seed).at_rate(0.0), RunFolder(Path(home) / "run")
        folder.prepare()
        with open_journal(setup, folder) as journal:
            play(setup, journal, watchers=[recorder_node(setup, folder)], logs=folder.logs, limit=300.0)
        one = findings_of(folder, setup, read_learned(folder)["learned"])["ann"]
    assert one.likeness is not None
    return one.numbers, truth, 100.0 * one.likeness.before, 100.0 * one.likeness.after


def main() -> None:
    """Run the benchmark, and print its table."""
    parser = arguments(__doc__)
    parser.add_argument("--robots", type=int, default=100, help="how many")
    options = parser.parse_args()
    runs = [found(seed, 30.0 if options.quick else 90.0) for seed in range(3 if options.quick else options.robots)]
    rows = []
    for name in runs[0][1]:
        pairs = [(*numbers[name], truth[name]) for numbers, truth, _, _ in runs if math.isfinite(numbers[name][1])]
        whole = 1.0 if name in ("way", "turn") else 0.0
        far = [abs(mean - true) for mean, _, true in pairs]
        share = [abs(mean - true) / abs(whole + true) for mean, _, true in pairs]
        rows.append(
            {
                "number": name,
                "seen": len(pairs),
                "inside": sum(abs(mean - true) <= half for mean, half, true in pairs),
                "within 5 %": None if name == "bend" else sum(each <= 0.05 for each in share),
                "off, median": f"{quantile(far, 0.5):.2g}",
                "off, 95 %": f"{quantile(far, 0.95):.2g}",
                "interval, median": f"{quantile([half for _, half, _ in pairs], 0.5):.2g}",
            }
        )
    before, after = (quantile([run[n] for run in runs], 0.5) for n in (2, 3))
    notes = [f"{len(runs)} robots; from its simulation after 3 s: {before:.1f} cm, with what was found {after:.1f} cm"]
    show("hidden numbers, found by driving a figure", rows, notes, as_json=options.json)


if __name__ == "__main__":
    main()
