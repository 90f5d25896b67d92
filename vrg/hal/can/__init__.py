"""Robots whose motors are on a CAN bus: the driver, and motor controllers of any protocol.

From the bottom up, each module can be read apart:

    frame, link           a CAN frame, and how a bus is reached
    troubles, opening     what goes wrong with a bus, in words; how it is opened, and its controller restarted
    sending               how quickly frames may be sent, and own frames that come back
    bus                   a CAN bus: frames in and out, whatever the adapter
    axis                  what the layers above see of one motor axis, whatever the protocol
    odrive/               the protocol of ODrives: its codec and its axis
    protocols             the protocols by name, also those of other packages
    judges/               what is wrong with drives: judges of one thing each
    base                  wheels from axes, odometry from encoders
    plausibility          whether a motor does what it was asked
    guard                 when the motors must be off: asks the judges, and acts
    meeting               the steps in which a robot meets its drives
    machine               the states of a drive train: events in, orders out
    train                 the thin shell around it: the lock, the threads, the bus and the clock
    settings, calibration the table [backends.can], and the calibration file of a robot
    driver                the backend `can`
    workshop/             emulated drives, and tools for who looks at a bus; a match with real drives never loads it
"""
