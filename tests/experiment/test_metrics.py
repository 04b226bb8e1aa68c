"""The metrics file: one row per seed and generation."""

import os

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import skillcrew as sc
from experiment.tiny import SEEDS, STEPS, assert_same_arrays
from skillcrew.experiment.metrics import MetricsLog, read_metrics, read_scores


def chunk(first, n_seeds=2, generations=2):
    """Metrics in which `value` says seed index and generation: 1003 is generation 3 of the second seed."""
    generation = np.broadcast_to(
        np.arange(first, first + generations, dtype=np.int32), (n_seeds, generations)
    )
    value = 1000.0 * np.arange(n_seeds)[:, None] + generation
    return {
        "generation": generation,
        "environment_steps": 10 * generation,
        "success_rate": np.full((n_seeds, generations), np.nan),
        "value": value,
    }


def test_rows_are_ordered_as_the_run_lists_its_seeds(tmp_path):
    log = MetricsLog((11, 3))
    log.add(chunk(1))
    log.add(chunk(3))
    log.write(tmp_path / "m.parquet")
    columns = read_metrics(tmp_path / "m.parquet")
    assert columns["seed"].tolist() == [11] * 4 + [3] * 4
    assert columns["generation"].tolist() == [1, 2, 3, 4] * 2
    assert columns["value"].tolist() == [1, 2, 3, 4, 1001, 1002, 1003, 1004]
    assert np.isnan(columns["success_rate"]).all()


def test_rows_after_the_checkpoint_are_dropped(tmp_path):
    reference, log = MetricsLog((11, 3)), MetricsLog((11, 3))
    for first in (1, 3, 5):
        reference.add(chunk(first))
    log.restore(reference.columns(), 4)
    assert log.columns()["generation"].max() == 4
    log.add(chunk(5))
    assert_same_arrays(log.columns(), reference.columns())


def test_a_run_has_one_row_per_seed_and_generation(finished):
    columns = read_metrics(finished / "metrics.parquet")
    generations = columns["generation"].max()
    assert columns["seed"].tolist() == [SEEDS[0]] * generations + [SEEDS[1]] * generations
    assert columns["generation"].tolist() == [*range(1, generations + 1)] * 2
    for seed in SEEDS:
        steps = columns["environment_steps"][columns["seed"] == seed]
        assert (np.diff(steps) > 0).all() and steps[-1] >= STEPS
    assert {"fitness_best", "fitness_mean", "return_go_to_poi_A", "stopped_at_go_to_poi_B"} <= set(columns)
    assert ((columns["success_rate"] >= 0) & (columns["success_rate"] <= 1)).all()
    assert 0 < columns["success_rate"].mean() < 1, "too easy or too hard to show anything"


def test_damaged_missing_and_foreign_files_are_one_line(finished, tmp_path):
    whole = (finished / "metrics.parquet").read_bytes()
    path = tmp_path / "m.parquet"
    for damaged in (b"", b"PAR1", whole[: len(whole) // 2], whole[100:], b"x" * 1000):
        path.write_bytes(damaged)
        with pytest.raises(sc.UserError, match=r"m\.parquet: missing or damaged") as caught:
            read_metrics(path)
        assert "\n" not in str(caught.value)
    with pytest.raises(sc.UserError, match="missing or damaged"):
        read_metrics(tmp_path / "none.parquet")
    pq.write_table(pa.table({"wine": [1, 2]}), path)
    with pytest.raises(sc.UserError, match="not metrics of skillcrew"):
        read_metrics(path)


def test_advice_about_damaged_metrics_holds(copied):
    # The message must not send people to a command that fails with the same message.
    (copied / "metrics.parquet").write_bytes(b"damaged")
    with pytest.raises(sc.UserError) as caught:
        sc.Run(copied).metrics()
    assert "move it away" in str(caught.value)
    (copied / "metrics.parquet").rename(copied / "elsewhere.parquet")
    sc.Run(copied).resume()


def test_a_pipe_or_a_folder_in_their_place_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.parquet")
    (tmp_path / "folder.parquet").mkdir()
    for name in ("pipe", "folder"):
        with pytest.raises(sc.UserError, match=f"{name}.parquet: missing or damaged metrics"):
            read_metrics(tmp_path / f"{name}.parquet")


@pytest.mark.parametrize(
    ("column", "values"),
    [
        ("seed", ["x", "y"]),
        ("seed", [1.5, 2.0]),
        ("generation", [None, 1]),
        ("success_rate", ["x", None]),
        ("return_near", [[1], [2]]),
    ],
)
def test_columns_that_hold_other_than_numbers_are_no_metrics(column, values, tmp_path):
    columns = {"seed": [1, 2], "generation": [1, 1], "environment_steps": [9, 9], "success_rate": [0.0, 1.0]}
    pq.write_table(pa.table({**columns, column: values}), tmp_path / "m.parquet")
    with pytest.raises(sc.UserError, match=rf"not metrics of skillcrew \({column} holds"):
        read_metrics(tmp_path / "m.parquet")


def test_of_curves_alone_the_other_columns_are_not_read(tmp_path, monkeypatch):
    log = MetricsLog((11, 3))
    log.add(chunk(1))
    log.write(tmp_path / "m.parquet")
    columns = read_scores(tmp_path / "m.parquet")
    assert set(columns) == {"seed", "generation", "environment_steps", "success_rate", "team_return"}
    np.testing.assert_array_equal(columns["seed"], [11, 11, 3, 3])
    monkeypatch.setattr("skillcrew.experiment.metrics.MOST_SCORED", 3)
    with pytest.raises(sc.UserError, match="4 rows, and at most 3"):
        read_scores(tmp_path / "m.parquet")
    assert len(read_metrics(tmp_path / "m.parquet")["seed"]) == 4


def test_texts_are_refused_before_they_are_read(tmp_path, monkeypatch):
    path = tmp_path / "m.parquet"
    texts = pa.array(["long" * 1000] * 1000).dictionary_encode()
    pq.write_table(
        pa.table({"seed": texts, "generation": range(1000), "environment_steps": range(1000)}), path
    )
    monkeypatch.setattr(pq.ParquetFile, "read", lambda *_, **__: pytest.fail("it was read"))
    with pytest.raises(sc.UserError, match="seed holds other than numbers"):
        read_scores(path)
