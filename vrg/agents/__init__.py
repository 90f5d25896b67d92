"""The player: its runtime, hybrid automata, control laws, and what a strategy is made from.

A strategy of one's own needs `from vrg.agents import Strategy, Twist, View`, and no more.
"""

from vrg.agents.strategy import Action, Strategy, View
from vrg.types import STILL, Pose, Twist

__all__ = ["STILL", "Action", "Pose", "Strategy", "Twist", "View"]
