"""One step of the version matrix, inside Blender: `python inside.py STEP` with the bpy module, or
`blender -b --python-exit-code 1 --python inside.py -- STEP`. It fails by an exception.

The runner gives each step an empty user directory (BLENDER_USER_RESOURCES, set before Blender starts) and names the
files in CISTERN_ZIP, CISTERN_NEXT_ZIP and CISTERN_BESIDE. Only Blender and what the zip brings are needed here.
"""

import os
import re
import struct
import sys
import tempfile
import zlib
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

MODULE = "bl_ext.user_default.cistern"
CLASS_PREFIX = "CISTERN"
WIDTH, HEIGHT = 48, 36

# Means of Blender's default scene by Cistern and Cycles: 0.994 to 1.001 of each other for 20 pairs of seeds.
SAMPLES = 64
SAME_MEAN = 0.02


def user_directory() -> Path:
    return Path(os.environ["BLENDER_USER_RESOURCES"])


def install(variable: str = "CISTERN_ZIP") -> None:
    answer = bpy.ops.extensions.package_install_files(
        filepath=os.environ[variable], repo="user_default", enable_on_install=True
    )
    assert answer == {"FINISHED"}, answer
    assert MODULE in bpy.context.preferences.addons, "installed, but not enabled"


def render(engine: str = "CISTERN", seed: int = 1) -> np.ndarray:
    """Linear pixels (height, width, 4). Raises what the engine reports."""
    scene = bpy.context.scene
    scene.render.engine = engine
    settings = scene.cycles if engine == "CYCLES" else scene.cistern
    settings.samples, settings.seed = SAMPLES, seed
    if engine == "CYCLES":
        settings.use_denoising = settings.use_adaptive_sampling = False
        settings.sample_clamp_indirect = 0.0
    render_settings = scene.render
    render_settings.resolution_x, render_settings.resolution_y = WIDTH, HEIGHT
    render_settings.resolution_percentage = 100
    image_settings = render_settings.image_settings
    image_settings.file_format, image_settings.color_depth = "OPEN_EXR", "32"
    with tempfile.TemporaryDirectory() as folder:
        render_settings.filepath = str(Path(folder) / "picture.exr")
        bpy.ops.render.render(write_still=True)
        picture = bpy.data.images.load(render_settings.filepath)
        pixels = np.empty(WIDTH * HEIGHT * 4, np.float32)
        picture.pixels.foreach_get(pixels)
        bpy.data.images.remove(picture)
    assert pixels.max() > 0, f"{engine}'s picture is black"
    return pixels.reshape(HEIGHT, WIDTH, 4)


def core_is_ours() -> None:
    """Embree and oneTBB that answer the core are those of the extension, in the version it was compiled with."""
    import cistern_core

    for library in (cistern_core.EMBREE_LIBRARY, cistern_core.TBB_LIBRARY, cistern_core.__file__):
        assert Path(library).is_relative_to(user_directory() / "extensions"), library
    assert "cistern_embree" in cistern_core.EMBREE_LIBRARY, cistern_core.EMBREE_LIBRARY
    assert cistern_core.EMBREE_VERSION.startswith("3."), cistern_core.EMBREE_VERSION


def mapped_libraries(pattern: str) -> list[str]:
    lines = Path("/proc/self/maps").read_text().splitlines()
    return sorted({line.split()[-1] for line in lines if re.search(pattern, line)})


TEXTURE_RGB = (0.25, 0.75, 0.002)  # the last less than a step of 8 bits


def write_png(file: Path, size: int = 8) -> None:
    """A plain picture of 16 bits a channel."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    row = b"\0" + struct.pack(">3H", *(round(value * 65535) for value in TEXTURE_RGB)) * size
    header = struct.pack(">2I5B", size, size, 16, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(row * size)), (b"IEND", b""))
    file.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(chunk(kind, content) for kind, content in chunks))


def textured_plane(scene: bpy.types.Scene) -> None:
    """The camera sees nothing but a shadeless picture."""
    write_png(user_directory() / "texture.png")
    loaded = bpy.data.images.load(str(user_directory() / "texture.png"))
    loaded.colorspace_settings.name = "Non-Color"
    material = bpy.data.materials.new("picture")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    texture, emission = nodes.new("ShaderNodeTexImage"), nodes.new("ShaderNodeEmission")
    texture.image = loaded
    links.new(texture.outputs["Color"], emission.inputs["Color"])
    links.new(emission.outputs["Emission"], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    bpy.ops.mesh.primitive_plane_add(size=1000.0)
    plane = bpy.context.object
    plane.data.materials.append(material)
    plane.matrix_world = scene.camera.matrix_world @ Matrix.Translation((0.0, 0.0, -1.0))


def expect_texture() -> None:
    textured_plane(bpy.context.scene)
    pixels = render()
    np.testing.assert_allclose(pixels[..., :3].reshape(-1, 3).mean(0), TEXTURE_RGB, atol=1e-4)


def step_render() -> None:
    """Installed from the zip alone, it renders, textures included, with its own libraries."""
    install()
    render()
    core_is_ours()
    expect_texture()


def step_cycles_between() -> None:
    """Before and after a Cycles render in the same process: the same picture bit for bit, and that of Cycles."""
    install()
    before = render()
    cycles = render("CYCLES")
    after = render()
    core_is_ours()
    assert np.array_equal(before, after), "the picture changed after Cycles had rendered"
    ratio = before[..., :3].mean() / cycles[..., :3].mean()
    assert abs(ratio - 1) < SAME_MEAN, f"mean {ratio:.3f} times that of Cycles"


def step_cycles_around() -> None:
    """Cycles before and after: its picture does not change, and the core loads into a process that has Embree."""
    before = render("CYCLES")
    install()
    render()
    core_is_ours()
    assert np.array_equal(before, render("CYCLES")), "Cycles' picture changed"


def render_mitsuba() -> np.ndarray:
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    scene = mitsuba.load_dict(mitsuba.cornell_box() | {"sensor": small_sensor(mitsuba)})
    return np.array(mitsuba.render(scene, spp=4, seed=1))


def small_sensor(mitsuba) -> dict:
    return mitsuba.cornell_box()["sensor"] | {"film": {"type": "hdrfilm", "width": 32, "height": 32}}


def step_mitsuba() -> None:
    """Beside Mitsuba, which brings an Embree of the same version number: both render as before."""
    sys.path.insert(0, os.environ["CISTERN_BESIDE"])
    theirs = render_mitsuba()
    install()
    ours = render()
    core_is_ours()
    # Its threads add pixels up in changing order.
    np.testing.assert_allclose(render_mitsuba(), theirs, rtol=1e-3, atol=1e-5, err_msg="Mitsuba's picture changed")
    assert np.array_equal(ours, render()), "the picture changed after Mitsuba had rendered"
    assert len(mapped_libraries(r"embree3")) > 1, "Mitsuba no longer brings an Embree: choose another neighbour"


def step_openimageio() -> None:
    """With another OpenImageIO on the path, loaded first."""
    sys.path.insert(0, os.environ["CISTERN_BESIDE"])
    import OpenImageIO

    assert OpenImageIO.__file__.startswith(os.environ["CISTERN_BESIDE"]), OpenImageIO.__file__
    install()
    expect_texture()
    core_is_ours()


def registered_names() -> list[str]:
    return [name for name in dir(bpy.types) if name.startswith(CLASS_PREFIX)]


def our_handlers() -> list[object]:
    lists = [getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers) if not name.startswith("_")]
    handlers = [handler for found in lists if isinstance(found, list) for handler in found]
    return [handler for handler in handlers if "cistern" in getattr(handler, "__module__", "")]


def expect_unregistered() -> None:
    assert not registered_names() and not our_handlers(), (registered_names(), our_handlers())
    assert not hasattr(bpy.types.Scene, "cistern") and not hasattr(bpy.types.ViewLayer, "cistern")
    try:
        bpy.context.scene.render.engine = "CISTERN"
    except TypeError:
        return
    raise AssertionError("the engine can still be chosen")


def step_disable() -> None:
    """Disabled it is gone, enabled again it renders the same picture."""
    install()
    before = render()
    bpy.context.scene.render.engine = "CYCLES"
    bpy.ops.preferences.addon_disable(module=MODULE)
    expect_unregistered()
    bpy.ops.preferences.addon_enable(module=MODULE)
    assert np.array_equal(before, render()), "the picture changed"


def installed_files() -> set[str]:
    """What lies in the user's extensions, without the indices and caches of Blender's own."""
    folder = user_directory() / "extensions"
    files = {file.relative_to(folder).as_posix() for file in folder.rglob("*") if not file.is_dir()}
    return {name for name in files if ".blender_ext" not in name and ".cache" not in name and "__pycache__" not in name}


def step_upgrade() -> None:
    """Installed over an older version it takes its place, in the running process and on disk."""
    install()
    render()
    install("CISTERN_NEXT_ZIP")
    render()
    manifest = (user_directory() / "extensions/user_default/cistern/blender_manifest.toml").read_text()
    assert f'version = "{os.environ["CISTERN_NEXT_VERSION"]}"' in manifest, manifest
    cores = [name for name in installed_files() if re.search(r"cistern_core-[^/]*dist-info/METADATA$", name)]
    assert len(cores) == 1 and os.environ["CISTERN_NEXT_VERSION"] in cores[0], cores


def step_uninstall() -> None:
    """Everything that installing brought goes again."""
    before = installed_files()
    install()
    render()
    bpy.context.scene.render.engine = "CYCLES"
    repositories = bpy.context.preferences.extensions.repos
    bpy.ops.extensions.package_uninstall(repo_index=repositories.find("User Default"), pkg_id="cistern")
    expect_unregistered()
    assert MODULE not in bpy.context.preferences.addons
    assert installed_files() == before, sorted(installed_files() - before)


def expect_refusal(words: str) -> None:
    """The preferences and a render say `words` in one sentence, and the add-on stays usable."""
    core = sys.modules[f"{MODULE}.core"]
    is_ready, sentence = core.status()
    assert not is_ready and words in sentence and "\n" not in sentence, sentence
    try:
        render()
    except RuntimeError as error:
        assert words in str(error), error
        return
    raise AssertionError("a render without a core did not fail")


def step_unsupported() -> None:
    """Without a core for this Python, or with one that refuses the processor: one sentence, no traceback."""
    install()
    assert sys.modules[f"{MODULE}.core"].status()[0]
    site = next(Path(path) for path in sys.path if path and (Path(path) / "cistern_core.libs").is_dir())
    [binary] = site.glob("cistern_core*.so")
    del sys.modules["cistern_core"]
    hidden = binary.rename(binary.with_suffix(".hidden"))
    expect_refusal("Python 3.11 (Blender 4.2 to 5.0)")
    refusing = binary.with_name("cistern_core.py")
    refusing.write_text('raise ImportError("cistern_core needs a processor with AVX2")\n')
    expect_refusal("needs a processor with AVX2")
    refusing.unlink()
    hidden.rename(binary)


def step_frames() -> None:
    """An animation under the options of the command line: their values, whole files, frames left out, failed frames."""
    install()
    command_line = sys.modules[f"{MODULE}.command_line"]
    scene, folder = bpy.context.scene, user_directory() / "frames"
    render()
    options = ["--cistern-samples", "3", "--cistern-preset", "ris", "--cistern-seed", "7", "--cistern-threads", "1"]
    more = ["--cistern-noise-threshold", "0.25", "--cistern-resume", "--theirs"]
    command_line.start(["blender", "-a", "--", *options, "--cistern-time-limit", "60", *more])
    scene.frame_start, scene.frame_end = 1, 3
    scene.render.filepath = str(folder / "picture_")
    folder.mkdir()
    (folder / "picture_0002.exr").write_text("exists")
    stale = folder / ".picture_0003.exr.partial"
    stale.mkdir()
    (stale / "picture_0003.exr").write_text("half")
    bpy.ops.render.render(animation=True)
    assert (scene.cistern.samples, scene.cistern.preset, scene.cistern.seed) == (3, "RIS", 7)
    assert scene.cistern.noise_threshold == 0.25
    assert (scene.cistern.time_limit, scene.render.threads_mode, scene.render.threads) == (60, "FIXED", 1)
    names = sorted(file.name for file in folder.iterdir())
    assert names == ["picture_0001.exr", "picture_0002.exr", "picture_0003.exr"], names
    assert (folder / "picture_0002.exr").read_text() == "exists" and (folder / "picture_0003.exr").stat().st_size > 1000
    assert scene.render.filepath == str(folder / "picture_")
    assert command_line.running.exit_status() == 0
    sys.modules["cistern_core"] = None
    (folder / "picture_0001.exr").unlink()
    try:
        bpy.ops.render.render(animation=True)
    except RuntimeError as error:
        assert "native core" in str(error), error
    assert command_line.running.exit_status() == 1
    assert not (folder / "picture_0001.exr").exists()


STEPS = {name.removeprefix("step_"): step for name, step in dict(globals()).items() if name.startswith("step_")}


if __name__ == "__main__":
    STEPS[sys.argv[-1]]()
    print(f"STEP {sys.argv[-1]} passed")
