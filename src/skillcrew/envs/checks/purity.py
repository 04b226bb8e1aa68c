"""The same key gives the same result, nothing is kept in Python, and no key is used twice."""

from collections.abc import Iterator

import jax

from skillcrew.envs.checks.report import Finding
from skillcrew.envs.checks.subject import Subject, alike

TOLERANCE = 1e-4
"""What compiling may change: sums in another order."""


def check_purity(subject: Subject) -> Iterator[Finding]:
    """Calls everything twice, as plain Python: only so is what it keeps in Python seen."""
    env, key = subject.env, subject.draw(0)
    kept = dict(vars(env))
    start = env.reset(key)
    if not alike(start, env.reset(key)):
        yield Finding("wrong", "purity", "reset gives two worlds for one key; draw all from the key")
    key_step, action = subject.draw(1), subject.still_of()
    moved = env.step(start[0], action, key_step)
    if not alike(moved, env.step(start[0], action, key_step)):
        yield Finding(
            "wrong",
            "purity",
            "step gives two results for the same state, action and key; keep what changes in the state, and "
            "draw all from the key",
        )
    changed = [name for name, value in vars(env).items() if name not in kept or kept[name] is not value]
    if changed:
        yield Finding("wrong", "purity", f"self.{changed[0]} changes while playing; keep it in the state")
    if not alike(moved, jax.jit(env.step)(start[0], action, key_step), TOLERANCE):
        yield Finding(
            "wrong",
            "purity",
            "step gives other results once compiled; use jax.numpy alone, and no randomness but the key's",
        )
    if alike(start[0], env.reset(subject.draw(2))[0]):
        yield Finding(
            "note", "reset", "two keys give the same world; draw it from the key, unless it is meant"
        )
    yield Finding("fine", "purity", "the same key gives the same result, and nothing is kept in Python")


def check_keys(subject: Subject) -> Iterator[Finding]:
    """No key is drawn from twice, and none that was split is drawn from."""
    env = subject.env
    state, _ = env.reset(subject.draw(0))
    calls = {"reset": env.reset, "step": lambda key: env.step(state, subject.still_of(), key)}
    for name, call in calls.items():
        try:
            with jax.debug_key_reuse(True):
                jax.jit(call)(jax.random.key(0))
        except jax.errors.KeyReuseError:
            yield Finding(
                "wrong",
                "keys",
                f"{name} draws from one key twice, so that what it draws hangs together; jax.random.split it "
                "and use each part once",
            )
            return
    yield Finding("fine", "keys", "none is used twice")
