"""The network that decides: its slopes are right, and the others' order and number do not matter."""

import numpy as np
import pytest

from vrg_learn.network import Adam, Network, Parameters, initial

OWN, SLOT, OUTPUTS = 5, 3, 2


def network(seed: int = 0, kind: type = np.float32) -> Network:
    parameters = initial(OWN, SLOT, OUTPUTS, np.random.default_rng(seed), last=1.0)
    return Network({name: values.astype(kind) for name, values in parameters.items()})


def observations(rows: int, slots: int, unknown: int = 0, seed: int = 1) -> np.ndarray:
    """Random observations whose last slots are unknown."""
    found = np.random.default_rng(seed).uniform(-1.0, 1.0, (rows, OWN + slots * SLOT)).astype(np.float32)
    if unknown:
        found[:, -unknown * SLOT :] = 0.0
    return found


@pytest.mark.parametrize(("slots", "unknown"), [(4, 0), (4, 2), (1, 1), (0, 0)])
def test_slopes_are_those_of_finite_differences(slots: int, unknown: int) -> None:
    net, seen = network(kind=np.float64), observations(6, slots, unknown).astype(np.float64)
    wanted = np.random.default_rng(2).uniform(-1.0, 1.0, (6, OUTPUTS))

    def loss() -> float:
        return float(((net(seen) - wanted) ** 2).sum())

    outputs, trace = net.forward(seen)
    slopes = net.backward(trace, 2.0 * (outputs - wanted))
    rng = np.random.default_rng(3)
    for name, values in net.parameters.items():
        for _ in range(20):
            at = tuple(rng.integers(size) for size in values.shape)
            kept, step = values[at], 1e-6
            values[at] = kept + step
            above = loss()
            values[at] = kept - step
            below = loss()
            values[at] = kept
            assert slopes[name][at] == pytest.approx((above - below) / (2 * step), rel=1e-5, abs=1e-6), name


def test_neither_the_order_of_the_others_nor_unknown_ones_nor_other_rows_matter() -> None:
    net, seen = network(), observations(64, 6)
    others = seen[:, OWN:].reshape(64, 6, SLOT)[:, [3, 1, 5, 0, 2, 4]].reshape(64, -1)
    np.testing.assert_allclose(net(np.hstack([seen[:, :OWN], others])), net(seen), atol=1e-5)
    for row in (0, 17, 63):
        np.testing.assert_allclose(net(seen[row : row + 1])[0], net(seen)[row], atol=1e-5)
    unknown = observations(5, 6, unknown=2)
    np.testing.assert_allclose(net(unknown[:, : OWN + 4 * SLOT]), net(unknown), atol=1e-5)


def test_slopes_of_many_rows_are_those_of_all_at_once() -> None:
    net, seen = network(kind=np.float64), observations(1300, 3).astype(np.float64)
    outputs, trace = net.forward(seen)
    np.testing.assert_array_equal(net(seen).shape, outputs.shape)
    np.testing.assert_allclose(net(seen), outputs)
    together, pieces = net.backward(trace, 2.0 * outputs), net.slopes(seen, lambda found, part: 2.0 * found)
    for name, values in together.items():
        np.testing.assert_allclose(pieces[name], values, rtol=1e-9, atol=1e-9)


def test_the_same_seed_makes_the_same_network() -> None:
    def trained(seed: int) -> Parameters:
        net, seen = network(seed), observations(32, 3)
        adam = Adam(net.parameters)
        for _ in range(3):
            adam.update(net.slopes(seen, lambda outputs, part: outputs - 0.5), 1e-2)
        return net.parameters

    first, again, other = trained(0), trained(0), trained(1)
    assert all((first[name] == again[name]).all() for name in first)
    assert (first["slot.weight"] != other["slot.weight"]).any()
    assert {values.dtype for values in first.values()} == {np.dtype(np.float32)}


def test_a_fit_of_a_function_of_the_nearest_other_gets_better() -> None:
    net, seen = network(), observations(128, 4)
    wanted = seen[:, OWN::SLOT].max(axis=1, keepdims=True) * np.ones((1, OUTPUTS), dtype=np.float32)
    adam, losses = Adam(net.parameters, longest=100.0), []
    for _ in range(60):
        outputs, trace = net.forward(seen)
        losses.append(float(((outputs - wanted) ** 2).mean()))
        adam.update(net.backward(trace, 2.0 * (outputs - wanted) / wanted.size), 3e-3)
    assert losses[-1] < 0.3 * losses[0]
