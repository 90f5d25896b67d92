"""The games. Each is a folder with its settings, rules, player and default match, and one `Game` object about it.

Inside a game's folder the rules never import the player, and the player never imports the rules: they communicate by
messages. A package outside VRG adds a game by an entry point of the group `vrg.games` whose object is a `Game`.
"""

from collections.abc import Callable
from pathlib import Path

from vrg.games.game import Game
from vrg.registry import Registry, installed_by

GAMES: Registry[Game] = Registry(
    "game",
    "vrg.games",
    {
        "sharks-and-minnows": "vrg.games.sharks_and_minnows:GAME",
        "pursuit-evasion": "vrg.games.pursuit_evasion:GAME",
        "roboflag": "vrg.games.roboflag:GAME",
        "practice": "vrg.games.practice:GAME",
    },
    lambda found: None if isinstance(found, Game) else "expected a vrg.games.game.Game",
)
"""Every game by name."""

STRATEGIES: Registry[type] = Registry(
    "strategy",
    "vrg.strategies",
    {
        "sharks-and-minnows": "vrg.games.sharks_and_minnows.player:SharksAndMinnowsPlayer",
        "pursuer": "vrg.games.pursuit_evasion.pursuer:Pursuer",
        **{
            name: f"vrg.games.roboflag.strategies:{kind}"
            for name, kind in (
                ("conservative", "Conservative"),
                ("aggressive", "Aggressive"),
                ("aggressive-two-groups", "TwoGroups"),
                ("balanced", "Balanced"),
                ("team-flag", "TeamFlag"),
                ("tag-defense", "TagDefense"),
                ("flagged-safety", "FlaggedSafety"),
                ("hail-mary", "HailMary"),
                ("mixed", "Mixed"),
            )
        },
        "intruder": "vrg.games.pursuit_evasion.intruder:Intruder",
    },
    lambda found: None if isinstance(found, type) else "expected a class",
    besides="`module:Class`, `file.py:Class`, or the file of a policy (*.npz)",
)
"""Every strategy that a match file can choose by a name alone."""

STRATEGY_FILES: Registry[Callable[[Path], type]] = Registry("file of a strategy", "vrg.strategy_files", {})
"""What makes a class of strategies of a file that is no Python, by the ending of the file's name. VRG itself has none.
"""

UNKNOWN_GAME = Game(name="", settings="", rules="", strategy="", match="", roles=())
"""Stands for a game that is not installed on this machine. Its players are shown without colours of their own."""


def file_of(strategy: str) -> str | None:
    """The file in `file.py:Class`, and in `policy.npz`, which is one itself; None for `module:Class` and for names."""
    if is_strategy_file(strategy):
        return strategy
    path = strategy.rpartition(":")[0]
    return path if path.endswith(".py") else None


def is_strategy_file(strategy: str) -> bool:
    """True for the file of a strategy that is no Python; such a one is named by its path alone.

    It is True also where the plug-in of VRG that reads the file is not installed; see `unreadable`.
    """
    ending = Path(strategy).suffix[1:]
    # `file.py:Class` has no such ending; looking for it would read the metadata of every installed package.
    if not ending or ":" in ending:
        return False
    return installed_by(STRATEGY_FILES.group, ending) is not None or ending in STRATEGY_FILES


def unreadable(strategy: str) -> str | None:
    """Why the file of a strategy that is no Python cannot be read here, with what to install; None if it can be."""
    ending = Path(strategy).suffix[1:]
    wanted = None if ending in STRATEGY_FILES else installed_by(STRATEGY_FILES.group, ending)
    return wanted and f"{strategy}: expected a file that an installed package reads, got one of a kind that {wanted}"


def has_name(strategy: str) -> bool:
    """True for a strategy that is chosen by a name alone, which comes with an installed package."""
    return ":" not in strategy and file_of(strategy) is None


def strategies_of(name: str) -> list[str]:
    """The names of the strategies that come with a game, sorted: those in its own package."""
    game = GAMES.find(name)
    if game is None:
        return []
    package = game.rules.rpartition(".")[0]
    kinds = {strategy: STRATEGIES.find(strategy) for strategy in STRATEGIES.names()}
    return [
        strategy for strategy, kind in kinds.items() if kind is not None and kind.__module__.startswith(f"{package}.")
    ]


def game_of(name: str) -> Game:
    """Return the game of this name, for programs that only show it, or UNKNOWN_GAME if it is not installed here."""
    return (GAMES.find(name) if name else None) or UNKNOWN_GAME
