"""What a sync told a builder that records."""

import fake_core
import numpy as np


def instances(builder: fake_core.SceneBuilder) -> dict[str, np.ndarray]:
    calls = builder.of("add_instances")
    assert len(calls) == 1
    return calls[0]


def places(builder: fake_core.SceneBuilder) -> list[tuple[float, ...]]:
    return sorted(tuple(np.round(matrix[:3, 3], 4).tolist()) for matrix in instances(builder)["object_to_world"])
