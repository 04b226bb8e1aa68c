"""What TensorBoard reads of a record."""

import contextlib

import matplotlib.image
import numpy as np
import pytest
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.plugins.hparams.plugin_data_pb2 import HParamsPluginData

from experiment.trackers.conftest import CONFIGURATION, SEEDS
from skillcrew.experiment.evaluation import Evaluation
from skillcrew.experiment.trackers.tracking import Tracking

# Its protocol buffers were made by an older compiler.
pytestmark = pytest.mark.filterwarnings("ignore::UserWarning:google")


@pytest.fixture
def opened():
    """Opens a record as a new process would; one that is killed closes nothing."""
    with contextlib.ExitStack() as stack:

        def opened(folder):
            tracking = stack.enter_context(contextlib.closing(Tracking(("tensorboard",), pytest.fail)))
            tracking.open(folder, CONFIGURATION, SEEDS)
            return tracking

        yield opened


def concluded(tracking, log, folder):
    picture = folder / "picture.png"
    matplotlib.image.imsave(picture, np.zeros((2, 5, 3)))
    evaluation = Evaluation(
        SEEDS,
        4,
        np.array([[1.0, 1, 0, 0], [1, 0, 0, 0]]),
        np.zeros((2, 4, 1, 1), int),
        np.array([[1, 1, 0, 0], [1, 0, 0, 0]], bool),
    )
    tracking.conclude(evaluation, log.columns, {seed: {"chosen_skills": picture} for seed in SEEDS})


def read(folder, seed):
    everything = EventAccumulator(
        str(folder / "tensorboard" / f"seed-{seed}"), {"scalars": 0, "images": 0, "tensors": 0}
    )
    return everything.Reload()


def points(events, tag):
    return [(event.step, event.value) for event in events.Scalars(tag)]


def test_every_column_over_environment_steps_for_each_seed(opened, grown, tmp_path):
    tracking = opened(tmp_path)
    tracking.record(grown(2))
    # Before it is closed: somebody may be watching.
    events = read(tmp_path, 11)
    assert points(events, "success_rate") == [(101, pytest.approx(0.01)), (202, pytest.approx(0.02))]
    assert points(events, "loss_A") == [(202, 1.0)]
    assert points(events, "generation") == [(101, 1.0), (202, 2.0)]
    assert points(read(tmp_path, 3), "generation") == [(100, 1.0), (200, 2.0)]


def test_the_configuration_is_text_and_hyperparameters(opened, grown, tmp_path):
    opened(tmp_path).record(grown(1))
    events = read(tmp_path, 11)
    (text,) = events.Tensors("configuration")
    assert text.tensor_proto.string_val[0].decode() == f"```yaml\n{CONFIGURATION}```"
    content = events.SummaryMetadata("_hparams_/session_start_info").plugin_data.content
    values = HParamsPluginData.FromString(content).session_start_info.hparams
    assert values["seed"].number_value == 11 and values["algorithm.name"].string_value == "ea"
    assert values["algorithm.hidden"].string_value == "[8, 8]"


def test_a_run_that_goes_on_continues_its_record(opened, grown, tmp_path):
    opened(tmp_path).record(grown(2))
    tracking = opened(tmp_path)
    tracking.record(grown(4))
    tracking.record(grown(5))
    assert points(read(tmp_path, 3), "generation") == [(100 * n, float(n)) for n in range(1, 6)]


def test_what_was_written_before_a_kill_is_there_once(opened, grown, tmp_path):
    opened(tmp_path).record(grown(2))
    noted = tmp_path / "tensorboard" / "recorded.json"
    before = noted.read_text()
    opened(tmp_path).record(grown(4))
    # Killed after it wrote, and before it could note how far it is.
    noted.write_text(before)
    opened(tmp_path).record(grown(5))
    assert points(read(tmp_path, 3), "generation") == [(100 * n, float(n)) for n in range(1, 6)]


def test_scores_and_figures_come_once_in_the_end(opened, grown, tmp_path):
    tracking = opened(tmp_path)
    tracking.record(grown(2))
    concluded(tracking, grown(2), tmp_path)
    # Resumed, though nothing is left to train.
    concluded(opened(tmp_path), grown(2), tmp_path)
    events = read(tmp_path, 11)
    assert points(events, "final/success_rate") == [(202, 0.25)]
    assert points(events, "generation") == [(101, 1.0), (202, 2.0)]
    (image,) = events.Images("chosen_skills")
    assert (image.step, image.width, image.height) == (202, 5, 2)
    assert image.encoded_image_string == (tmp_path / "picture.png").read_bytes()


def test_a_record_begun_late_has_the_scores_of_later_generations_alone(opened, grown, tmp_path):
    tracking = opened(tmp_path)
    tracking.record(grown(2))
    concluded(tracking, grown(2), tmp_path)
    tracking = opened(tmp_path)
    tracking.record(grown(3))
    concluded(tracking, grown(3), tmp_path)
    assert [step for step, _ in points(read(tmp_path, 3), "final/success_rate")] == [200, 300]
