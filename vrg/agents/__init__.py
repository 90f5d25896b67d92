"""The player: its runtime, hybrid automata, control laws, and what a strategy is made from.

To write a strategy, `from vrg.agents import Strategy, Twist, View` is enough.
"""

from vrg.agents.strategy import Action, Strategy, View
from vrg.bus.messages import Sighting, Stroke
from vrg.types import STILL, Pose, Twist

__all__ = ["STILL", "Action", "Pose", "Sighting", "Strategy", "Stroke", "Twist", "View"]
