"""A small network that decides by an observation with any number of other players, in numpy alone.

The own part of an observation goes straight into two layers. Each known slot goes through one layer that all slots
share, and the maximum and the mean over these join the own part. So the order of the slots does not matter, and the
same network plays with more or fewer others. Slots of all zeros, which are those of unknown players, are left out.
"""

import math
from collections.abc import Iterable, Mapping
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from vrg.games.learning import Learning
from vrg.learning.observation import names

SLOT_UNITS: Final = 64
"""The number of values that a slot becomes."""
UNITS: Final = 128
"""The number of units of each of the two layers behind."""

Values = npt.NDArray[Any]
"""An array of float32; tests use float64."""
Parameters = dict[str, Values]
"""The arrays of a network by name: weights of shape (inputs, outputs), and biases."""


class Layout(NamedTuple):
    """The parts of an observation.

    Args:
        own: the names of the own values. slot: the names of the values of a slot, without its number.
    """

    own: tuple[str, ...]
    slot: tuple[str, ...]


def layout_of(learning: Learning) -> Layout:
    """The parts of an observation of a game."""
    own, first = names(learning, 1), names(learning, 2)
    return Layout(tuple(own), tuple(name.partition(": ")[2] for name in first[len(own) :]))


def shapes(own: int, slot: int, outputs: int) -> dict[str, tuple[int, ...]]:
    """The shape of each parameter of a network.

    Args:
        own: the number of own values of an observation. slot: that of a slot. outputs: that of the network's values.
    """
    return {
        "slot.weight": (slot, SLOT_UNITS),
        "slot.bias": (SLOT_UNITS,),
        "first.weight": (own + 2 * SLOT_UNITS, UNITS),
        "first.bias": (UNITS,),
        "second.weight": (UNITS, UNITS),
        "second.bias": (UNITS,),
        "last.weight": (UNITS, outputs),
        "last.bias": (outputs,),
    }


def initial(own: int, slot: int, outputs: int, rng: np.random.Generator, *, last: float = 0.01) -> Parameters:
    """Parameters to begin with: weights that keep the spread of values, and biases of 0.

    Args:
        own, slot, outputs: as for `shapes`.
        last: the factor of the last weights; a small one lets all outputs begin near 0.
    """
    found: Parameters = {}
    for name, shape in shapes(own, slot, outputs).items():
        if len(shape) == 1:
            found[name] = np.zeros(shape, dtype=np.float32)
        else:
            gain = {"slot.weight": math.sqrt(2.0), "last.weight": last}.get(name, 1.0)
            found[name] = (rng.standard_normal(shape) * (gain / math.sqrt(shape[0]))).astype(np.float32)
    return found


class Trace(NamedTuple):
    """What a forward pass leaves for the pass backwards. Rows are observations.

    Args:
        slots: the slots, shape (rows * slots, values of a slot). hidden: their layer, shape (rows, slots, SLOT_UNITS).
        most: its maximum. shares: what each slot counts for in the mean, shape (rows, slots, 1).
        joined, first, second: the input and the values of the two layers.
    """

    slots: Values
    hidden: Values
    most: Values
    shares: Values
    joined: Values
    first: Values
    second: Values


class Network:
    """Parameters, and the passes forward and backwards through them.

    Args:
        parameters: as `initial` makes them; they are not copied. `Adam` changes them in place.

    Attributes:
        parameters: as given. own, slot: the numbers of own values and of values of a slot.
    """

    def __init__(self, parameters: Parameters) -> None:
        self.parameters = parameters
        self.slot = len(parameters["slot.weight"])
        self.own = len(parameters["first.weight"]) - 2 * SLOT_UNITS

    def __call__(self, observations: Values) -> Values:
        """The outputs for observations, shape (rows, outputs); see `forward`."""
        return self.forward(observations)[0]

    def forward(self, observations: Values) -> tuple[Values, Trace]:
        """The outputs, shape (rows, outputs), and the trace for `backward`.

        Args:
            observations: shape (rows, own + any number of slots * slot).
        """
        p, rows = self.parameters, len(observations)
        count = (observations.shape[1] - self.own) // self.slot
        slots = observations[:, self.own :].reshape(rows * count, self.slot)
        known = (slots != 0.0).any(axis=1).reshape(rows, count, 1)
        shares = known / np.maximum(known.sum(axis=1, keepdims=True), 1).astype(observations.dtype)
        hidden = slots @ p["slot.weight"]
        hidden += p["slot.bias"]
        # Nothing is below 0, so the zeros of unknown slots are never the maximum of others.
        np.maximum(hidden, 0.0, out=hidden)
        hidden = hidden.reshape(rows, count, SLOT_UNITS)
        hidden *= known
        joined = np.zeros((rows, self.own + 2 * SLOT_UNITS), dtype=hidden.dtype)
        joined[:, : self.own] = observations[:, : self.own]
        most, mean = joined[:, self.own : -SLOT_UNITS], joined[:, -SLOT_UNITS:]
        for number in range(count):
            np.maximum(most, hidden[:, number], out=most)
            mean += hidden[:, number] * shares[:, number]
        first = joined @ p["first.weight"]
        first += p["first.bias"]
        np.tanh(first, out=first)
        second = first @ p["second.weight"]
        second += p["second.bias"]
        np.tanh(second, out=second)
        outputs = second @ p["last.weight"] + p["last.bias"]
        return outputs, Trace(slots, hidden, most, shares.astype(hidden.dtype), joined, first, second)

    def backward(self, trace: Trace, slopes: Values) -> Parameters:
        """The derivative of a loss by each parameter.

        Args:
            trace: of the pass forward. slopes: the derivative of the loss by each output, shape (rows, outputs).
        """
        p, found = self.parameters, Parameters()

        def layer(name: str, inputs: Values, outputs: Values) -> None:
            found[f"{name}.weight"], found[f"{name}.bias"] = inputs.T @ outputs, outputs.sum(axis=0)

        layer("last", trace.second, slopes)
        second = slopes @ p["last.weight"].T
        second *= 1.0 - trace.second * trace.second
        layer("second", trace.first, second)
        first = second @ p["second.weight"].T
        first *= 1.0 - trace.first * trace.first
        layer("first", trace.joined, first)
        pooled = first @ p["first.weight"][self.own :].T
        most, mean = pooled[:, :SLOT_UNITS], pooled[:, SLOT_UNITS:]
        hidden = np.empty_like(trace.hidden)
        for number in range(hidden.shape[1]):
            values = trace.hidden[:, number]
            slope = mean * trace.shares[:, number]
            slope += most * (values == trace.most)
            slope *= values > 0.0
            hidden[:, number] = slope
        layer("slot", trace.slots, hidden.reshape(-1, SLOT_UNITS))
        return found


class Adam:
    """The optimiser Adam (Kingma and Ba, 2015), with a bound for the length of all slopes together.

    Args:
        parameters: those that `update` changes, in place. longest: the bound.

    Attributes:
        steps: the number of updates. means, squares: the moments of the slopes, by name.
    """

    def __init__(self, parameters: Parameters, *, longest: float = 0.5) -> None:
        self.parameters, self.longest, self.steps = parameters, longest, 0
        self.means = {name: np.zeros_like(values) for name, values in parameters.items()}
        self.squares = {name: np.zeros_like(values) for name, values in parameters.items()}

    def update(self, slopes: Mapping[str, Values], rate: float) -> None:
        """Change the parameters against the slopes of a loss, by the learning rate `rate`."""
        self.steps += 1
        factor = min(1.0, self.longest / (length(slopes.values()) + 1e-8))
        step = rate * math.sqrt(1.0 - 0.999**self.steps) / (1.0 - 0.9**self.steps)
        for name in self.parameters:
            slope, mean, square = slopes[name] * factor, self.means[name], self.squares[name]
            mean += 0.1 * (slope - mean)
            square += 0.001 * (slope * slope - square)
            self.parameters[name] -= step * mean / (np.sqrt(square) + 1e-8)


def length(slopes: Iterable[Values]) -> float:
    """The length of arrays as one vector."""
    return math.sqrt(sum(float(np.vdot(values, values)) for values in slopes))
