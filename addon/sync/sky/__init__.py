"""What the Sky Texture node shows: models of the atmosphere, as tables of radiance and a disc for the sun.

A table is (rows, columns, 3), CIE XYZ of one unit of the node's colour, for a sun over the middle column: column c is
seen at the azimuth 2 pi (c + 1/2) / columns from the side that lies opposite, row r at the elevation pi / 2 * s |s|
with s = 2 (r + 1/2) / rows - 1, so that rows are dense where the sky changes fast: at the horizon. Row 0 looks down.
It is drawn by ENVIRONMENT_IMAGE (native/scene/op_table.cpp).

Nothing here knows Blender; `addon/sync/nodes/sky.py` reads the node.
"""
