"""Fits a network to what somebody does: its mean motion comes nearer to theirs."""

import numpy as np

from vrg_learn.network import Adam, Network

SPREAD = 0.3  # how far the policy tries motions out afterwards, as a standard deviation


def fit_step(network: Network, adam: Adam, seen: np.ndarray, wanted: np.ndarray, rate: float) -> float:
    """Bring a policy nearer to what it should do by one step, and return how far off it was, as the mean square.

    Args:
        adam: that of the network; a spread `log_std` among its parameters stays. seen: what players saw.
        wanted: what they should do then, shape (rows, actions). rate: that of learning.
    """
    off = [0.0]

    def slope(outputs: np.ndarray, rows: slice) -> np.ndarray:
        means = np.tanh(outputs)
        off[0] += float(np.square(means - wanted[rows]).sum()) / wanted.size
        found: np.ndarray = (means - wanted[rows]) * (1.0 - means * means) / len(wanted)
        return found

    slopes = network.slopes(seen, slope)
    adam.update({name: slopes.get(name, np.zeros_like(values)) for name, values in adam.parameters.items()}, rate)
    return off[0]
