"""The same match on every computer: what takes part in one uses portable arithmetic only."""

import ast
import platform
import re
import runpy
import shutil
import subprocess
import sysconfig
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import vrg
from tests.arithmetic import Environment, on_aarch64, printed, with_musl, without_fma
from tests.digests import played

ROOT = Path(vrg.__file__).parents[1]
ROOMS = (
    "vrg",
    "plugins/vrg-class/vrg_class/opponents.py",
    "plugins/vrg-learn/vrg_learn/batch",
    "plugins/vrg-learn/vrg_learn/observation.py",
    "plugins/vrg-locate/vrg_locate/mocap",
    "examples/my-robot",
    "examples/lion-and-man",
)
"""What takes part in a match, but for EXCEPTIONS."""
EXCEPTIONS = {
    "vrg/portable": "it has the rounded numbers of the normal distribution",
    "vrg/ui": "windows and plots are pictures of a match",
    "vrg/testing": "tests take part in no match",
    "vrg/commands": "commands print what a match was",
    "vrg/runs": "it reads what a match was",
    "vrg/bus/clock_tracker.py": "it measures times, which are never the same",
    "vrg/bus/process.py": "it counts what was dropped",
    "vrg/hal/can/odrive/messages.py": "it adds the bits of errors",
    "vrg/hal/can/workshop/odrive/listener.py": "it adds the bits of errors",
    "vrg/hal/can/meeting.py": "it counts reports",
    "vrg/hal/sensors/laser.py": "it asks whether a sum is finite",
    "vrg/games/look.py": "the lines of a picture",
    "vrg/hal/sim/sensors/renderer.py": "the pictures of cameras; PyBullet's renderer is not portable either",
}
PORTABLE = {
    *("pi", "tau", "inf", "nan", "hypot", "dist", "sqrt", "floor", "ceil", "trunc", "fmod", "remainder", "fabs"),
    *("copysign", "isfinite", "isinf", "isnan", "isclose", "degrees", "radians", "ldexp", "frexp", "ulp", "gcd"),
}
"""What of `math` is exact, or Python's own code."""
PORTABLE_OF_NUMPY = {
    *("array", "asarray", "ascontiguousarray", "empty", "empty_like", "zeros", "zeros_like", "ones", "full", "eye"),
    *("diag", "arange", "linspace", "frombuffer", "float64", "float32", "int64", "uint64", "uint8", "intp", "bool_"),
    *("dtype", "recarray", "inf", "nan", "pi", "newaxis", "random", "errstate", "ix_", "iscomplexobj", "isfinite"),
    *(
        "concatenate",
        "stack",
        "column_stack",
        "split",
        "pad",
        "insert",
        "repeat",
        "roll",
        "transpose",
        "moveaxis",
        "diff",
        "unique",
    ),
    *(
        "where",
        "copyto",
        "column_stack",
        "clip",
        "maximum",
        "minimum",
        "max",
        "min",
        "abs",
        "sign",
        "copysign",
        "negative",
        "sqrt",
    ),
    *("multiply", "subtract", "add", "reciprocal", "square", "floor", "rint", "round", "fmod", "fmin", "cumsum"),
    *("sort", "argsort", "searchsorted", "argmax", "flatnonzero", "count_nonzero", "isin", "isnan", "logical_and"),
    *("ndarray",),
}
"""What of numpy is exact, or moves numbers only, or adds them in its own order whatever the processor is."""
METHODS = {"dot", "mean", "std", "var"}
"""The methods of arrays that a library computes."""
DRAWS = {
    *("standard_normal", "normal", "exponential", "standard_exponential", "gauss", "normalvariate", "expovariate"),
    *("lognormal", "lognormvariate", "poisson", "gamma", "gammavariate", "betavariate", "laplace", "binomial"),
    *("vonmisesvariate", "weibullvariate", "paretovariate"),
}
"""The draws that need a logarithm."""


def not_portable(source: str) -> Iterator[tuple[int, str]]:
    """The lines of a module with arithmetic whose last bits depend on the computer, and what to write in its place."""
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Attribute(value=ast.Name(id="math"), attr=name) if name not in PORTABLE:
                yield node.lineno, f"math.{name}: use vrg.portable.scalars"
            case ast.Attribute(value=ast.Name(id="np"), attr=name) if name not in PORTABLE_OF_NUMPY:
                yield node.lineno, f"np.{name}: use vrg.portable.arrays"
            case ast.ImportFrom(module="math" | "cmath" | "numpy" | "numpy.linalg" | "statistics"):
                yield node.lineno, f"from {node.module} import: write {node.module}. in front, so that it is seen here"
            case ast.Import(names=names) if any(_is_hidden(name) for name in names):
                yield node.lineno, "import math, and import numpy as np: other names are not seen here"
            case ast.Attribute(attr=name) if name in DRAWS:
                yield node.lineno, f"{name}: use vrg.portable.arrays.normals"
            case ast.Call(func=ast.Attribute(attr=name)) if name in METHODS:
                yield node.lineno, f"{name}: use vrg.portable"
            case ast.BinOp(op=ast.MatMult()) | ast.AugAssign(op=ast.MatMult()):
                yield node.lineno, "@: use vrg.portable.arrays.product"
            case ast.BinOp(op=ast.Pow()) if not all(isinstance(side, ast.Constant) for side in (node.left, node.right)):
                yield node.lineno, "**: use vrg.portable.scalars.square"
            case ast.AugAssign(op=ast.Pow()) | ast.Call(func=ast.Name(id="pow")):
                yield node.lineno, "**= and pow: use vrg.portable.scalars.square"
            case ast.Call(func=ast.Name(id="sum"), args=[added, *_]) if not _counts(added):
                yield node.lineno, "sum: use vrg.portable.scalars.total, or len() or a comparison if it counts"


def _is_hidden(name: ast.alias) -> bool:
    own = {"math": None, "numpy": "np"}
    return name.name in ("cmath", "numpy.linalg") or (name.name in own and name.asname != own[name.name])


def _counts(added: ast.expr) -> bool:
    """True if a sum is of whole numbers, as one sees: of comparisons, of lengths, or of what `int` gives."""
    one = added.elt if isinstance(added, ast.GeneratorExp) else added
    if isinstance(one, ast.Call) and isinstance(one.func, ast.Name):
        named = one.args[0] if one.func.id == "map" else one.func
        return isinstance(named, ast.Name) and named.id in ("len", "int", "bool")
    name = one.id if isinstance(one, ast.Name) else one.attr if isinstance(one, ast.Attribute) else ""
    return isinstance(one, ast.Compare) or name.startswith("count")


def modules(room: str) -> list[Path]:
    """The modules of a room, or the one that it is."""
    return [ROOT / room] if room.endswith(".py") else sorted((ROOT / room).rglob("*.py"))


def is_in(name: str, room: str) -> bool:
    return name == room or name.startswith(f"{room}/")


def test_what_takes_part_in_a_match_uses_portable_arithmetic() -> None:
    found = [
        f"{name}:{line}: {what}"
        for room in ROOMS
        for path in modules(room)
        if not any(is_in(name := path.relative_to(ROOT).as_posix(), exception) for exception in EXCEPTIONS)
        for line, what in not_portable(path.read_text(encoding="utf-8"))
    ]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("name", EXCEPTIONS)
def test_every_exception_is_needed(name: str) -> None:
    assert any(True for path in modules(name) for _ in not_portable(path.read_text(encoding="utf-8")))


@pytest.mark.parametrize(
    ("source", "seen"),
    [
        ("math.sin(1.0)", True), ("np.sin(a)", True), ("a @ b", True), ("a **= 2", True), ("x ** 2", True),
        ("from math import sin", True), ("sum(a)", True), ("rng.standard_normal(3)", True), ("np.linalg.inv(a)", True),
        ("import math as m", True), ("import numpy.linalg as la", True), ("pow(x, 2)", True), ("a.dot(b)", True),
        ("sum(map(f, a))", True), ("sum(map(len, a))", False), ("np.mean(a)", True), ("np.fft.fft(a)", True),
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
    assert same("'roboflag', 1, 2, 8, noisy='red2'", without_fma())


def test_a_strategy_that_takes_sines_from_the_c_library_plays_another_match_there() -> None:
    assert not same("'sharks-and-minnows', 1, noisy='player1', module='math'", without_fma())


def test_a_match_is_the_same_with_another_c_library(tmp_path: Path) -> None:
    assert same("'roboflag', 1, noisy='red2'", with_musl(tmp_path))


def assembly(*flags: str) -> str:
    """The instructions of the kernel for processors with fused multiply-add, compiled with flags."""
    headers = Path(sysconfig.get_path("include"))
    if platform.machine() != "x86_64" or shutil.which("gcc") is None or not (headers / "Python.h").exists():
        pytest.skip("needs gcc and the headers of Python on an x86-64 processor")
    command = ["gcc", "-S", "-march=x86-64-v3", f"-I{headers}", "-o", "-", *flags]
    sources = sorted((ROOT / "vrg" / "hal" / "sim" / "kernel").glob("*.c"))
    made = [subprocess.run([*command, str(path)], check=True, capture_output=True, text=True) for path in sources]
    return "".join(one.stdout for one in made)


def test_the_kernel_rounds_every_product_and_every_sum() -> None:
    flags = runpy.run_path(str(ROOT / "setup.py"))["EXACT"]
    contracted = re.compile(r"\bvfn?m(add|sub)")
    assert contracted.search(assembly("-O2")), "a compiler contracts them unless it is told not to"
    exact = assembly(*flags)
    assert "vmulsd" in exact
    assert not contracted.search(exact)


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
