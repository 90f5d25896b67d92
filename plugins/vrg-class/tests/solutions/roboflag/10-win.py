from vrg.games.roboflag.strategies import TeamPlayer
from vrg.games.roboflag.tactics import Tactic


class Player(TeamPlayer):
    class Mine(Tactic):
        def attackers(self, s):
            return s.ranked[:1]

    tactic = Mine()
