"""What drafts, pictures that bridge the time until finer ones, take from a RenderCache and leave there.

A draft looks at the history of the finer picture where that is the newest, and afterwards goes on with its own; drafts
that keep none always look at the finer one. Finer pictures never see anything of it.
"""

from __future__ import annotations

import functools

import cistern_core as core
import numpy as np
import pytest
from numpy.typing import NDArray

from tests.render.test_history import (
    FRAMES_BEFORE,
    REPLICAS,
    SETTINGS,
    SIZE,
    SYSTEMS,
    color,
    mean_confidence,
    reference,
    run,
    scenes,
    values,
)
from tests.support.core_scenes import DEFAULTS
from tests.support.statistics import compare_replicas, sidak

FALSE_ALARM_RATE = 0.01
EDITS = ["camera", "moved_lamp", "everything"]
CASE_RATE = sidak(FALSE_ALARM_RATE, len(EDITS))

FINE = SYSTEMS["shared"] | dict(width=2 * SIZE, height=2 * SIZE)
DRAFT = SYSTEMS["shared"] | dict(is_draft=True)
LOOSE = DRAFT | dict(keep_history=False)


def last_of(*renders: tuple[core.Scene, dict]) -> NDArray:
    """The picture of the last of several renders with one cache."""
    cache = core.RenderCache()
    return [color(run(scene, cache, **settings)) for scene, settings in renders][-1]


@functools.cache
def drafts_after(edit: str) -> NDArray:
    before, after = scenes(edit)
    seeds = [dict(seed=seed) for seed in range(1, REPLICAS + 1)]
    pictures = [last_of((before, FINE | dict(samples=FRAMES_BEFORE) | seed), (after, DRAFT | seed)) for seed in seeds]
    return np.array([values(picture) for picture in pictures])


@pytest.mark.parametrize("edit", EDITS)
def test_a_draft_after_an_edit_is_unbiased(edit: str) -> None:
    """False-alarm rate of all edits together: FALSE_ALARM_RATE. Planted bug: weights 8 % too large."""
    result = compare_replicas(drafts_after(edit), reference(edit), CASE_RATE)
    assert result.agrees, result
    assert not compare_replicas(1.08 * drafts_after(edit), reference(edit), CASE_RATE).agrees


@pytest.mark.parametrize("drafts", [(DRAFT,), (LOOSE,), (DRAFT, LOOSE, LOOSE), (DRAFT, DRAFT)])
@pytest.mark.parametrize("edit", ["nothing", *EDITS])
def test_finer_pictures_see_nothing_of_drafts(edit: str, drafts: tuple[dict, ...]) -> None:
    before, after = scenes(edit)
    alone = last_of((before, FINE), (after, FINE))
    assert np.array_equal(last_of((before, FINE), *((after, draft) for draft in drafts), (after, FINE)), alone)
    as_finer = [draft | dict(is_draft=False, keep_history=True) for draft in drafts]
    disturbed = last_of((before, FINE), *((after, draft) for draft in as_finer), (after, FINE))
    assert not np.array_equal(disturbed, alone)


def test_a_draft_goes_on_with_the_newest_history() -> None:
    scene, cache = scenes("nothing")[0], core.RenderCache()
    cold = mean_confidence(run(scene, cache, **DRAFT))
    run(scene, cache, **FINE | dict(samples=8))
    assert mean_confidence(run(scene, cache, **DRAFT)) > 2.0 * cold
    fine, draft, loose = (scene, FINE), (scene, DRAFT), (scene, LOOSE)
    assert not np.array_equal(last_of(fine, draft, draft), last_of(fine, draft)), "of drafts, after one"
    assert np.array_equal(last_of(fine, draft, loose), last_of(fine, loose)), "always of the finer picture"
    assert not np.array_equal(last_of(fine, loose), last_of(loose))
    assert np.array_equal(last_of(fine, draft, fine, draft), last_of(fine, fine, draft)), "of the finer one again"


@pytest.mark.parametrize("system", sorted(SYSTEMS.keys() - {"restir", "visibility", "shared"}))
def test_other_history_is_not_looked_at(system: str) -> None:
    scene = scenes("nothing")[0]
    settings = SYSTEMS[system]
    draft = (scene, settings | dict(is_draft=True))
    assert np.array_equal(last_of((scene, settings), draft), last_of(draft))
    assert not np.array_equal(last_of((scene, settings), draft, draft), last_of(draft)), "but that of drafts"


def test_settings_must_agree() -> None:
    scene = scenes("nothing")[0]
    for other in (dict(max_bounces=3), dict(bias="FAST"), dict(temporal_reuse=False), dict(keep_history=False)):
        assert np.array_equal(last_of((scene, FINE | other), (scene, DRAFT)), last_of((scene, DRAFT))), other


def test_a_cancelled_render_changes_nothing() -> None:
    """A draft gives back what it borrowed, and a fine picture of which no frame was finished is not the newest."""
    before, after = scenes("camera")
    large = dict(width=4096, height=2048, samples=1)

    def pictures(is_cancelled: bool) -> list[NDArray]:
        cache = core.RenderCache()
        found = []
        for settings in (FINE, DRAFT, DRAFT, FINE):
            for more in (DRAFT, LOOSE, FINE) if is_cancelled and found else ():
                session = core.Session(core.Settings(**DEFAULTS | SETTINGS | dict(keep_history=True) | more | large))
                session.start(after, cache)
                session.cancel()
            found.append(color(run(after if found else before, cache, **settings)))
        return found

    for disturbed, undisturbed in zip(pictures(True), pictures(False), strict=True):
        assert np.array_equal(disturbed, undisturbed)


def test_dropped_history_is_not_looked_at() -> None:
    scene, cache = scenes("nothing")[0], core.RenderCache()
    run(scene, cache, **FINE)
    cache.drop_history()
    assert np.array_equal(color(run(scene, cache, **DRAFT)), last_of((scene, DRAFT)))
