"""Baselines of JaxMARL's repository as they lie there. Used by `jaxmarl_ippo.py` and `jaxmarl_ppo.py`."""

import contextlib
import importlib.util
import sys
import time
import types
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jax

import skillcrew as sc
from skillcrew.envs.bridges.jaxmarl_package import import_jaxmarl

FOLDER = "baselines"
"""Of JaxMARL's repository, where they are."""
IPPO = Path("baselines/IPPO/ippo_ff_mabrax.py")
"""JaxMARL's IPPO for continuous actions."""


def make(name: str, skills: Sequence[str] = (), **options: Any) -> Any:
    """What `jaxmarl.make` is to the baseline."""
    return sc.jaxmarl_env(sc.make(name, **options), skills)


def load(checkout: Path, file: Path) -> Any:
    """A baseline as a module."""
    import_jaxmarl()
    spec = importlib.util.spec_from_file_location(file.stem, checkout / file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def load_on_ours(checkout: Path) -> Any:
    """IPPO as a module that takes its environments from `make`; JaxMARL itself stays as it is."""
    module = load(checkout, IPPO)
    vars(module)["jaxmarl"] = types.SimpleNamespace(make=make)
    return module


def settings(checkout: Path, file: Path) -> dict[str, Any]:
    """What a baseline's own file says."""
    # YAML's own reader takes 1e-3 for a word.
    from omegaconf import OmegaConf

    read = OmegaConf.to_container(OmegaConf.load(checkout / file))
    assert isinstance(read, dict)
    return {str(name): value for name, value in read.items()}


def train(baseline: Any, config: dict[str, Any], seed: int) -> dict[str, Any]:
    """The parameters at the end, the mean return at each update, and the seconds it took."""
    # As in the baseline's own `main`. It draws the first parameters outside of what is compiled.
    key, init = jax.random.split(jax.random.PRNGKey(seed))
    began = time.process_time()
    # Tracing it prints.
    with contextlib.redirect_stdout(sys.stderr):
        compiled = jax.jit(baseline.make_train(dict(config), init)).lower(key).compile()
    compiling = time.process_time() - began
    began, of_processor = time.perf_counter(), time.process_time()
    out = jax.block_until_ready(compiled(key))
    return {
        "params": out["runner_state"][0].params,
        "returns": out["metrics"]["returned_episode_returns"],
        "compiling": compiling,
        "elapsed": time.perf_counter() - began,
        "processor": time.process_time() - of_processor,
    }
