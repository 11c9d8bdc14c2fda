"""The benchmark of frames after an event: what it plays, and that all systems get the same time for it."""

import sys

import numpy as np
import pytest

from tests.benchmark.interactive import __main__ as interactive
from tests.benchmark.interactive import report
from tests.benchmark.interactive.catalogue import DIMMED, ELSEWHERE, FRAMES, OURS, REST, engine_named, pan
from tests.benchmark.interactive.measure import Experiment, Score, deviation, samples_in
from tests.benchmark.interactive.stage import Stage
from tests.benchmark.scoreboard.catalogue import CYCLES, PATH_TRACER, scene_named

PIXELS, SAMPLES = 144, 4
FRONT = "cycles-front"  # its choice of what to sample does not depend on the brightness


@pytest.fixture(scope="module")
def experiment(built_core, registered_addon):
    """In a scene whose only light is the one that is dimmed."""
    engines = [engine_named(name) for name in (OURS, PATH_TRACER, FRONT)]
    return Experiment(Stage(scene_named("door_ajar"), PIXELS), engines, 2)


def picture(experiment, name, moment):
    return experiment._still(engine_named(name), moment, SAMPLES, 1).picture


@pytest.mark.parametrize("name", [PATH_TRACER, FRONT])
def test_both_engines_see_the_events(experiment, name):
    """Light is linear: pictures of one seed at half the brightness are half as bright. The bug that this would show, an
    edit that does not arrive, leaves them equal."""
    rest, dimmed, elsewhere = (picture(experiment, name, moment) for moment in (REST, DIMMED, ELSEWHERE))
    assert rest.max() > 0.0
    np.testing.assert_allclose(dimmed, 0.5 * rest, rtol=1e-3, atol=1e-6)
    assert not np.allclose(elsewhere, rest, rtol=0.1)


def test_a_cold_start_knows_nothing_of_what_was_played_before(experiment):
    """Bit for bit; with the history of the same view it is another picture."""
    engine = engine_named(OURS)
    first = experiment._still(engine, REST, SAMPLES, 1).picture
    assert not np.array_equal(experiment._at_rest(engine, DIMMED, SAMPLES, 1).picture, first)
    experiment._stills.clear()
    assert np.array_equal(experiment._still(engine, REST, SAMPLES, 1).picture, first)


def test_the_pan_ends_at_rest():
    assert pan(FRAMES[-1]) == REST
    assert len({pan(frame) for frame in range(FRAMES[-1] + 1)}) == FRAMES[-1] + 1


def test_samples_fit_into_the_time_of_frames():
    assert [samples_in(frames, 2.6) for frames in (1, 4)] == [3, 10]
    assert [samples_in(frames, 0.3) for frames in (1, 4)] == [1, 1]


def test_the_error_of_a_mean():
    """Of two values it is half of what they differ by."""
    assert deviation([1.0, 3.0]) == pytest.approx(0.5)
    assert deviation([2.0]) == 0.0


def score(name, frame, pixel, box8):
    return Score("cold start", engine_named(name), frame, 3 * frame, 0.1, pixel, box8, 1.0, 0.1, 0.2)


def test_the_least_error_of_a_frame_is_bold():
    scores = [
        score(OURS, 1, 0.5, 0.1),
        score(CYCLES, 4, 0.3, 0.2),
        score(CYCLES, 1, 0.9, 0.02),
        score(OURS, 4, 0.1, 0.3),
    ]
    assert report.table("scene", scores)[2:] == [
        "| cold start | Interactive (ours) | 3, 12 | **0.5** | **0.1** | 0.1 | 0.3 |",
        "| cold start | Cycles | 3, 12 | 0.9 | 0.3 | **0.02** | **0.2** |",
    ]


def test_missing_matplotlib_ends_the_command_before_it_renders(monkeypatch, tmp_path):
    output = tmp_path / "out"
    monkeypatch.setitem(sys.modules, "matplotlib", None)  # as if not installed
    monkeypatch.setattr(sys, "argv", ["interactive", "--output", str(output)])
    with pytest.raises(SystemExit, match="pip install matplotlib"):
        interactive.main()
    assert not output.exists()
