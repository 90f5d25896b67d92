"""Helpers for tests of engines."""

from itertools import combinations

from vrg.hal.sim.engine import Engine
from vrg.hal.sim.shapes import Box, box_gap, circle_gap

DT = 0.02


def run(engine: Engine, seconds: float) -> None:
    for _ in range(round(seconds / DT)):
        engine.step(DT)


def forward(engine: Engine, name: str, v: float, w: float = 0.0) -> None:
    """Command a body velocity, m/s and rad/s."""
    engine.command(name, *engine.models[engine.row(name)].wheels(v, w), brake=False)


def footprint(engine: Engine, row: int) -> Box:
    x, y, heading = engine.poses[row].tolist()
    return Box(x, y, heading, engine.models[row].length, engine.models[row].width)


def deepest_overlap(engine: Engine) -> float:
    """m by which any two bodies, or a body and a wall, overlap; 0 if none do."""
    bodies = [footprint(engine, row) for row in range(len(engine.names))]
    gaps = [box_gap(a, b).distance for a, b in combinations(bodies, 2)]
    gaps += [box_gap(a, wall).distance for a in bodies for wall in engine.map.boxes]
    gaps += [circle_gap(a, disc).distance for a in bodies for disc in engine.map.circles]
    return max(0.0, -min(gaps, default=0.0))
