"""CiA 402 over CANopen: the profile of industrial servo drives.

Sources: CiA 301 (application layer: NMT, SDO, PDO, EMCY) and CiA 402-2 / IEC 61800-7-201 (drives). Object numbers are
those of the standards, written `0x1401:05` for index and sub-index. All values are little-endian.

The mode of operation is profile velocity (3), not cyclic synchronous velocity (9): a setpoint of mode 3 counts from the
moment that it arrives, while mode 9 wants SYNC frames at a fixed period and interpolates between them, which a player
in Python cannot promise, and which many drives on CAN lack. The drive's own ramps (0x6083, 0x6084) limit what a
setpoint may do; they belong to the person who commissioned the drive, and are left alone here.
"""

from vrg.hal.can.protocols import Protocol

PROTOCOL = Protocol(
    "cia402",
    axis="vrg_drives.cia402.axis:Cia402Axis",
    drive="vrg_drives.cia402.drive:Cia402Drive",
    listener="vrg_drives.cia402.listener:CanopenListener",
)
