"""A disk that is full in the midst of a checkpoint is one line, with nothing of other libraries around it."""

import logging
import os
import sys
import time

import jax.numpy as jnp
import numpy as np
import pytest
from benchmarks.harness.disks import disk, remount

import skillcrew as sc
from skillcrew.experiment.checkpoints import Checkpoints

KILOBYTES = (20, 90, 160, 230, 300)
"""All too few, some for the first array, some for the last."""


def state():
    """340 kB that nothing makes smaller."""
    dice = np.random.default_rng(0)
    return {f"part {number}": jnp.asarray(dice.random(2100 + number, np.float32)) for number in range(40)}


class Careless:
    def __del__(self) -> None:
        raise ValueError("of another kind")


@pytest.mark.skipif(os.geteuid() != 0, reason="mounting a disk needs the rights of root")
def test_writes_that_are_cut_off_end_without_a_word(tmp_path, monkeypatch, caplog) -> None:
    heard: list[str] = []
    monkeypatch.setattr(sys, "unraisablehook", lambda unraisable: heard.append(str(unraisable.exc_value)))
    # Whoever looks before it writes is told before anything is begun.
    monkeypatch.setattr(Checkpoints, "check_room", lambda *_: None)
    with caplog.at_level(logging.WARNING), disk(tmp_path / "disk") as place:
        for size in KILOBYTES:
            assert remount(place, f"size={size}k")
            with pytest.raises(sc.UserError, match="the disk is full"):
                Checkpoints(place / "checkpoints").save(1, state(), 0.0)
        # Some callbacks come late.
        time.sleep(0.5)
        assert heard == []
        Careless()
        assert heard == ["of another kind"]
        assert remount(place, "size=16m")
        Checkpoints(place / "checkpoints").save(1, state(), 0.0)
    assert caplog.records == []
