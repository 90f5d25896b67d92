"""Robots of flesh and steel: motor controllers on a CAN bus, and emulated ones that stand in for them.

From the bottom up, each module can be read apart:

    frame, bus            a CAN bus: frames in and out, and what can go wrong with it
    odrive, odrive_axis   ODrive CANSimple: the codec, and one motor axis by it
    cia402, cia402_axis   CiA 402 over CANopen: the objects, and one motor axis by it
    axis                  what the layers above see of an axis, whatever its protocol
    base                  wheels from axes, odometry from encoders
    guard                 when the motors must be off
    train                 the axes of one robot on their bus, watched over
    robot                 the `can` backend: the drive train in a match
    emulator/             drives that are not there
"""
