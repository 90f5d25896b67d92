"""A small network that decides by an observation with any number of other players, in numpy alone.

The own part of an observation goes straight into two layers. Each known slot goes through one layer that all slots
share, and the maximum and the mean over these join the own part. So the order of the slots does not matter, and the
same network plays with more or fewer others. Slots of all zeros, which are those of unknown players, are left out.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from vrg_learn.learning import Learning
from vrg_learn.observation import names

SLOT_UNITS: Final = 64
"""The number of values that a slot becomes."""
UNITS: Final = 128
"""The number of units of each of the two layers behind."""
PIECE: Final = 512
"""The number of rows at a time: the values of more leave the caches of a processor, which is several times slower."""

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
        slots: the slots, shape (slots * rows, values of a slot). hidden: their layer, shape (slots, rows, SLOT_UNITS).
        most: its maximum. shares: what each slot counts for in the mean, shape (slots, rows, 1).
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
        pieces = [self.forward(observations[part])[0] for part in _pieces(len(observations))]
        return pieces[0] if len(pieces) == 1 else np.concatenate(pieces)

    def slopes(self, observations: Values, slope: Callable[[Values, slice], Values]) -> Parameters:
        """The derivative of a loss by each parameter.

        Args:
            observations: as for `forward`.
            slope: returns the derivative of the loss by each output, given the outputs for some rows, and which.
        """
        found = {name: np.zeros_like(self.parameters[name]) for name in shapes(0, 0, 0)}
        for part in _pieces(len(observations)):
            outputs, trace = self.forward(observations[part])
            for name, values in self.backward(trace, slope(outputs, part)).items():
                found[name] += values
        return found

    def forward(self, observations: Values) -> tuple[Values, Trace]:
        """The outputs, shape (rows, outputs), and the trace for `backward`.

        Args:
            observations: shape (rows, own + any number of slots * slot).
        """
        p, rows = self.parameters, len(observations)
        count = (observations.shape[1] - self.own) // self.slot
        # The first index is the slot, so that all that is done with a slot is done with memory in one piece.
        slots = observations[:, self.own :].reshape(rows, count, self.slot).transpose(1, 0, 2).reshape(-1, self.slot)
        known = slots.any(axis=1).reshape(count, rows, 1)
        shares = known / np.maximum(known.sum(axis=0), 1).astype(observations.dtype)
        hidden = slots @ p["slot.weight"]
        hidden += p["slot.bias"]
        # Nothing is below 0, so the zeros of unknown slots are never the maximum of others.
        np.maximum(hidden, 0.0, out=hidden)
        hidden = hidden.reshape(count, rows, SLOT_UNITS)
        if not known.all():
            hidden *= known
        joined = np.zeros((rows, self.own + 2 * SLOT_UNITS), dtype=hidden.dtype)
        joined[:, : self.own] = observations[:, : self.own]
        most, mean = np.zeros((2, rows, SLOT_UNITS), dtype=hidden.dtype)
        for values, share in zip(hidden, shares, strict=True):
            np.maximum(most, values, out=most)
            mean += values * share
        joined[:, self.own : -SLOT_UNITS], joined[:, -SLOT_UNITS:] = most, mean
        first = joined @ p["first.weight"]
        first += p["first.bias"]
        np.tanh(first, out=first)
        second = first @ p["second.weight"]
        second += p["second.bias"]
        np.tanh(second, out=second)
        outputs = second @ p["last.weight"] + p["last.bias"]
        return outputs, Trace(slots, hidden, most, shares, joined, first, second)

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
        for number, values in enumerate(trace.hidden):
            hidden[number] = (most * (values == trace.most) + mean * trace.shares[number]) * (values > 0.0)
        layer("slot", trace.slots, hidden.reshape(-1, SLOT_UNITS))
        return found


def _pieces(rows: int) -> list[slice]:
    """The rows in pieces that the caches of a processor hold."""
    return [slice(start, min(rows, start + PIECE)) for start in range(0, max(rows, 1), PIECE)]


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
