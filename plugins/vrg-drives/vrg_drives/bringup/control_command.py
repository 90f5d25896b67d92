"""`vrg can stop | clear | jog | address | configure`: what one does to single drives, with no match, router or file."""

import logging
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from vrg.bus.stopping import Stop
from vrg.commands import drives
from vrg.commands.drives import BusOptions, OptionsOption, ProtocolOption, options_of, protocol_of
from vrg.commands.options import lasting, make_console, stoppable
from vrg.errors import ConfigError, RobotError
from vrg.hal.can.axis import AxisReport
from vrg.hal.can.judges.silence import HEARTBEAT_TIMEOUT
from vrg.hal.can.workshop.odrive.listener import OdriveListener, read_endpoints
from vrg.hal.can.workshop.survey import unheard
from vrg.hal.models import robot_model
from vrg_drives.bringup.listened_bus import BusState
from vrg_drives.bringup.listening_command import listening, table_of

if TYPE_CHECKING:
    from vrg.hal.can.train import DriveTrain

IdsOption = Annotated[list[int] | None, typer.Option("--id", help="A drive's id; the default is all drives.")]

_FIND = 1.0
"""s for which it is listened who is there."""
_REPEAT = 0.1
"""s from one order to stop to the next."""
_CONFIRMATIONS = 2
"""Times that drives are asked whether they are off: who has no heartbeat is found by the first."""
_JOG_PERIOD = 0.05
"""s between setpoints."""
_JOG_REST = 0.3
"""s for which a motor is asked for zero at the end, until it stands."""
_JOG_START = 10.0
"""s within which a motor must be ready to turn."""
_JOG_JUDGED = 0.5
"""s of a jog from which on the motor must have turned: before that it may still gain speed."""
_JOG_FASTEST = 20.0
"""turn/s of a motor."""
_HEADROOM = 2.0
"""The speed at which a motor is a runaway, as a multiple of the commanded one."""


def stop(on: BusOptions, seconds: Annotated[float, lasting("How long to repeat the order.", 0.8, 600)] = 1.0) -> None:
    """Order every motor on a bus to be off, and print which ones are. This needs no match, router or file."""
    link, console = on.link(), make_console()
    with listening(link) as bus:
        end = bus.clock.now() + seconds
        unsent: dict[str, None] = {}
        while True:
            # Again and again, whatever goes wrong: an order may be lost, and a program that drives them may go on.
            try:
                bus.survey.stop()
                bus.survey.greet()  # who answers is written nothing that is meant for others
            except RobotError as error:
                unsent.setdefault(str(error))
            ordered = bus.clock.now()
            bus.wait(_REPEAT)
            if bus.stop.is_set() or bus.clock.now() >= end:
                break
        for _ in range(_CONFIRMATIONS):
            bus.look(ask=True)
            bus.wait(_REPEAT)
        heard = bus.look(ask=False)
    console.print(table_of(heard))
    problems = _unstopped(heard, ordered)
    problems += [f"an order could not be sent: {words}" for words in unsent]
    problems += [f"Drives of the protocol {name} were not switched off: {why}." for name, why in unheard().items()]
    if not heard.nodes:
        problems.append(
            f"{link}: no drive reports that its motor is off: is it the right bus, wired and powered, and is the bit "
            "rate right?"
        )
    for words in problems:
        console.print(f"[red]{escape(words)}[/red]")
    off = ", ".join(f"{found.protocol} {found.node}" for found in heard.nodes if _is_off(found, ordered))
    console.print(
        f"{link}: off by their own reports: {off or 'none'}. A drive that sends nothing is not among them: "
        "check whether its motor turns."
    )
    if problems or heard.troubles:
        raise typer.Exit(1)


def _is_off(found: AxisReport, ordered: float) -> bool:
    """True if a drive has reported since it was ordered to be off that it is."""
    return found.on is False and found.reported_at >= ordered


def _unstopped(heard: BusState, ordered: float) -> list[str]:
    """The drives that turn on, or that have not confirmed that they are off, in words."""
    from vrg.hal.can.judges.off import TURNING_SPEED

    found = []
    for report in heard.nodes:
        if not report.is_drive:
            continue
        name = f"{report.protocol} {report.node}"
        if report.on and report.reported_at >= ordered:
            found.append(f"{name} is still on, or turns: does another program drive it?")
        elif not _is_off(report, ordered):
            found.append(f"{name} has not confirmed that it is off: check whether its motor turns, and cut its power")
        if abs(report.velocity) > TURNING_SPEED:
            found.append(
                f"{name} still turns at {report.velocity:.3g} turn/s, whatever it reports: cut the power of its motor"
            )
    return found


def clear(on: BusOptions, ids: IdsOption = None) -> None:
    """Clear the latched errors of drives, and print those that remain. Nothing moves."""
    link, console = on.link(), make_console()
    with listening(link) as bus, console.status(f"looking for drives on {link}"):
        heard = bus.look_for(_FIND)
        for found in _wanted(heard, ids, str(link)):
            bus.survey.listener_of(found).clear(found)
        heard = bus.look_for(_FIND)
    console.print(table_of(heard))
    if any(found.errors for found in heard.nodes if ids is None or found.node in ids):
        raise typer.Exit(1)


def address(
    to: Annotated[int, typer.Argument(help="The new id.")],
    on: BusOptions,
    protocol: ProtocolOption = "odrive",
    id_: Annotated[int | None, typer.Option("--id", help="The drive's present id.")] = None,
    serial: Annotated[str | None, typer.Option(help="The drive's serial number, as `vrg can scan` shows it.")] = None,
) -> None:
    """Give a drive another id. Name it by its id, its serial number, or both. Save it in the drive to keep it."""
    link = on.link()
    spoken = protocol_of(protocol, listener=True)
    if problem := spoken.axis_type.check_node(to):
        raise ConfigError(f"the new id: {problem}")
    if id_ is None and serial is None:
        raise ConfigError("expected --id or --serial: which drive gets the new id?")
    console = make_console()
    with listening(link) as bus:
        with console.status(f"looking for drives on {link}"):
            heard = bus.look_for(_FIND)
        mine = [f for f in heard.nodes if isinstance(bus.survey.listener_of(f), spoken.listener_type)]
        if any(found.node == to for found in mine):
            raise ConfigError(f"{link}: there is a drive with id {to} already")
        found, number = _which(mine, id_, serial, str(link))
        if found.on:
            raise RobotError(f"{found.protocol} {found.node}: expected a motor that is off: `vrg can stop`")
        bus.survey.listener_of(found).rename(found, number, to)
    with listening(link) as bus, console.status("checking whether the drive has its new id"):
        heard = bus.look_for(_FIND)
    new = [f for f in heard.nodes if f.node == to and f.protocol == found.protocol]
    if new:
        # Its last frames by its old id may have waited to be heard.
        last = [f for f in heard.nodes if (f.node, f.protocol) == (found.node, found.protocol)]
        heard.nodes[:] = [f for f in heard.nodes if f not in last or heard.at - f.heard < HEARTBEAT_TIMEOUT]
    console.print(table_of(heard))
    if not new:
        raise RobotError(f"{link}: expected the drive to have id {to} now, none has")
    console.print(f"The drive has id {to} until it is switched off. Save it in the drive to keep it.")


def configure(
    settings: Annotated[
        list[str],
        typer.Argument(
            help="NAME to read a setting, NAME=VALUE to change it: a path of ODrive's endpoints, or 0x6083."
        ),
    ],
    id_: Annotated[int, typer.Option("--id", help="The drive's id.")],
    on: BusOptions,
    endpoints: Annotated[
        Path | None, typer.Option(help="flat_endpoints.json of an ODrive's firmware, as its maker publishes it.")
    ] = None,
    save: Annotated[bool, typer.Option("--save", help="Let the drive save all its settings permanently.")] = False,
) -> None:
    """Read and change settings of an ODrive or a CiA 402 drive whose motor is off, and read back its answer."""
    link = on.link()
    known = None if endpoints is None else read_endpoints(endpoints)
    console = make_console()
    with listening(link) as bus:
        with console.status(f"looking for drive {id_} on {link}"):
            heard = bus.look_for(_FIND)
        (found,) = _wanted(heard, [id_], str(link))
        listener = bus.survey.listener_of(found)
        if isinstance(listener, OdriveListener):
            listener.endpoints = known
        changes = any("=" in setting for setting in settings) or save
        if changes and found.on is not False:
            raise RobotError(
                f"{found.protocol} {id_}: expected a motor that is off, so that nothing moves: `vrg can stop`"
            )
        try:
            for setting in settings:
                name, change, value = setting.partition("=")
                before = listener.read(found, name)
                if change:
                    listener.write(found, name, value)
                    console.print(f"{name}: {before} -> {listener.read(found, name)}")
                else:
                    console.print(f"{name}: {before}")
            if save:
                listener.save(found)
        except ValueError as error:
            raise ConfigError(str(error)) from None
    console.print("Saved." if save else "It has this until it is switched off; --save keeps it." if changes else "")


def jog(
    id_: Annotated[int, typer.Option("--id", help="The drive's id.")],
    on: BusOptions,
    speed: Annotated[float, typer.Option(help="turn/s of the motor, before any gear; negative is backwards.")] = 1.0,
    seconds: Annotated[float, lasting("How long.", 0.1, 60)] = 2.0,
    protocol: ProtocolOption = "odrive",
    option: OptionsOption = None,
    unsafe: Annotated[bool, typer.Option("--unsafe", help="Also turn a drive without a watchdog of its own.")] = False,
) -> None:
    """Turn one motor slowly, to see which it is and which way it turns. A fault, Ctrl-C or `vrg can stop` stops it."""
    from vrg.hal.can.base import TURN, WheelAxis  # python-can is for who uses a bus
    from vrg.hal.can.judges.off import COAST_TIMEOUT, TURNING_SPEED
    from vrg.hal.can.plausibility import STANDSTILL_SHARE
    from vrg.hal.can.train import DriveTrain
    from vrg_drives.bringup.calibrating import bring_up

    if not 0 < abs(speed) <= _JOG_FASTEST:
        raise ConfigError(
            f"--speed: expected from -{_JOG_FASTEST:g} to {_JOG_FASTEST:g} turns per second, and not 0, got {speed:g}"
        )
    link, spoken = on.link(), protocol_of(protocol)
    if problem := spoken.axis_type.check_node(id_):
        raise ConfigError(f"--id: {problem}")
    model = robot_model("P2AT")
    # A gear with which the top speed of this model is a little more than the motor is asked for: a runaway is noticed.
    ratio = _HEADROOM * abs(speed) * TURN * model.drivetrain.wheel_radius / model.v_max
    axis = WheelAxis(id_, axis=0, ratio=ratio)
    options = options_of(spoken, option)
    train = DriveTrain(protocol, drives.medium(), link, spoken, [axis], model, options=options, unwatched=unsafe)
    typer.echo(f"Turning {protocol} {id_} on {link} at {speed:g} turn/s for {seconds:g} s. Ctrl-C stops it.")
    logger = logging.getLogger("vrg")
    with ExitStack() as stack:
        # The error alone reports what goes wrong.
        stack.callback(logger.setLevel, logger.level)
        logger.setLevel(logging.CRITICAL)
        interrupted = stack.enter_context(stoppable())
        train.connect()
        stack.callback(train.close)
        wrong = list[RobotError]()
        try:
            if bring_up(train, _JOG_START, interrupted.is_set):
                train.restart_odometry()
                _turn(train, id_, speed, interrupted, seconds)
            elif not interrupted.is_set():
                raise RobotError(f"the motor was not ready within {_JOG_START:g} s: is this computer too busy?")
        except RobotError as error:
            wrong.append(error)
        train.disarm()
        # Its own word that it is off is not enough.
        train.clock.wait(
            lambda: abs(train.state().speeds[0]) * ratio / TURN < TURNING_SPEED, COAST_TIMEOUT + _JOG_PERIOD
        )
        train.clock.sleep(_JOG_PERIOD)
        state = train.state()
    if state.fault and all(error.text != state.fault for error in wrong):
        wrong.append(RobotError(state.fault, protocol))
    if wrong:
        raise RobotError("; ".join(map(str, wrong)))
    turned = state.angles[0] / TURN * ratio
    typer.echo(f"The motor has turned by {turned:+.2f} turns.")
    whole = seconds >= _JOG_JUDGED and not interrupted.is_set()
    if whole and abs(turned) < STANDSTILL_SHARE * abs(speed) * seconds:
        raise RobotError(
            f"{protocol} {id_}: it was asked for {speed:g} turn/s for {seconds:g} s and has hardly turned: is it "
            "blocked, or does its drive not turn so slowly? Try a higher --speed"
        )


def _turn(train: "DriveTrain", node: int, speed: float, interrupted: Stop, seconds: float) -> None:
    """Turn a motor, and let it come to rest. It is never armed again.

    Raises:
        RobotError: its motor was switched off before its time, as where this program was frozen.
    """
    from vrg_drives.bringup.calibrating import look_again

    looked = train.clock.now()
    end = looked + seconds
    while looked < end + _JOG_REST:
        if interrupted.is_set():
            end = min(end, looked)
        try:
            if looked < end:
                train.spin(node, speed)
                train.clock.wait(interrupted.is_set, _JOG_PERIOD)
            else:
                train.spin(node, 0.0)
                train.clock.sleep(_JOG_PERIOD)
        finally:  # that it was frozen explains what else is wrong
            looked = look_again(train, looked)


def _wanted(heard: BusState, ids: Iterable[int] | None, link: str) -> list[AxisReport]:
    """The drives of these ids, or all.

    Raises:
        RobotError: one of them is not there.
    """
    if ids is None:
        return heard.nodes
    missing = sorted(set(ids) - {found.node for found in heard.nodes})
    if missing:
        there = ", ".join(f"{found.protocol} {found.node}" for found in heard.nodes) or "none"
        raise RobotError(f"{link}: expected drives with ids {', '.join(map(str, missing))}, heard {there}")
    return [found for found in heard.nodes if found.node in ids]


def _which(nodes: list[AxisReport], id_: int | None, serial: str | None, link: str) -> tuple[AxisReport, str]:
    """The one drive that has this id and this serial number, and its serial number.

    Raises:
        RobotError: none or several have.
    """
    fitting = [
        (found, number)
        for found in nodes
        for number in found.serials or ("",)
        if id_ in (None, found.node) and (serial is None or serial.upper() == number)
    ]
    if len(fitting) == 1:
        return fitting[0]
    there = ", ".join(f"id {found.node} serial {found.serial or '?'}" for found in nodes) or "none"
    what = f"{'id ' + str(id_) if id_ is not None else ''} {'serial ' + serial if serial else ''}".strip()
    raise RobotError(f"{link}: expected one drive with {what}, found {len(fitting)}; heard: {there}")
