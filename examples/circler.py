"""The smallest player there is: it drives in circles, and asks the referee nothing."""

from vrg.agents import Strategy, Twist, View


class Circler(Strategy):
    """Half a metre a second, one turn in about six seconds."""

    def act(self, view: View) -> Twist:
        """The same twist for ever."""
        return Twist(v=0.5, w=1.0)
