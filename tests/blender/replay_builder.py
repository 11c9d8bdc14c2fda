"""A builder that keeps the state that the real one would have, so that two ways to a scene can be compared."""

from typing import Any

import fake_core
import numpy as np

from addon.sync.placements import is_flattened

KINDS = {
    "add_mesh": "mesh",
    "add_strands": "mesh",
    "add_splats": "mesh",
    "add_volume": "mesh",
    "add_material": "material",
    "add_image": "image",
}


class ReplayBuilder(fake_core.SceneBuilder):
    """`described` tells what would be rendered, whatever the handles and the order of things."""

    def __init__(self) -> None:
        super().__init__()
        self.stored: dict[str, dict[int, dict[str, Any]]] = {kind: {} for kind in (*KINDS.values(), "light")}
        self.names: list[str] = []
        self.sets: list[list[int]] = []
        self.instances: list[dict[str, Any]] = []
        self.value_names: list[str] = []
        self.value_rows: np.ndarray = np.empty((0, 0, 4))
        self.environment: dict[str, Any] = {}

    @property
    def singular_instances(self) -> int:
        matrices = [instance["object_to_world"].T for instance in self.instances]
        return int(is_flattened(np.array(matrices).reshape(-1, 4, 4)).sum())

    def _record(self, method: str, positional: tuple, named: dict[str, Any]) -> int:
        super()._record(method, positional, named)
        _, arguments = self.calls[-1]
        kind = "light" if method.endswith("_light") and method.startswith("add_") else KINDS.get(method)
        if kind is not None:
            return self._store(kind, method, dict(arguments))
        return getattr(self, f"do_{method}", lambda **_: 0)(**arguments)

    def _store(self, kind: str, method: str, arguments: dict[str, Any]) -> int:
        stored = self.stored[kind]
        handle = arguments.pop("replace", None)
        assert handle is None or handle < len(stored), "replaces what never was"
        handle = len(stored) if handle is None else handle
        stored[handle] = arguments | {"method": method, "is_there": True}
        return handle

    def do_add_object_name(self, name: str, **_: Any) -> int:
        self.names.append(name)
        return len(self.names) - 1

    def do_add_material_set(self, materials: list[int], owner_name: str) -> int:
        self.sets.append(materials)
        return len(self.sets) - 1

    def do_add_instances(self, **columns: np.ndarray) -> int:
        assert not self.instances, "the instances before were not cleared"
        self.instances = [{name: column[i] for name, column in columns.items()} for i in range(len(columns["mesh"]))]
        return 0

    def do_set_instance_values(self, names: list[str], rows: np.ndarray) -> None:
        self.value_names, self.value_rows = names, rows

    def do_clear_instances(self) -> None:
        self.instances = []

    def do_remove_mesh(self, handle: int) -> None:
        assert self.stored["mesh"][handle]["is_there"], "removed twice"
        self.stored["mesh"][handle]["is_there"] = False

    def do_remove_light(self, handle: int) -> None:
        assert self.stored["light"][handle]["is_there"], "removed twice"
        self.stored["light"][handle]["is_there"] = False

    def do_set_environment(self, **arguments: Any) -> None:
        self.environment = arguments

    def material(self, handle: int) -> Any:
        """What a material's program does, images by what they hold."""
        if handle < 0:
            return None
        program = self.stored["material"][handle]["program"]
        images = self.stored["image"]
        flags = program.pass_index, program.has_transparent_shadow, program.corrects_bumps
        return (
            program.name,
            flags,
            repr(
                [
                    (step[0], images[step[1]]["pixels"].tolist()) if step[0] == "image" else step
                    for step in program.steps
                ]
            ),
        )

    def described(self) -> tuple:
        return (
            sorted(map(repr, map(self._described_instance, self.instances))),
            sorted(repr(self._described_light(light)) for light in self.stored["light"].values() if light["is_there"]),
            {**self.environment, "material": self.material(self.environment.get("material", -1))},
        )

    def _described_instance(self, instance: dict[str, Any]) -> tuple:
        mesh = self.stored["mesh"][instance["mesh"]]
        assert mesh["is_there"]
        return (
            self.names[instance["object"]],
            mesh["positions"].round(5).tolist() if "positions" in mesh else _described_volume(mesh),
            mesh.get("radii", np.empty(0)).tolist(),
            [self.material(handle) for handle in self.sets[instance["material_set"]]],
            instance["object_to_world"].round(5).tolist(),
            int(instance["visibility"]),
            int(instance["holdout"]),
            float(instance["random"]),
            [instance[name].tolist() for name in ("link_sets", "links", "shadow_catcher") if name in instance],
            {name: self.value_rows[instance["values"], k].tolist() for k, name in enumerate(self.value_names)},
        )

    def _described_light(self, light: dict[str, Any]) -> dict[str, Any]:
        plain = {
            name: np.round(np.array(value, float), 5).tolist() for name, value in light.items() if name not in TEXTS
        }
        links = {name: light.get(name) for name in LINKS}
        return (
            plain
            | links
            | {"name": light["name"], "method": light["method"], "material": self.material(light["material"])}
        )


def _described_volume(volume: dict[str, Any]) -> list:
    grids = [(name, voxels.tolist(), matrix.round(5).tolist()) for name, voxels, matrix, _ in volume["grids"]]
    return [volume["object_to_box"].round(5).tolist(), volume["size"], volume["scales_with_object"], grids]


LINKS = ("lit_sets", "blocker_sets")
TEXTS = ("name", "method", "material", *LINKS)
