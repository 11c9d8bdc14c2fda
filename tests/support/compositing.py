"""Compositors that show other scenes."""

from __future__ import annotations

import bpy


def show(scene: bpy.types.Scene, other: bpy.types.Scene, file_folder: str = "", output: str = "Image") -> None:
    """Lets the compositor of a scene show an output of another; with a folder, only in files that it writes there."""
    scene.render.use_compositing = True
    if hasattr(scene, "compositing_node_group"):
        tree = bpy.data.node_groups.new("compositing", "CompositorNodeTree")
        scene.compositing_node_group = tree
        if not file_folder:
            tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
            shown = tree.nodes.new("NodeGroupOutput")
    else:
        scene.use_nodes = True
        tree = scene.node_tree
        shown = next(node for node in tree.nodes if node.type == "COMPOSITE")
        if file_folder:
            tree.nodes.clear()
    layers = tree.nodes.new("CompositorNodeRLayers")
    layers.scene = other
    if file_folder:
        shown = tree.nodes.new("CompositorNodeOutputFile")
        if hasattr(shown, "directory"):  # since 5.0
            shown.directory = file_folder
            shown.file_output_items.new("RGBA", "image")
        else:
            shown.base_path = file_folder
    tree.links.new(layers.outputs[output], shown.inputs[0])
