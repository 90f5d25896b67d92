"""`vrg can ...`: emulated drives, and tools for a bus with real ones."""

import enum
import random
import secrets
from typing import Annotated

import typer

from vrg.commands.can import calibrate as can_calibrate
from vrg.commands.can import control as can_control
from vrg.commands.can import listening as can_listening
from vrg.commands.can import options as can_options
from vrg.commands.can.options import EmulatedBusOptions, OptionsOption, ProtocolOption, options_of, protocol_of
from vrg.commands.groups import CommandGroup
from vrg.commands.options import LeashOption, exit_if_interrupted, lasting
from vrg.errors import ConfigError
from vrg.hal.can.workshop.emulated import DriveOptions
from vrg.hal.can.workshop.emulation import EMULATING
from vrg.hal.can.workshop.faults import WHAT, FaultKind, FaultRequest, ask_for
from vrg.hal.can.workshop.motor import MotorModel
from vrg.launch.serving import child_process
from vrg.system import boot_time

app = CommandGroup(no_args_is_help=True)
for command in (
    can_listening.scan, can_listening.monitor, can_control.stop, can_control.clear, can_control.jog,
    can_control.address, can_control.configure, can_calibrate.calibrate,
):  # fmt: skip
    app.command()(command)


FaultName = enum.StrEnum("FaultName", {kind.name: kind.name.lower() for kind in FaultKind})  # type: ignore[misc]

_MOTOR = MotorModel()


@app.command()
def node(
    id_: Annotated[list[int], typer.Option("--id", help="A drive's id; may be given several times.")],
    on: EmulatedBusOptions,
    protocol: ProtocolOption = "odrive",
    option: OptionsOption = None,
    watchdog: Annotated[
        float, typer.Option(min=0, max=60, help="s without a setpoint until the motor is off; 0 = never.")
    ] = 0.2,
    voltage: Annotated[float, typer.Option(min=0, max=1000, help="The voltage of the supply, V.")] = 24.0,
    inertia: Annotated[
        float, typer.Option(min=1e-9, help="Moment of inertia of rotor and load, kg m2.")
    ] = _MOTOR.inertia,
    current_limit: Annotated[
        float, typer.Option(min=0.01, help="Highest current of the motor, A.")
    ] = _MOTOR.current_limit,
    velocity_limit: Annotated[
        float, typer.Option(min=0.01, help="Highest speed of the motor, turn/s.")
    ] = _MOTOR.velocity_limit,
    friction: Annotated[float, typer.Option(min=0, help="Friction at the shaft, Nm.")] = _MOTOR.friction,
    delay: Annotated[float, typer.Option(min=0, max=0.5, help="s from a setpoint to its effect.")] = _MOTOR.delay,
    serial: Annotated[
        int | None, typer.Option(min=0, help="Serial number of the first drive; a random one if missing.")
    ] = None,
    leash: LeashOption = False,
) -> None:
    """Be one or several motor controllers on a bus, until stopped."""
    from vrg.hal.can.workshop.run import run_drives  # python-can is for who uses a bus

    spoken = protocol_of(protocol, drive=True)
    options = options_of(spoken, option)
    problems = [f"--id: {problem}" for one in id_ if (problem := spoken.axis_type.check_node(one))]
    if problems:
        raise ConfigError(problems)
    link = on.link()
    first = secrets.randbits(40) if serial is None else serial
    motor = MotorModel(
        inertia=inertia, current_limit=current_limit, velocity_limit=velocity_limit, friction=friction, delay=delay
    )
    with child_process(leash) as stop:
        drives = [
            spoken.drive_type(
                one,
                DriveOptions(serial=first + index, motor=motor, watchdog=watchdog, voltage=voltage, protocol=options),
                boot_time(),
                random.Random(first + index),
            )
            for index, one in enumerate(id_)
        ]
        names = ", ".join(f"{drive.node} (serial number {drive.options.serial:X})" for drive in drives)
        run_drives(link, drives, stop, ready=lambda: typer.echo(f"{EMULATING} {protocol} on {link}: {names}"))
    exit_if_interrupted(stop)


@app.command()
def fault(
    kind: Annotated[FaultName, typer.Argument(help="; ".join(f"{k.name.lower()}: {w}" for k, w in WHAT.items()))],
    id_: Annotated[list[int], typer.Option("--id", help="An emulated drive's id; may be given several times.")],
    on: EmulatedBusOptions,
    seconds: Annotated[float, lasting("How long it lasts; 0 = until end.", 0, 655)] = 0.0,
    value: Annotated[str, typer.Option(help="Error bits or turns, such as 0x200.")] = "0",
) -> None:
    """Let something go wrong in an emulated drive. Real ones do not listen."""
    try:
        number = int(value, 0)
    except ValueError:
        raise typer.BadParameter(
            f"expected a whole number such as 512 or 0x200, got {value!r}", param_hint="--value"
        ) from None
    request = FaultRequest(FaultKind[kind.name], seconds, number - (1 << 32) if number >= 1 << 31 else number)
    link = on.link()
    failed = False
    for one in id_:
        done = ask_for(can_options.medium(), link, one, request)
        failed |= not done
        if done:
            typer.echo(f"node {one}: {kind} ({WHAT[request.kind].split(':')[0]})")
        elif done is None:
            typer.echo(f"node {one}: not emulated on {link}; real drives do not listen to this", err=True)
        else:
            typer.echo(f"node {one}: a drive of its protocol cannot have this fault", err=True)
    if failed:
        raise typer.Exit(1)
