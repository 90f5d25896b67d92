"""A player of a match with its strategy."""

import logging
from collections.abc import Callable
from pathlib import Path

from vrg.agents.player import Player
from vrg.agents.radio import Radio, link_of
from vrg.agents.strategy import Strategy
from vrg.bus.mailbox import Mailbox
from vrg.config.setup import MatchSetup, radio_seed
from vrg.errors import ConfigError, StrategyError
from vrg.hal.backends import MatchContext, open_driver
from vrg.hal.can.link import Medium
from vrg.hal.clock import REAL_CLOCK
from vrg.hal.device import Device
from vrg.launch.context import Made, NodeContext
from vrg.launch.strategy_class import strategy_of

log = logging.getLogger(__name__)


def player_node(
    setup: MatchSetup,
    name: str,
    medium: Medium | None = None,
    make: Callable[[], Strategy] | None = None,
) -> Player:
    """Make a player with its device and its strategy.

    Args:
        medium: the CAN buses of its robot; None for those of this computer.
        make: makes its strategy; None makes it in this process.

    Raises:
        ConfigError: there is no such player, or its driver cannot be made.
        StrategyError: its strategy cannot be made.
    """
    player = setup.player(name)
    try:
        strategy = strategy_of(setup, name) if make is None else make()
    except ConfigError as error:
        raise StrategyError(str(error), final=True) from error
    mailbox, keys = Mailbox(), setup.keys
    context = MatchContext(
        name=name,
        model=player.robot,
        options=setup.backends.get(player.backend, {}),
        base=Path(setup.base),
        now=lambda: mailbox.now,
        keys=keys,
        mailbox=mailbox,
    )
    if medium is None:
        driver = open_driver(player.backend, context)
    else:
        from vrg.hal.can.driver import open_on  # noqa: PLC0415 - no other robot needs it

        driver = open_on(medium, player.backend, context)
    clock = REAL_CLOCK if medium is None else medium.clock
    device = Device(driver, keys, mailbox, start=player.pose, localisation=player.localisation, clock=clock)
    radio = Radio(keys, mailbox, name, player.team, link_of(setup.radio.settings, setup.draw(radio_seed(name))))
    return Player(mailbox, keys, device, strategy, team=player.team, radio=radio, obstacles=setup.obstacles)


def player(on: NodeContext) -> Made:
    """A player, whose strategy decides in its own process if it is a file, and otherwise in this one."""
    make = None if on.begun is None else lambda: on.begun
    try:
        return Made(player_node(on.setup, on.name, make=make))
    except StrategyError as error:
        log.error("the strategy has failed", exc_info=error.__cause__ or error)
        raise
