"""The same match on every computer: what takes part in one uses portable arithmetic only."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import vrg

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
