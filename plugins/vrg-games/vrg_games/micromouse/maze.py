"""Mazes of square cells: their files, new ones by a seed, and the flood of distances. Pure functions.

Cell (x, y) is x cells east and y cells north of the start cell (0, 0), which is the corner in the south-west.
"""

import math
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from vrg.errors import ConfigError

CELL: Final = 0.18
"""The side of a cell, m, from the middle of a wall to that of the next."""
WALL: Final = 0.012
"""The thickness of a wall, m."""
Cell = tuple[int, int]
Edge = tuple[int, int, int]
"""The place of a wall: in the NORTH or in the EAST of a cell (x, y). Those of the border can be of cells outside."""
STEPS: Final = ((0, 1), (1, 0), (0, -1), (-1, 0))
"""The steps to the neighbours in the north, east, south and west. The number of a direction is its place here."""
NORTH, EAST, SOUTH, WEST = range(4)
START: Final = (0, 0)


def neighbour(cell: Cell, side: int) -> Cell:
    """The cell beyond a side of a cell."""
    return cell[0] + STEPS[side][0], cell[1] + STEPS[side][1]


def edge(cell: Cell, side: int) -> Edge:
    """The place of the wall on a side of a cell, which it shares with its neighbour."""
    return (*cell, side) if side in (NORTH, EAST) else (*neighbour(cell, side), side - 2)


def edges(size: int) -> Iterator[Edge]:
    """The places of all walls that a maze of this size can have, the border included."""
    for along in range(size):
        for line in range(-1, size):
            yield from ((along, line, NORTH), (line, along, EAST))


def border(size: int) -> set[Edge]:
    """The places of the outer walls."""
    return {(x, y, side) for x, y, side in edges(size) if (y if side == NORTH else x) in (-1, size - 1)}


def goal_cells(size: int) -> list[Cell]:
    """The four cells in the middle of a maze whose size is even."""
    middle = (size // 2 - 1, size // 2)
    return [(x, y) for x in middle for y in middle]


def flood(goals: Collection[Cell], is_open: Callable[[Edge], bool]) -> dict[Cell, int]:
    """The number of steps from each cell to the nearest goal; cells that lead to none are missing.

    Args:
        is_open: tells whether there is no wall at a place; it must be False for the border.
    """
    distance, ring = dict.fromkeys(goals, 0), list(goals)
    for cell in ring:  # which grows meanwhile
        for side in range(4):
            near = neighbour(cell, side)
            if near not in distance and is_open(edge(cell, side)):
                distance[near] = distance[cell] + 1
                ring.append(near)
    return distance


@dataclass(frozen=True)
class Maze:
    """A maze.

    Args:
        size: the number of cells along a side. It is even, so that four cells are in the middle.
        walls: the places of its walls.

    Raises:
        ConfigError: its border is open, its start cell is not open to the north alone, or no way leads to the middle.
    """

    size: int
    walls: frozenset[Edge]

    def __post_init__(self) -> None:
        if self.size < 4 or self.size % 2:
            raise ConfigError(f"expected an even number of cells, at least 4, along a side of a maze, got {self.size}")
        if not border(self.size) <= self.walls:
            raise ConfigError("expected a maze with walls all around")
        if edge(START, EAST) not in self.walls or edge(START, NORTH) in self.walls:
            raise ConfigError("expected a start cell in the south-west that is open to the north alone")
        if START not in self._distances():
            raise ConfigError("no way leads from the start cell to the middle")

    def _distances(self) -> dict[Cell, int]:
        return flood(goal_cells(self.size), lambda place: place not in self.walls)

    @property
    def steps(self) -> int:
        """The number of steps of a shortest way from the start cell to the middle."""
        return self._distances()[START]

    @property
    def maz(self) -> bytes:
        """A .maz file: a byte for each cell, from south to north in columns from west to east.

        Bits 0 to 3 of a byte are the walls in the north, east, south and west.
        """
        cells = (divmod(number, self.size) for number in range(self.size * self.size))
        return bytes(sum(map(int, ((edge(cell, side) in self.walls) << side for side in range(4)))) for cell in cells)

    @property
    def text(self) -> str:
        """The maze as text: `o` for posts, `---` and `|` for walls, S for the start cell and G for the middle."""
        posts = f"o{'   o' * self.size}"
        rows = [list(" " * len(posts) if row % 2 else posts) for row in range(2 * self.size + 1)]
        for place in self.walls:
            row, column = _in_text(place, self.size)
            if place[2] == NORTH:
                rows[row][column - 1 : column + 2] = "---"
            else:
                rows[row][column] = "|"
        for x, y in (START, *goal_cells(self.size)):
            rows[2 * (self.size - y) - 1][4 * x + 2] = "S" if (x, y) == START else "G"
        return "".join(f"{''.join(row)}\n" for row in rows)

    @property
    def toml(self) -> str:
        """The maze as a map of VRG: x to the east and y to the north, m, from the post in the south-west corner.

        A post without a wall, such as that in the middle, is left out.
        """
        lines = [
            'name = "maze"',
            "bounds = {{ x_min = 0.0, y_min = 0.0, x_max = {0:.2f}, y_max = {0:.2f} }}",
            "wall = [",
        ]
        for x, y, side in sorted(self.walls):
            start = (x, y + 1) if side == NORTH else (x + 1, y)
            ends = ", ".join(f"[{a * CELL:.2f}, {b * CELL:.2f}]" for a, b in (start, (x + 1, y + 1)))
            lines.append(f"  {{ points = [{ends}], thickness = {WALL} }},")
        return "\n".join([lines[0], lines[1].format(self.size * CELL), *lines[2:], "]\n"])


def _in_text(place: Edge, size: int) -> tuple[int, int]:
    """The row and the column of the middle of a wall in a maze as text."""
    x, y, side = place
    return (2 * (size - y) - 2, 4 * x + 2) if side == NORTH else (2 * (size - y) - 1, 4 * x + 4)


def from_maz(data: bytes) -> Maze:
    """Read a .maz file.

    Raises:
        ConfigError: it is not one, or of a maze that `Maze` refuses.
    """
    size = round(math.sqrt(len(data)))
    cells = {divmod(number, max(1, size)): byte for number, byte in enumerate(data)}
    maze = Maze(size, frozenset(edge(cell, side) for cell in cells for side in range(4) if cells[cell] >> side & 1))
    if maze.maz != bytes(byte & 15 for byte in data):
        raise ConfigError("expected a byte for each cell, in which neighbours agree on the wall between them")
    return maze


def from_text(text: str) -> Maze:
    """Read a maze as text. Any sign in the place of a wall is one.

    Raises:
        ConfigError: it is of a maze that `Maze` refuses.
    """
    rows = [*text.rstrip().splitlines(), ""]
    size = (len(rows) - 1) // 2
    signs = {place: _in_text(place, size) for place in edges(size)}
    return Maze(size, frozenset(at for at, (row, column) in signs.items() if rows[row][column : column + 1].strip()))


def generated(rng: np.random.Generator, size: int = 16) -> Maze:
    """A new maze: a random spanning tree of its cells, found by depth-first search, and some walls less for loops.

    At least one wall touches each post but that in the middle, and one entrance leads to the middle.

    Args:
        rng: draws whole numbers only. size: the number of cells along a side, even.
    """
    goals, first = goal_cells(size), neighbour(START, NORTH)
    around = [(goal, side) for goal in goals for side in range(4) if neighbour(goal, side) not in goals]
    gone = {edge(START, NORTH), edge(*around[int(rng.integers(len(around)))])}
    gone |= {edge(goal, side) for goal in goals for side in range(4) if neighbour(goal, side) in goals}
    left, way = {(x, y) for x in range(size) for y in range(size)} - {START, first, *goals}, [first]
    while way:
        sides = [side for side in range(4) if neighbour(way[-1], side) in left]
        if not sides:
            way.pop()
            continue
        side = sides[int(rng.integers(len(sides)))]
        gone.add(edge(way[-1], side))
        way.append(neighbour(way[-1], side))
        left.remove(way[-1])
    walls = set(edges(size)) - gone
    fixed = border(size) | {edge(cell, side) for cell in (START, *goals) for side in range(4)}
    inner = sorted(set(edges(size)) - fixed)
    for _ in range(2 * size):
        x, y, side = inner[int(rng.integers(len(inner)))]
        posts = ((x + 1, y + 1), (x, y + 1) if side == NORTH else (x + 1, y))
        if all(sum(int(wall in walls) for wall in _at_post(*post)) > 1 for post in posts):
            walls.discard((x, y, side))
    return Maze(size, frozenset(walls))


def _at_post(x: int, y: int) -> tuple[Edge, ...]:
    """The places of the four walls that touch the post in the south-west corner of a cell."""
    return (x - 1, y - 1, NORTH), (x, y - 1, NORTH), (x - 1, y - 1, EAST), (x - 1, y, EAST)
