"""The same match on every computer: what takes part in one uses portable arithmetic only."""

import ast
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import vrg
from tests.arithmetic import Environment, on_aarch64, printed, with_musl, without_fma
from tests.digests import played

ROOT = Path(vrg.__file__).parents[1]
ROOMS = ("vrg", "plugins/vrg-learn/vrg_learn/batch")
"""What takes part in a match, but for EXCEPTIONS."""
EXCEPTIONS = {
    "vrg/portable": "it has the rounded numbers of the normal distribution",
    "vrg/ui": "windows and plots are pictures of a match",
    "vrg/testing": "tests take part in no match",
    "vrg/commands": "commands print what a match was",
    "vrg/runs/result.py": "it counts",
    "vrg/bus": "it measures times, which are never the same",
    "vrg/hal/sensors/laser.py": "it asks whether a sum is finite",
    "vrg/games/look.py": "the lines of a picture",
    "vrg/hal/sim/sensors/renderer.py": "the pictures of cameras; PyBullet's renderer is not portable either",
}
PORTABLE = {
    *("pi", "tau", "inf", "nan", "hypot", "dist", "sqrt", "floor", "ceil", "trunc", "fmod", "remainder", "fabs"),
    *("copysign", "isfinite", "isinf", "isnan", "isclose", "degrees", "radians", "ldexp", "frexp", "ulp", "gcd"),
}
"""What of `math` is exact, or Python's own code."""
OF_A_LIBRARY = {
    *("sin", "cos", "tan", "arcsin", "arccos", "arctan", "arctan2", "hypot", "sinc", "sinh", "cosh", "tanh"),
    *("exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "power", "float_power", "cbrt", "angle"),
    *("dot", "vdot", "inner", "matmul", "einsum", "tensordot", "convolve", "correlate", "linalg", "interp", "polyfit"),
}
"""What of numpy is computed by the C library, by a BLAS, or with the instructions that a processor has."""
DRAWS = {"standard_normal", "normal", "exponential", "gauss", "normalvariate", "lognormal", "poisson", "gamma"}
"""The draws that need a logarithm."""


def not_portable(source: str) -> Iterator[tuple[int, str]]:
    """The lines of a module with arithmetic whose last bits depend on the computer, and what to write in its place."""
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Attribute(value=ast.Name(id="math"), attr=name) if name not in PORTABLE:
                yield node.lineno, f"math.{name}: use vrg.portable.scalars"
            case ast.Attribute(value=ast.Name(id="np" | "numpy"), attr=name) if name in OF_A_LIBRARY:
                yield node.lineno, f"np.{name}: use vrg.portable.arrays"
            case ast.ImportFrom(module="math" | "numpy" | "cmath"):
                yield node.lineno, f"from {node.module} import: write {node.module}. in front, so that it is seen here"
            case ast.Attribute(attr=name) if name in DRAWS:
                yield node.lineno, f"{name}: use vrg.portable.arrays.normals"
            case ast.BinOp(op=ast.MatMult()) | ast.AugAssign(op=ast.MatMult()):
                yield node.lineno, "@: use vrg.portable.arrays.product"
            case ast.BinOp(op=ast.Pow()) if not all(isinstance(side, ast.Constant) for side in (node.left, node.right)):
                yield node.lineno, "**: use vrg.portable.scalars.square"
            case ast.AugAssign(op=ast.Pow()):
                yield node.lineno, "**=: use vrg.portable.scalars.square"
            case ast.Call(func=ast.Name(id="sum"), args=[added, *_]) if not _counts(added):
                yield node.lineno, "sum: use vrg.portable.scalars.total, or len() or a comparison if it counts"


def _counts(added: ast.expr) -> bool:
    """True if a sum is of whole numbers, as far as one sees."""
    one = added.elt if isinstance(added, ast.GeneratorExp) else added
    name = one.id if isinstance(one, ast.Name) else one.attr if isinstance(one, ast.Attribute) else ""
    counted = name.startswith(("count", "dropped")) or name in ("AxisError", "identified")
    return counted or isinstance(one, ast.Compare) or (
        isinstance(one, ast.Call) and isinstance(one.func, ast.Name) and one.func.id in ("len", "map", "int")
    )  # fmt: skip


def test_what_takes_part_in_a_match_uses_portable_arithmetic() -> None:
    found = [
        f"{name}:{line}: {what}"
        for room in ROOMS
        for path in sorted((ROOT / room).rglob("*.py"))
        if not (name := path.relative_to(ROOT).as_posix()).startswith(tuple(EXCEPTIONS))
        for line, what in not_portable(path.read_text(encoding="utf-8"))
    ]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("name", EXCEPTIONS)
def test_every_exception_is_needed(name: str) -> None:
    paths = [ROOT / name] if name.endswith(".py") else [*(ROOT / name).rglob("*.py")]
    assert any(True for path in paths for _ in not_portable(path.read_text(encoding="utf-8")))


@pytest.mark.parametrize(
    ("source", "seen"),
    [
        ("math.sin(1.0)", True), ("np.sin(a)", True), ("a @ b", True), ("a **= 2", True), ("x ** 2", True),
        ("from math import sin", True), ("sum(a)", True), ("rng.standard_normal(3)", True), ("np.linalg.inv(a)", True),
        ("math.hypot(1, 2)", False), ("2 ** 32", False), ("sum(a == b for a in c)", False), ("np.sqrt(a)", False),
    ],
)  # fmt: skip
def test_the_rule_sees_what_is_not_portable(source: str, seen: bool) -> None:
    assert bool([*not_portable(source)]) == seen


def same(call: str, other: Environment) -> bool:
    """True if a call of `played` has the same result on this computer and on another one."""
    here, there = printed(f"from tests.digests import played; print(played({call}))", other)
    return here == there


def test_matches_are_the_same_on_a_processor_without_fused_multiply_add() -> None:
    assert same("'roboflag', 1, 2, 8", without_fma())


def test_a_match_is_the_same_with_another_c_library(tmp_path: Path) -> None:
    assert same("'roboflag', 1, noisy='red2'", with_musl(tmp_path))


SEEDS = ", ".join(map(str, range(15)))


@pytest.mark.thorough
@pytest.mark.parametrize("game", ["roboflag", "pursuit-evasion", "sharks-and-minnows"])
@pytest.mark.parametrize("other", [lambda _: without_fma(), with_musl], ids=["without fma", "musl"])
def test_many_matches_are_the_same_elsewhere(game: str, other: Callable[[Path], Environment], tmp_path: Path) -> None:
    assert same(f"{game!r}, {SEEDS}", other(tmp_path))


@pytest.mark.thorough
@pytest.mark.parametrize("game", ["roboflag", "pursuit-evasion", "sharks-and-minnows"])
def test_matches_on_mujoco_are_the_same_on_other_x86_processors(game: str) -> None:
    assert same(f"{game!r}, 1, 2, engine='mujoco'", without_fma())


@pytest.mark.thorough
@pytest.mark.parametrize("game", ["roboflag", "pursuit-evasion", "sharks-and-minnows"])
def test_matches_are_the_same_on_aarch64(game: str) -> None:
    assert on_aarch64(f"from tests.digests import played; print(played({game!r}, 1, 2))") == played(game, 1, 2)
