"""Learning: matches as environments for programs that learn to play.

`environment.MatchEnvironment` is a ParallelEnv of PettingZoo in which every player may learn, and
`single.PlayerEnvironment` an Env of Gymnasium for one player. Both need the extra `vrg[learn]`. All else here needs
numpy alone: `observation` is also what a strategy that has learned decides by in a match.
"""
