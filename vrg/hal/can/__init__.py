"""Robots whose motors are on a CAN bus: the driver, motor controllers of several protocols, and emulated ones.

From the bottom up, each module can be read apart:

    frame, bus            a CAN bus: frames in and out, and what can go wrong with it
    axis, listener        what the layers above see of one motor axis, and of the nodes on a bus, whatever the protocol
    odrive/, cia402/      a protocol each: its codec, axis, listener, and emulated drive
    protocols             the protocols by name, also those of other packages
    base                  wheels from axes, odometry from encoders
    guard                 when the motors must be off
    watch                 the axes of one robot under their guard, and the lock that two threads share
    meeting, recovering   how a robot meets its drives, and how it recovers
    train                 the axes of one robot on their bus, driven
    driver                the backend `can`
    survey                who speaks on a bus
    emulator/             what all emulated drives share
"""
