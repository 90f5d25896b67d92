"""Robots whose motors are on a CAN bus: the driver, motor controllers of several protocols, and emulated ones.

From the bottom up, each module can be read apart:

    frame, link           a CAN frame, and how a bus is reached
    medium                buses and time as everything here gets them: those of this computer, or simulated ones
    bus, opening          a CAN bus: frames in and out, and how it is opened, whatever the adapter
    pacing, echoes        how quickly frames may be sent, and own frames that come back
    troubles, controller  what goes wrong with a bus, in words, and how its controller is restarted
    axis, listener        what the layers above see of one motor axis, and of the nodes on a bus, whatever the protocol
    odrive/, cia402/, moteus/, vesc/    a protocol each: its codec, axis, options, listener, and emulated drive
    protocols, options    the protocols by name, also those of other packages, and what they must be told of drives
    base                  wheels from axes, odometry from encoders
    plausibility          whether a motor does what it was asked
    guard                 when the motors must be off
    watch                 the axes of one robot under their guard, and the lock that two threads share
    meeting, recovering   how a robot meets its drives, and how it recovers
    train                 the axes of one robot on their bus, driven
    driver                the backend `can`
    survey                who speaks on a bus
    emulator/             what all emulated drives share, and buses in memory on simulated time
"""
