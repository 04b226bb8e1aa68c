"""What every page is followed in."""

import sys

import jax
import pytest


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder, and JAX as a user has it; modules that a page writes there are forgotten after it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    with jax.numpy_rank_promotion("allow"), jax.numpy_dtype_promotion("standard"):
        yield tmp_path
    for name, module in list(sys.modules.items()):
        if str(getattr(module, "__file__", None)).startswith(str(tmp_path)):
            del sys.modules[name]


@pytest.fixture
def compiled_for_users(monkeypatch):
    """For a page that trains for longer than it compiles: its runs are compiled as a user's."""
    monkeypatch.delenv("XLA_FLAGS")
