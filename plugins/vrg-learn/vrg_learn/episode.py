"""One match that continues from decision to decision, in which programs drive some players."""

from collections.abc import Callable, Collection, Mapping, Sequence

from vrg.agents.player import Player
from vrg.agents.strategy import Strategy
from vrg.bus.messages import Body, Call, RefereeState, Stage
from vrg.bus.node import Node
from vrg.config.setup import MatchSetup
from vrg.coordinator.journal import Journal, NoJournal
from vrg.errors import ConfigError, LaunchError, StrategyError
from vrg.launch.nodes.player import player_node
from vrg.launch.strategy_class import strategy_of
from vrg.playing.in_process import assemble
from vrg.types import STILL, Twist
from vrg_learn.puppet import TARGET, Puppet
from vrg_learn.watch import Watch

LONGEST_PAUSE = 120.0
"""The match time in s that a match may take between two rounds, or before the first."""
LINGER = 1.0
"""The match time in s for which a recorded match goes on after its end, so that every node hears how it ended."""


class Episode:
    """A match between two decisions: the players have seen, and have not decided yet. Play is going on, or is over.

    Args:
        setup: the match. driven: the players that programs drive; the others play by their strategies.
        talks: True if the strategies of driven players tell what these tell.
        journal: the open journal. watchers: further nodes. strict: as for `vrg.playing.in_process.play`.
        wrap: returns the strategy that a player has in place of its own, if no program drives it.

    Attributes:
        puppets: the strategies of the driven players, by name.
        bodies: where all robots really are at this decision, by name.

    Raises:
        ConfigError: the match cannot be played, or a strategy cannot be made.
    """

    def __init__(
        self,
        setup: MatchSetup,
        driven: Collection[str],
        *,
        talks: bool = False,
        journal: Journal | NoJournal | None = None,
        watchers: Sequence[Node] = (),
        strict: bool = False,
        wrap: Callable[[Strategy], Strategy] = lambda strategy: strategy,
    ) -> None:
        self._setup = setup
        self._driven = driven
        self._talks = talks
        self._wrap = wrap
        self._watch = Watch(setup.keys)
        self._closed = False
        self._state: RefereeState | None = None
        self.bodies: Mapping[str, Body] = {}
        self.puppets: dict[str, Puppet] = {}
        self._assembly = assemble(
            setup, journal or NoJournal(), self._player, watchers=[self._watch, *watchers], strict=strict
        )

    @property
    def begun(self) -> bool:
        """True after `start`."""
        return self._state is not None

    @property
    def state(self) -> RefereeState:
        """The referee's state as the players see it at this decision, also after `close`.

        Raises:
            LaunchError: the match has not begun.
        """
        if self._state is None:
            raise LaunchError("expected a match that has begun: call start() first")
        return self._state

    @property
    def over(self) -> bool:
        """True if the game is over."""
        return self.state.stage is Stage.GAME_OVER

    def start(self) -> list[Call]:
        """Go on to the first decision of play, and return the calls before it; for what is raised see `decide`."""
        return self._go_on()

    def decide(self, twists: Mapping[str, Twist]) -> list[Call]:
        """Let all players decide, and go on to their next decision in play, or to the end of the game.

        Before a round and after it the driven players stand.

        Args:
            twists: the motions of driven players; those that are missing stand.

        Returns:
            the referee's calls meanwhile.

        Raises:
            StrategyError: a strategy has failed. LaunchError: play is halted, or no round begins.
        """
        for name, puppet in self.puppets.items():
            puppet.twist = twists.get(name, STILL)
        self._finish()
        for puppet in self.puppets.values():
            puppet.twist = STILL
        return self._go_on()

    def close(self, *, linger: bool = False) -> None:
        """Stop all nodes. Idempotent.

        Args:
            linger: True lets every node hear how the match ended.
        """
        if self._closed:
            return
        self._closed = True
        executor = self._assembly.executor
        try:
            if linger:
                self._finish()
                until = executor.time + LINGER
                while executor.time < until:
                    executor.begin()
                    self._finish()
        finally:
            executor.stop()

    def _go_on(self) -> list[Call]:
        executor, watch = self._assembly.executor, self._watch
        since = executor.time
        while True:
            self._begin()
            state = watch.state
            if state is None or state.stage not in (Stage.PLAY_ROUND, Stage.GAME_OVER):
                if executor.time - since > LONGEST_PAUSE:
                    why = "the referee says nothing" if state is None else "; ".join(state.waiting)
                    raise LaunchError(f"no round begins within {LONGEST_PAUSE:g} s: {why}")
            elif state.halted is None:
                self._state, self.bodies = state, watch.bodies
                return watch.taken()
            if state is not None and state.halted is not None:
                raise LaunchError(f"play is halted, and nobody is there to resume it: {state.halted}")
            self._finish()

    def _begin(self) -> None:
        """Go on until a tick has begun in which the players decide."""
        executor = self._assembly.executor
        while True:
            executor.begin()
            if self._watch.hears:
                return
            executor.finish()

    def _finish(self) -> None:
        """Let the players decide.

        Raises:
            StrategyError: a strategy has failed.
        """
        executor = self._assembly.executor
        try:
            executor.finish()
        except StrategyError as error:
            if isinstance(error.__cause__, KeyboardInterrupt):
                raise error.__cause__ from None
            who = "; ".join(getattr(error, "__notes__", ()))
            raise StrategyError(f"{error} ({who}): the match cannot continue; reset() begins another one") from error

    def _player(self, name: str) -> Player:
        if name not in self._driven:
            return player_node(self._setup, name, make=lambda: self._wrap(strategy_of(self._setup, name)))
        strategy = strategy_of(self._setup.substituted(name, TARGET), name)
        if not isinstance(strategy, Puppet):
            raise ConfigError(f"{name}: expected the strategy {TARGET}, got {strategy!r}")
        if self._talks:
            strategy.teller = strategy_of(self._setup, name)
        self.puppets[name] = strategy

        def made() -> Strategy:
            return strategy

        return player_node(self._setup, name, make=made)
