"""What an ODrive says became of the last thing that it was asked to do: the procedure result of its heartbeat."""

import enum


class ProcedureResult(enum.IntEnum):
    """The second byte after the errors of a heartbeat (ODrive's documentation, firmware 0.6)."""

    SUCCESS = 0
    BUSY = 1
    CANCELLED = 2
    DISARMED = 3
    NO_RESPONSE = 4
    POLE_PAIR_CPR_MISMATCH = 5
    PHASE_RESISTANCE_OUT_OF_RANGE = 6
    PHASE_INDUCTANCE_OUT_OF_RANGE = 7
    UNBALANCED_PHASES = 8
    INVALID_MOTOR_TYPE = 9
    ILLEGAL_HALL_STATE = 10
    TIMEOUT = 11
    HOMING_WITHOUT_ENDSTOP = 12
    INVALID_STATE = 13
    NOT_CALIBRATED = 14
    NOT_CONVERGING = 15


_ADVICE = {
    ProcedureResult.INVALID_STATE: "it is not ready to be switched on: is it calibrated and without errors?",
    ProcedureResult.NOT_CALIBRATED: "calibrate motor and encoder, and save that",
    ProcedureResult.DISARMED: "it was switched off again at once",
}


def describe_result(result: int) -> str:
    """A procedure result in words."""
    try:
        known = ProcedureResult(result)
    except ValueError:
        return f"procedure result {result}"
    advice = _ADVICE.get(known)
    return f"{known.name} ({advice})" if advice else known.name
