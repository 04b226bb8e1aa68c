"""Settings that must stand before `skillcrew` is imported, and that every test runs under."""

import atexit
import functools
import gc
import importlib.metadata
import os
import shutil
import tempfile
from types import ModuleType

os.environ.setdefault("JAX_PLATFORMS", "cpu")
# Nobody reads which line an operation of a test's program came from; to write it down takes a twentieth.
os.environ["JAX_TRACEBACK_IN_LOCATIONS_LIMIT"] = "0"
# Programs in tests run for milliseconds: XLA compiles them three times as fast without LLVM's optimisations
# and without its emitters of fused loops. To split a program for 32 threads takes a sixth as long again, and
# other tests have the threads; that XLA checks itself after each group of its passes, a tenth.
os.environ["XLA_FLAGS"] = " ".join(
    (
        os.environ.get("XLA_FLAGS", ""),
        "--xla_backend_optimization_level=0",
        "--xla_cpu_parallel_codegen_split_count=1",
        "--xla_disable_hlo_passes=hlo-verifier",
        # Newer ones know no other emitters, and end the process over a flag that they do not know.
        "--xla_cpu_use_fusion_emitters=false" if importlib.metadata.version("jaxlib") < "0.11" else "",
    )
)

import flashbax.buffers.trajectory_buffer
import jax
import optax.tree
import pytest
from hypothesis import HealthCheck, settings
from jaxtyping import install_import_hook

# Checks each annotated shape and type at every call. It rewrites modules while they are imported,
# so it has to come first; users never pay for it.
install_import_hook("skillcrew", "beartype.beartype")

# A float mixed with an int, or a vector added to a matrix, is a mistake more often than meant.
jax.config.update("jax_numpy_dtype_promotion", "strict")
jax.config.update("jax_numpy_rank_promotion", "raise")


def _share_compiled_programs() -> None:
    """One folder for the session: what is compiled in it is read by later files, other workers, commands.

    Even the program of one operation is read in a fifth of the time that compiling it takes. Whoever comes
    first makes the folder, and removes it; the processes that it starts find it by the environment.
    """
    if "JAX_COMPILATION_CACHE_DIR" not in os.environ:
        folder = tempfile.mkdtemp(prefix="skillcrew-tests-")
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        os.environ["JAX_COMPILATION_CACHE_DIR"] = folder
    os.environ["JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"] = "0"
    jax.config.update("jax_compilation_cache_dir", os.environ["JAX_COMPILATION_CACHE_DIR"])
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)


_share_compiled_programs()


def _spare(module: ModuleType, name: str) -> None:
    """Exempts a function of another library, which relies on JAX's usual promotion."""
    function = getattr(module, name)

    @functools.wraps(function)
    def spared(*args, **kwargs):
        with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
            return function(*args, **kwargs)

    setattr(module, name, spared)


_spare(optax.tree, "bias_correction")  # Adam: decay ** count, a float and an int.
_spare(flashbax.buffers.trajectory_buffer, "sample")  # starts[:, None] + arange.

# Compiling for the first example takes seconds: no deadline, and slow is not unhealthy.
settings.register_profile("default", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("ci", settings.get_profile("default"), derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") == "true" else "default")


def pytest_collection_finish() -> None:
    """Looks for garbage less often: JAX's compiler makes many objects, and hardly any in circles."""
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> None:
    """Forgets a file's compiled programs: with gigabytes of them around, each new one takes twice as long."""
    if nextitem is not None and nextitem.path != item.path:
        jax.clear_caches()


@pytest.fixture
def finished():
    """The folder of a finished run. Read only: all tests share it."""
    from experiment import tiny  # Imports skillcrew, which must come after the settings above.

    return tiny.finished_run()


@pytest.fixture
def copied(finished, tmp_path):
    """A copy of a finished run, to damage."""
    return shutil.copytree(finished, tmp_path / "run")
