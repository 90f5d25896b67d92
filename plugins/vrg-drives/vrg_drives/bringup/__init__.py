"""Tools for people who bring up a robot with motors on a CAN bus, with no match and no router."""

from typing import Final

from vrg.plugins import Command

CAN_TABLE: Final = {
    "Look at a bus, and move nothing": {
        "scan": ("vrg_drives.bringup.listening_command:scan", "List the drives on the bus: ids, state, errors"),
        "monitor": ("vrg_drives.bringup.listening_command:monitor", "Show the drives, live"),
    },
    "Act on drives": {
        "stop": ("vrg_drives.bringup.control_command:stop", "Switch every motor off"),
        "clear": ("vrg_drives.bringup.control_command:clear", "Clear latched errors"),
        "jog": ("vrg_drives.bringup.control_command:jog", "Turn one motor for a moment"),
        "address": ("vrg_drives.bringup.control_command:address", "Give a drive another id"),
        "configure": ("vrg_drives.bringup.control_command:configure", "Read and change settings of drives"),
        "fault": ("vrg_drives.bringup.fault_command:fault", "Inject faults into emulated drives"),
    },
    "Calibrate a robot": {
        "calibrate": ("vrg_drives.bringup.calibrate_command:calibrate", "Find directions, gear ratios and track"),
    },
}
CAN: Final = Command(("can",), "Lab", "Bring up motor controllers on a CAN bus", "vrg_drives.bringup:CAN_TABLE")
