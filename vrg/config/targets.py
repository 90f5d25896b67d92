"""Strategies as people name them."""

from pathlib import Path

from vrg.blame import failure_of
from vrg.errors import ConfigError
from vrg.games import is_strategy_file
from vrg.modules import classes_of, no_method, parsed
from vrg.registry import close_to


def whole_target(strategy: str) -> str:
    """A strategy as it was typed; that of a file, or of a module in the working folder, with the whole path.

    Raises:
        ConfigError: it is a folder, or a file without just one strategy.
    """
    if Path(strategy).is_dir():
        raise ConfigError(
            [f"expected a strategy, got the folder {strategy}: `vrg tournament {strategy}` lets all files in it play"]
        )
    if is_strategy_file(strategy):
        return str(Path(strategy).resolve())
    if strategy.endswith(".py"):
        strategy = f"{strategy}:{class_in(Path(strategy))}"
    path, colon, name = strategy.rpartition(":")
    file = path if path.endswith(".py") else f"{path}.py"
    return f"{Path(file).resolve()}{colon}{name}" if colon and Path(file).is_file() else strategy


def class_in(file: Path) -> str:
    """The name of the class of the strategy in a file, which is read and not run.

    Raises:
        ConfigError: there is no such file, it is no Python, or it has not exactly one such class.
    """
    try:
        found = classes_of(parsed(file)).items()
    except OSError:
        raise ConfigError([f"{file}: no such file; `vrg new player` writes one"]) from None
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise ConfigError([f"{file}: cannot be read as Python: {failure_of(error)}"]) from None
    # A class that is made from one of another file may have its method there.
    names = [name for name, kind in found if kind.acts] or [name for name, kind in found if kind.acts is None]
    misspelt = [
        no_method(f"{file}:{name}", "act", kind.methods) for name, kind in found if close_to("act", kind.methods)
    ]
    if not names and misspelt:
        raise ConfigError(misspelt)
    if len(names) != 1:
        raise ConfigError(
            [f"{file}: expected one class with a method `act`, found {', '.join(names) or 'none'}: type {file}:CLASS"]
        )
    return names[0]
