"""The network: its GRU, its samples, its file, and that it does what PyTorch does."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simrecon import resources
from simrecon.errors import InputError
from simrecon.io import atomic
from simrecon.synthesis import network_file
from simrecon.synthesis.features import CONTEXT, COUNT, FUTURE
from simrecon.synthesis.network import Gru
from tests.support.futures import CODE, MODES, network

CONTEXT_VALUES = 0.1 * np.random.default_rng(1).standard_normal((CONTEXT, COUNT))


def test_a_gru_keeps_its_state_where_the_update_gate_is_open() -> None:
    bias = np.array([0.0, 50.0, 0.0], np.float32)
    zero = np.zeros((3, 1), np.float32)
    gru = Gru(zero, zero, bias, np.zeros(3, np.float32))
    state = np.array([[0.4]], np.float32)
    np.testing.assert_allclose(gru.step(np.ones((1, 1), np.float32), state), state, atol=1e-6)


def test_samples_are_of_different_modes_and_the_same_for_the_same_seed() -> None:
    net = network()
    one, two = (net.sample(CONTEXT_VALUES, 14, np.random.default_rng(5)) for _ in range(2))
    assert one.shape == (14, FUTURE, COUNT)
    np.testing.assert_array_equal(one, two)
    assert (net.modes, net.code) == (MODES, CODE)
    apart = np.abs(one[:, None] - one[None]).max(axis=(2, 3))
    assert (apart[~np.eye(14, dtype=bool)] > 0).all()
    fewer = net.sample(CONTEXT_VALUES, 10, np.random.default_rng(5))
    np.testing.assert_allclose(one[:10], fewer, atol=1e-5)  # products of other sizes round otherwise


def test_a_future_begins_where_the_context_ends() -> None:
    made = network(move=1e-4).sample(CONTEXT_VALUES, 3, np.random.default_rng(0))
    np.testing.assert_allclose(made[:, 0], np.tile(CONTEXT_VALUES[-1], (3, 1)), atol=1e-3)


def test_a_file_holds_the_same_network(tmp_path: Path) -> None:
    net = network()
    atomic.write_npz(tmp_path / "net.npz", network_file.content(net, "{}"))
    codes = np.ones((2, CODE))
    read = network_file.read(tmp_path / "net.npz")
    np.testing.assert_array_equal(net.decode(CONTEXT_VALUES, codes), read.decode(CONTEXT_VALUES, codes))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"schema": np.array("other/1")}, "schema"),
        ({"points": np.array(["pelvis"])}, "points: found other points of the body"),
        ({"rate_hz": np.array(50.0)}, "rate_hz: found 50; valid: 30"),
        ({"out.bias": np.full(COUNT, np.nan)}, "out.bias"),
        ({"mean": np.zeros(3)}, "mean"),
    ],
)
def test_a_bad_file_is_one_line(tmp_path: Path, change: dict[str, np.ndarray], message: str) -> None:
    atomic.write_npz(tmp_path / "net.npz", network_file.content(network(), "{}") | change)
    with pytest.raises(InputError, match=f"net.npz: {message}"):
        network_file.read(tmp_path / "net.npz")


def test_the_network_that_ships_is_small_and_fast() -> None:
    assert (resources.folder("models") / "synthesis" / "futures.npz").stat().st_size <= 2_000_000
    net, taken = network_file.shipped(), []
    for _ in range(3):
        began = time.process_time()
        made = net.sample(CONTEXT_VALUES, 10, np.random.default_rng(0))
        taken.append(time.process_time() - began)
    assert made.shape == (10, FUTURE, COUNT)
    assert np.isfinite(made).all()
    assert min(taken) < 0.2


def test_numpy_and_torch_agree() -> None:
    torch = pytest.importorskip("torch", reason="PyTorch is not installed (extra train)")
    from tools.train import synthesis_model

    torch.manual_seed(0)
    model = synthesis_model.Model(np.full(COUNT, 0.1), np.full(COUNT, 0.3))
    with torch.no_grad():
        for weight in model.parameters():
            weight.copy_(weight.half().float())
    net = model.network()
    context = torch.tensor(CONTEXT_VALUES, dtype=torch.float32)[None]
    noise = np.random.default_rng(0).standard_normal(net.code)
    with torch.no_grad():
        factors, centres = model.modes(context)
        codes = (factors * torch.tensor(noise, dtype=torch.float32) + centres)[0]
        count = len(codes)
        read, last = (part.expand(count, -1) for part in (model.read(context), context[:, -1]))
        made = model.decode(read, last, codes).numpy()
    np.testing.assert_allclose(net.codes(CONTEXT_VALUES, noise), codes.numpy(), atol=1e-5)
    np.testing.assert_allclose(net.decode(CONTEXT_VALUES, codes.numpy()), made, atol=1e-4)
    other = replace(net, mean=net.mean + 0.1)
    assert np.abs(other.decode(CONTEXT_VALUES, codes.numpy()) - made).max() > 1e-4
