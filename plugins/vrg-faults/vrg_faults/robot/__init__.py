"""Seeded sequences of faults on a CAN bus: after each, the motors stand within a bound, or the fault is reported.

    vrg fuzz --protocol all --games 200                # of every protocol, from seed 0 on
    vrg fuzz --protocol moteus --seed 7 --games 1      # one life again, printed step by step

A seed is the life of one robot with two emulated drives on a simulated bus, and EPISODES sequences of faults in it. In
an episode it is under way, up to three things go wrong at once, then nothing does any more, its player falls silent,
an official lets it recover, and it must drive again. Everything is judged by what the motors truly do:

- A motor turns as it was asked a moment ago, or it stands; if not, a fault is reported within REPORT s.
- Once a fault is reported, or the emergency stop is, the motors stand within STOP s, unless it is reported that one is
  on although it was switched off.
- What the robot says of its wheels is what they do, or a fault is reported; its odometry never jumps.
- When no command comes any more, the motors stand within STOP s, whatever has become of the player.
- While nothing is wrong, nothing is reported; when everything is well again, it drives after a recovery or two.
- Nothing raises what it does not promise.
"""
