"""Panels: ours are registered, Blender's general ones appear, other engines' do not."""

from functools import partial
from types import SimpleNamespace

import bpy
import pytest

from addon import techniques, ui, ui_bake, ui_data, ui_sampling, ui_shading, ui_subdivision, ui_viewport
from tests.blender.drawn_panels import RecordingLayout, draw, editor
from tests.blender.engine_fakes import fresh_scene, store_choice

pytestmark = pytest.mark.usefixtures("registered_addon")


def open_to_us(name):
    panel = getattr(bpy.types, name, None)
    return panel is not None and ui.ENGINE in getattr(panel, "COMPAT_ENGINES", ())


@pytest.mark.parametrize(
    "name",
    [
        "RENDER_PT_format",
        "RENDER_PT_output",
        "RENDER_PT_color_management",
        "DATA_PT_lens",
        "DATA_PT_camera",
        "DATA_PT_camera_dof",
        "DATA_PT_camera_dof_aperture",
        "EEVEE_MATERIAL_PT_context_material",
        "WORLD_PT_context_world",
        "DATA_PT_context_light",
        "DATA_PT_uv_texture",
        "VIEWLAYER_PT_layer",
        "PARTICLE_PT_render",
        "VIEWLAYER_PT_freestyle",
    ],
)
def test_general_panels_appear(name):
    assert open_to_us(name)


def test_panels_of_other_engines_do_not():
    for name in dir(bpy.types):
        if name.startswith(("CYCLES_", "RENDER_PT_eevee", "RENDER_PT_opengl", "DATA_PT_EEVEE")):
            assert not open_to_us(name), name
    assert not open_to_us("DATA_PT_light")


def _place(panel):
    return panel.bl_space_type, panel.bl_region_type, getattr(panel, "bl_context", "")


def test_our_panels_are_registered_under_their_parents():
    for cls in ui.CLASSES:
        assert getattr(bpy.types, cls.__name__) is cls
        parent = getattr(cls, "bl_parent_id", None)
        assert parent is None or _place(getattr(bpy.types, parent)) == _place(cls)


def test_unregistering_gives_the_panels_back():
    ui.unregister()
    try:
        assert not any(ui.ENGINE in getattr(panel, "COMPAT_ENGINES", ()) for panel in bpy.types.Panel.__subclasses__())
    finally:
        ui.register()


def test_render_and_view_layer_panels_draw_every_setting():
    scene = fresh_scene()
    scene.cistern.preset = "CUSTOM"
    drawn = []
    for direct, indirect in (
        ("RESTIR_CACHE", "SCREEN_REUSE"),
        ("RESTIR_CACHE", "WORLD_REUSE"),
        ("NEE", "CELL_SHARED"),
    ):
        scene.cistern.direct, scene.cistern.indirect = direct, indirect
        for cls in ui.CLASSES:
            if getattr(cls, "bl_context", "") in {"render", "view_layer"}:
                drawn += draw(cls, scene=scene, view_layer=scene.view_layers[0])
    for owner in (scene.cistern, scene.view_layers[0].cistern):
        names = {prop.identifier for prop in owner.bl_rna.properties} - {"name", "rna_type"}
        assert names - {"preset"} <= set(drawn)
    assert "cistern.choose_preset" in drawn


@pytest.mark.parametrize(("width", "ui_scale", "lines"), [(300, 1.0, 3), (600, 2.0, 3), (600, 1.0, 2), (50, 1.0, 7)])
def test_sentences_are_broken_to_the_width_of_the_editor(width, ui_scale, lines):
    drawn = []
    ui_sampling.draw_sentence(RecordingLayout(drawn), 20 * "light ", editor(width, ui_scale))
    assert len(drawn) == lines


@pytest.mark.parametrize("preset", [identifier for identifier, *_ in techniques.PRESET_ITEMS])
def test_techniques_are_menus_under_custom_and_read_out_under_a_preset(preset):
    scene = fresh_scene()
    scene.cistern.preset = preset
    drawn = draw(ui_sampling.CISTERN_RENDER_PT_techniques, scene=scene)
    assert (set(techniques.TECHNIQUES) <= set(drawn)) == (preset == "CUSTOM")
    in_force = techniques.settings_in_force(scene.cistern)
    labels = " ".join(entry.removeprefix("label ") for entry in drawn)
    for name, title, items in ui_sampling.QUESTIONS:
        answer, sentence = ui_sampling.item_texts(items, in_force[name])
        assert (f"label {title}: {answer}" in drawn) == (preset != "CUSTOM")
        assert (sentence in labels) == (name in ui_sampling.SENTENCES)


@pytest.mark.parametrize(
    ("question", "answer", "count"),
    [
        ("direct", "NEE", 2),
        ("direct", "LEARNED", 1),
        ("direct", "RIS", 1),
        ("direct", "RESTIR", 8),
        ("direct", "RESTIR_CACHE", 11),
        ("secondary", "RIS", 2),
        ("secondary", "CELL_RESERVOIRS", 3),
        ("indirect", "SCREEN_REUSE", 8),
        ("indirect", "WORLD_REUSE", 5),
        ("indirect", "CELL_SHARED", 8),
    ],
)
def test_advanced_shows_what_the_system_uses(question, answer, count):
    scene = fresh_scene()
    scene.cistern.preset = "PATH_TRACING"
    setattr(scene.cistern, question, answer)
    panel = ui_sampling.CISTERN_RENDER_PT_techniques_advanced
    assert panel.poll(SimpleNamespace(engine=ui.ENGINE, scene=scene)) == (count > 0)
    names = [entry for entry in draw(panel, scene=scene) if not entry.startswith(("label ", "icon "))]
    assert len(names) == count and set(names) <= {parameter.name for parameter in techniques.PARAMETERS}


def test_advanced_has_the_reuse_of_paths_where_paths_are_reused():
    scene = fresh_scene()
    panel = ui_sampling.CISTERN_RENDER_PT_techniques_advanced
    scene.cistern.direct = "RESTIR"
    assert "use_path_spatial_reuse" not in draw(panel, scene=scene)
    for answer in ("SCREEN_REUSE", "WORLD_REUSE"):
        scene.cistern.indirect = answer
        drawn = draw(panel, scene=scene)
        assert drawn.count("use_path_spatial_reuse") == drawn.count("use_temporal_reuse") == 1


def test_advanced_says_what_zero_stands_for():
    scene = fresh_scene()
    panel = ui_sampling.CISTERN_RENDER_PT_techniques_advanced
    scene.cistern.direct = "RESTIR"
    assert draw(panel, scene=scene)[:2] == ["light_candidates", "label = 32"]
    scene.cistern.light_candidates = 12
    assert draw(panel, scene=scene)[1] != "label = 32"
    assert "label = 1" in draw(panel, scene=scene)  # rounds
    scene.cistern.bias = "FAST"
    assert "label = 2" in draw(panel, scene=scene)
    scene.cistern.direct = "RESTIR_CACHE"
    assert {"label = 10", "label = 8", "label = 5", "label = 4", "label = 1024"} <= set(draw(panel, scene=scene))


def drawn_after(switch, scene):
    """What the panel Advanced draws after it."""
    drawn = draw(ui_sampling.CISTERN_RENDER_PT_techniques_advanced, scene=scene)
    return drawn[drawn.index(switch) + 1]


def test_advanced_says_what_denoising_asks_for():
    scene = fresh_scene()
    shown = partial(drawn_after, "use_share_for_denoiser", scene)
    assert shown() == "icon CHECKBOX_DEHLT"
    scene.cistern.use_denoising = True
    assert shown() == "icon CHECKBOX_HLT"
    scene.cistern.view = "CELLS"  # which are not denoised
    assert shown() == "icon CHECKBOX_DEHLT"


def test_switches_show_what_the_preset_says_and_change_it():
    scene = fresh_scene()
    guide = partial(drawn_after, "use_caustic_guide", scene)
    assert guide() == "icon CHECKBOX_HLT" and not scene.cistern.use_caustic_guide  # Final's, and its own default
    assert not techniques.is_changed(scene.cistern)
    assert bpy.ops.cistern.change_switch(switch="use_caustic_guide") == {"FINISHED"}
    assert not guide().startswith("icon")  # from now on its own
    assert techniques.settings_in_force(scene.cistern)["use_caustic_guide"] is False
    assert techniques.is_changed(scene.cistern)
    bpy.ops.cistern.choose_preset(preset="FINAL")
    assert guide() == "icon CHECKBOX_HLT" and not techniques.is_changed(scene.cistern)


@pytest.mark.parametrize(("preset", "is_active"), [("FINAL", False), ("WORLD_PATHS", True)])
def test_cells_are_grey_where_they_do_nothing(preset, is_active):
    scene = fresh_scene()
    scene.cistern.preset = preset
    layout = RecordingLayout([])
    ui_sampling.CISTERN_RENDER_PT_cells.draw(SimpleNamespace(layout=layout), editor(300, scene=scene))
    assert layout.active is is_active


@pytest.mark.parametrize("kind", ["POINT", "SPOT", "SUN", "AREA"])
def test_light_panels_draw_what_the_light_has(kind):
    light = bpy.data.lights.new("Lamp", kind)
    drawn = draw(ui_data.CISTERN_LIGHT_PT_light, light=light)
    assert {"color", "energy"} <= set(drawn)
    assert ("shadow_soft_size" in drawn) == (kind in {"POINT", "SPOT"})
    if kind in {"SPOT", "AREA"}:
        assert draw(ui_data.CISTERN_LIGHT_PT_beam_shape, light=light)
    portal = ["is_portal"] if kind == "AREA" else []
    settings = ["max_bounces", "use_multiple_importance_sampling", *portal]
    assert draw(ui_data.CISTERN_LIGHT_PT_settings, light=light) == settings
    light.use_nodes = True
    assert "socket Surface" in draw(ui_data.CISTERN_LIGHT_PT_nodes, light=light)


def test_material_world_and_object_panels_draw():
    scene = fresh_scene()
    cube = scene.objects["Cube"]
    assert draw(ui_shading.CISTERN_MATERIAL_PT_surface, material=cube.active_material) == ["socket Surface"]
    assert draw(ui_shading.CISTERN_WORLD_PT_surface, world=scene.world) == ["socket Surface"]
    assert draw(ui_shading.CISTERN_WORLD_PT_ambient_occlusion, world=scene.world) == ["distance"]
    assert {"is_holdout", "is_shadow_catcher"} <= set(draw(ui_data.CISTERN_OBJECT_PT_visibility, object=cube))
    drawn = draw(ui_data.CISTERN_OBJECT_PT_ray_visibility, object=cube)
    assert {"visible_shadow", "visible_volume_scatter"} <= set(drawn)


@pytest.mark.parametrize("kind", ["volume", "instancer", "empty", "lamp"])
def test_what_rays_may_see_has_switches_for_them(kind):
    scene = fresh_scene()
    data = {"volume": lambda: bpy.data.volumes.new("smoke"), "lamp": lambda: bpy.data.lights.new("lamp", "POINT")}
    obj = bpy.data.objects.new(kind, data[kind]() if kind in data else None)
    if kind == "instancer":
        obj.instance_type, obj.instance_collection = "COLLECTION", scene.collection.children[0]
    assert ui_data.CISTERN_OBJECT_PT_ray_visibility.poll(editor(300, object=obj)) == (kind != "empty")
    has_mask = "is_holdout" in draw(ui_data.CISTERN_OBJECT_PT_visibility, object=obj)
    assert has_mask == (kind in {"volume", "instancer"})


def test_every_panel_is_registered():
    modules = (ui, ui_sampling, ui_subdivision, ui_viewport, ui_bake, ui_shading, ui_data)
    defined = {
        cls
        for module in modules
        for cls in vars(module).values()
        if isinstance(cls, type) and issubclass(cls, bpy.types.Panel) and hasattr(cls, "bl_label")
    }
    of_blender = set(ui_data.LINKING_PANELS)  # in some versions
    assert defined - of_blender <= set(ui.CLASSES)


def test_view_layers_have_a_filter():
    scene = fresh_scene()
    drawn = draw(ui.CISTERN_VIEWLAYER_PT_filter, scene=scene, view_layer=scene.view_layers[0])
    blur = ["use_motion_blur"] if "use_motion_blur" in bpy.types.ViewLayer.bl_rna.properties else []
    pencil = ["use_grease_pencil"] if "use_grease_pencil" in bpy.types.ViewLayer.bl_rna.properties else []
    assert drawn == ["use_sky", "use_solid", "use_strand", "use_volumes", *pencil, *blur, "use_denoising"]


def test_materials_have_panels_of_all_sockets_and_of_settings():
    material = fresh_scene().objects["Cube"].active_material
    for socket in ("volume", "displacement"):
        panel = getattr(ui_shading, f"CISTERN_MATERIAL_PT_{socket}")
        assert panel.poll(editor(300, material=material))
        assert draw(panel, material=material) == [f"socket {socket.capitalize()}"]
    for panel in (ui_shading.CISTERN_MATERIAL_PT_settings, ui_shading.CISTERN_NODE_MATERIAL_PT_settings):
        assert panel.poll(editor(300, material=material)) and not panel.poll(editor(300, material=None))
        drawn = draw(panel, material=material)
        assert drawn == ["pass_index", "displacement_method", "use_transparent_shadow", "use_bump_map_correction"]


def test_worlds_have_panels_of_volumes_visibility_and_sampling():
    world = fresh_scene().world
    assert draw(ui_shading.CISTERN_WORLD_PT_volume, world=world) == ["socket Volume"]
    assert draw(ui_shading.CISTERN_WORLD_PT_mist, world=world) == ["start", "depth", "falloff"]
    visibility, settings = ui_shading.CISTERN_WORLD_PT_ray_visibility, ui_shading.CISTERN_WORLD_PT_settings
    assert draw(visibility, world=world) == ["camera", "diffuse", "glossy", "transmission", "scatter"]
    assert draw(settings, world=world) == ["sampling_method", "sample_map_resolution"]
    for panel in (visibility, settings):
        assert panel.poll(editor(300, world=world)) and not panel.poll(editor(300, world=None))


@pytest.mark.parametrize("kind", bpy.types.Camera.bl_rna.properties["panorama_type"].enum_items.keys())
def test_panoramic_cameras_have_a_panel(kind):
    """With what Blender's own shows with Cycles alone."""
    camera = bpy.data.cameras.new("Panorama")
    assert not ui_data.CISTERN_CAMERA_PT_panorama.poll(editor(300, camera=camera))
    camera.type, camera.panorama_type = "PANO", kind
    assert ui_data.CISTERN_CAMERA_PT_panorama.poll(editor(300, camera=camera))
    drawn = []
    lens = SimpleNamespace(layout=RecordingLayout(drawn))
    bpy.types.DATA_PT_lens.draw(lens, SimpleNamespace(engine="CYCLES", camera=camera))
    of_lens = drawn[: drawn.index("shift_x")]  # what all cameras have follows
    assert of_lens == ["type", *draw(ui_data.CISTERN_CAMERA_PT_panorama, camera=camera)]


def test_without_nodes_materials_have_a_colour():
    material = bpy.data.materials.new("plain")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True  # which leaves a tree
        material.use_nodes = False
        assert draw(ui_shading.CISTERN_MATERIAL_PT_surface, material=material) == ["use_nodes", "diffuse_color"]
    for panel in (ui_shading.CISTERN_MATERIAL_PT_volume, ui_shading.CISTERN_MATERIAL_PT_displacement):
        assert panel.poll(editor(300, material=material)) == (bpy.app.version >= (5, 0, 0))
    material.use_nodes = True
    material.node_tree.nodes.clear()
    assert draw(ui_shading.CISTERN_MATERIAL_PT_surface, material=material) == ["label No output node"]


def test_objects_have_a_panel_of_motion_blur():
    scene = fresh_scene()
    panel, camera = ui_data.CISTERN_OBJECT_PT_motion_blur, scene.camera
    assert draw(panel, object=scene.objects["Cube"], scene=scene) == ["motion_steps", "use_deform_motion"]
    assert draw(panel, object=camera, scene=scene) == ["motion_steps"]
    assert panel.poll(editor(300, object=camera))
    assert not panel.poll(editor(300, object=scene.objects["Light"]))
    assert not panel.poll(editor(300, object=None))


@pytest.mark.parametrize("role", ["receiver", "blocker"])
def test_linking_panels_draw_the_collection(role):
    cube, name = fresh_scene().objects["Cube"], f"{role}_collection"
    panel = ui_data.LINKING_PANELS[role == "blocker"]
    operators = [f"object.light_linking_{role}_collection_new", f"object.light_linking_{role}s_link"]
    operators += ["object.light_linking_unlink_from_collection", f"object.light_linking_{role}s_select"]
    assert draw(panel, object=cube) == [name, operators[0]]
    setattr(cube.light_linking, name, bpy.data.collections.new("linked"))
    assert draw(panel, object=cube) == [name, operators[0], name, *operators[1:]]
    known = {f"object.{identifier}" for identifier in dir(bpy.ops.object)}
    assert set(operators) <= known


def test_light_linking_has_one_place():
    """In Blender 4.2 panels of ours, later Blender's own."""
    blenders = [panel for panel in ui.shared_panels() if panel.__name__ == "OBJECT_PT_shading"]
    ours = [panel for panel in ui.CLASSES if panel in ui_data.LINKING_PANELS]
    assert (len(blenders), len(ours)) == ((1, 0) if bpy.app.version >= (4, 3, 0) else (0, 2))


@pytest.mark.parametrize(
    ("shading", "engine", "is_drawn"), [("RENDERED", ui.ENGINE, True), ("SOLID", ui.ENGINE, False)]
)
def test_the_header_of_a_viewport_has_pause_and_views_while_it_renders(shading, engine, is_drawn):
    drawn = []
    space = SimpleNamespace(shading=SimpleNamespace(type=shading))
    header = SimpleNamespace(layout=RecordingLayout(drawn))
    ui_viewport.draw_header(header, SimpleNamespace(engine=engine, scene=fresh_scene(), space_data=space))
    assert drawn == (["viewport_pause", "viewport_view"] if is_drawn else [])


def test_light_groups_have_panels_of_objects_and_worlds():
    scene = fresh_scene()
    layer, lamp = scene.view_layers[0], bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    world = bpy.data.worlds.new("World")
    for cls, owner in (
        (ui_data.CISTERN_OBJECT_PT_light_group, {"object": lamp}),
        (ui_shading.CISTERN_WORLD_PT_light_group, {"world": world}),
    ):
        context = {**owner, "view_layer": layer}
        assert cls.poll(editor(300, **context))
        assert draw(cls, **context) == ["lightgroup", "scene.view_layer_add_lightgroup"]
    assert ui_data.CISTERN_OBJECT_PT_light_group.poll(editor(300, object=bpy.data.objects.new("Empty", None)))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    assert not ui_data.CISTERN_OBJECT_PT_light_group.poll(editor(300, object=camera))


def test_light_groups_of_the_view_layer_have_a_panel():
    drawn = draw(ui.CISTERN_VIEWLAYER_PT_passes_lightgroups, view_layer=fresh_scene().view_layers[0])
    assert {"lightgroups", "scene.view_layer_add_lightgroup", "scene.view_layer_remove_lightgroup"} <= set(drawn)


def test_adaptive_subdivision_has_panels():
    scene = fresh_scene()
    cube, panel = scene.objects["Cube"], ui_subdivision.CISTERN_MODIFIER_PT_subdivision
    drawn = draw(ui_subdivision.CISTERN_RENDER_PT_subdivision, scene=scene)
    assert drawn[-1] == "dicing_camera" and "offscreen_dicing_scale" in drawn
    assert not panel.poll(editor(300, object=cube, scene=scene))
    modifier = cube.modifiers.new("Subdivision", "SUBSURF")
    assert panel.poll(editor(300, object=cube, scene=scene))
    header = []
    panel.draw_header(SimpleNamespace(layout=RecordingLayout(header)), editor(300, object=cube))
    assert header == ["use_adaptive_subdivision"]
    if bpy.app.version < (5, 0, 0):
        assert draw(panel, object=cube, scene=scene) == ["dicing_rate", "feature_set"]
        return
    assert draw(panel, object=cube, scene=scene) == ["adaptive_space", "adaptive_pixel_size"]
    modifier.adaptive_space = "OBJECT"
    assert draw(panel, object=cube, scene=scene) == ["adaptive_space", "adaptive_object_edge_length"]
    cube.modifiers.new("Bevel", "BEVEL")
    assert not panel.poll(editor(300, object=cube, scene=scene))


MENUS = {"preset": "cistern.choose_preset", "direct": "direct", "view": "view", "bake_type": "bake_type"}


@pytest.mark.parametrize("name", MENUS)
def test_panels_draw_choices_of_other_versions(name):
    """Which the menus are there to replace."""
    scene = fresh_scene()
    if name == "direct":
        scene.cistern.preset = "CUSTOM"
    store_choice(scene, name, 77)
    assert getattr(scene.cistern, name) == ""
    drawn = []
    for cls in ui.CLASSES:
        if getattr(cls, "bl_context", "") == "render" and cls.poll(editor(300, scene=scene)):
            drawn += draw(cls, scene=scene)
    assert MENUS[name] in drawn


def test_panels_of_others_may_list_their_engines_in_any_way():
    class Foreign(bpy.types.Panel):
        bl_idname, bl_label, bl_space_type, bl_region_type = "TEST_PT_foreign", "Foreign", "PROPERTIES", "WINDOW"
        COMPAT_ENGINES = ("BLENDER_RENDER", "OTHER")

        def draw(self, context):
            pass

    try:
        assert Foreign not in ui.shared_panels()
    finally:
        del Foreign.COMPAT_ENGINES  # else Cycles cannot be enabled any more
