"""The workshop: emulated drives, and tools for people who look at a bus. A match with real drives never loads it.

emulated, motor, faults    what all emulated drives share, and the faults that they can be asked for
run, simulation            emulated drives on a bus, and buses in memory on simulated time
listener, survey           who speaks on a bus, as far as each protocol knows
odrive/                    its emulated drive, and its listener
"""
