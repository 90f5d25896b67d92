"""The one type that the benchmark of the bus sends over DDS."""

from dataclasses import dataclass

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import sequence, uint8


@dataclass
class Blob(IdlStruct, typename="Blob"):
    """Bytes."""

    data: sequence[uint8]
