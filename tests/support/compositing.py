"""Compositors that show other scenes."""

from __future__ import annotations

import bpy


def show(scene: bpy.types.Scene, other: bpy.types.Scene, file_folder: str = "") -> None:
    """Lets the compositor of a scene show another one; with a folder, only in files that it writes there."""
    scene.render.use_compositing = True
    if hasattr(scene, "compositing_node_group"):
        tree = bpy.data.node_groups.new("compositing", "CompositorNodeTree")
        scene.compositing_node_group = tree
        if not file_folder:
            tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
            output = tree.nodes.new("NodeGroupOutput")
    else:
        scene.use_nodes = True
        tree = scene.node_tree
        output = next(node for node in tree.nodes if node.type == "COMPOSITE")
        if file_folder:
            tree.nodes.clear()
    layers = tree.nodes.new("CompositorNodeRLayers")
    layers.scene = other
    if file_folder:
        output = tree.nodes.new("CompositorNodeOutputFile")
        if hasattr(output, "directory"):  # since 5.0
            output.directory = file_folder
            output.file_output_items.new("RGBA", "image")
        else:
            output.base_path = file_folder
    tree.links.new(layers.outputs["Image"], output.inputs[0])
