"""The parts of a class that are functions: faults, progress."""

import re

import pytest

from vrg.bus.messages import Body, Call, RefereeState, Stage, Zone
from vrg.regions import Rectangle
from vrg.types import STILL, Pose
from vrg_class.faults import fault_of
from vrg_class.lesson import Goal
from vrg_class.progress import Progress


@pytest.mark.parametrize(
    ("text", "line", "time", "shown", "kind"),
    [
        (
            "NameError: name 'x' is not defined (code.py, line 7, in act) (at 3.1 s)", 7, 3.1,
            "NameError: name 'x' is not defined", "NameError",
        ),
        (
            "/a/b/code.py: cannot be read as Python: SyntaxError: invalid syntax (code.py, line 1)", 1, None,
            "SyntaxError: invalid syntax", "SyntaxError",
        ),
        (
            "/a/b/code.py:Mine: cannot be imported: ImportError: cannot import name 'wrap' from 'math' (/c/d.so) "
            "(code.py, line 2, in <module>)", 2, None,
            "ImportError: cannot import name 'wrap' from 'math'", "ImportError",
        ),
        (
            "ModuleNotFoundError: No module named 'numpyy' (<frozen importlib._bootstrap>, line 1140, in _find)", None,
            None, "ModuleNotFoundError: No module named 'numpyy'", "ModuleNotFoundError",
        ),
        (
            "/a/b/code.py: expected one class with a method `act`, found none: type /a/b/code.py:CLASS", None, None,
            "expected one class with a method `act`, found none", "",
        ),
        (
            "Mine.act: expected a Twist(v, w) or an Action, got 'fast' (code.py, line 5, in act)", 5, None,
            "Mine.act: expected", "answer",
        ),
        (
            "PermissionError: [Errno 13] Permission denied; the sandbox refused it: see docs (code.py, line 2, in act)",
            2, None, "PermissionError: [Errno 13] Permission denied", "PermissionError",
        ),
        ("it took too long", None, None, "it took too long", ""),
    ],
)  # fmt: skip
def test_a_failure_has_its_line_and_its_kind(
    text: str, line: int | None, time: float | None, shown: str, kind: str
) -> None:
    found = fault_of(text, "code.py")
    assert (found.line, found.time) == (line, time)
    assert found.text.startswith(shown)
    assert found.kind == kind
    assert not re.search(r"/a/b|CLASS|line|frozen|\.so|sandbox", found.text)


def state(total: float, score: int = 0, winner: str | None = None) -> RefereeState:
    zone = Zone(name="safe", kind="safe", region=Rectangle(-1.0, 9.0, 1.0, 11.0))
    return RefereeState(
        game="g", stage=Stage.PLAY_ROUND, halted=None, way_out=None, waiting=(), clock=total, total=total, round=1,
        rounds=1, score={"red": score, "blue": 1}, players=(), zones=(zone,), winner=winner,
    )  # fmt: skip


def body(x: float, y: float, theta: float = 0.0, name: str = "r") -> Body:
    return Body(name=name, pose=Pose(x, y, theta), twist=STILL, physical=False)


def call(rule: str, *names: str) -> Call:
    return Call(rule=rule, text=rule, players=names)


@pytest.mark.parametrize(
    ("goal", "steps", "reached"),
    [
        (Goal(zone="safe"), [(1.0, body(0, 0), ()), (2.0, body(0, 10), ())], 2.0),
        (Goal(zone="safe"), [(1.0, body(0, 10, name="b"), ())], None),
        (Goal(zone="safe", within=1.5), [(1.0, body(0, 0), ()), (2.0, body(0, 10), ())], None),
        (Goal(way=3.0), [(1.0, body(0, 0), ()), (2.0, body(0, 2), ()), (3.0, body(0, 0), ())], 3.0),
        (Goal(turned=360), [(0.1 * n, body(0, 0, 0.5 * n), ()) for n in range(20)], 1.3),
        (Goal(call="tag"), [(1.0, body(0, 0), (call("tag", "b"),)), (2.0, body(0, 0), (call("tag", "r"),))], 2.0),
        (Goal(against="tag"), [(1.0, body(0, 0), (call("tag", "b"),))], 1.0),
        (Goal(zone="safe", never="tag"), [(1.0, body(0, 0), (call("tag", "r"),)), (2.0, body(0, 10), ())], None),
        (Goal(), [(1.0, body(0, 10), ())], None),
    ],
)
def test_a_goal_is_reached_when_all_of_it_holds(
    goal: Goal, steps: list[tuple[float, Body, tuple[Call, ...]]], reached: float | None
) -> None:
    progress = Progress(goal, "red", ("r",), ("b",))
    for time, where, calls in steps:
        progress.take(state(time), [where], calls, printed=False)
    assert progress.reached == (None if reached is None else pytest.approx(reached))


def test_points_leads_wins_and_what_is_printed_count() -> None:
    for goal, good in ((Goal(points=2), 2), (Goal(ahead=1), 2), (Goal(wins=True), 1), (Goal(prints=True), 1)):
        progress = Progress(goal, "red", ("r",), ("b",))
        progress.take(state(1.0, 0), [], [], printed=False)
        assert progress.reached is None
        progress.take(state(2.0, good, "red"), [], [], printed=True)
        assert progress.reached == 2.0, goal
