"""The head-up display on the command line."""

from vrg.commands.groups import MatchOptions
from vrg.commands.options import PlayerArgument, RunOption
from vrg.commands.show import open_window
from vrg_views.hud import KIND


def hud(player: PlayerArgument, on: MatchOptions, run: RunOption = None) -> None:
    """Open the head-up display of a player: what it knows; Goto, Manual and Reset by button, key and gamepad."""
    open_window(on, KIND, player, run)
