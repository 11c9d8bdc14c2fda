#include "render/cell_layout.h"

namespace cistern {

GridLayout cell_layout(const FrameContext& context, uint32_t frame) {
  return cell_layout(context, context.settings.grid, frame);
}

GridLayout shown_cell_layout(const FrameContext& context) {
  const Settings& s = context.settings;
  GridSettings grid = s.grid;
  if (s.indirect == IndirectAnswer::CELL_SHARED) {
    grid.cell_pixels = s.path_sharing.visible.pixels;
    grid.min_cell_size = s.path_sharing.visible.smallest;
  }
  grid.randomised = false;
  return cell_layout(context, grid, 0);
}

GridLayout cell_layout(const FrameContext& context, GridSettings grid, uint32_t frame) {
  const Bounds3 bounds = context.paths.accel.bounds();
  const float share = grid.min_cell_size;  // of the scene's diagonal
  grid.min_cell_size = default_min_cell_size(bounds.lower, bounds.upper) * (share / kDefaultMinCellShare);
  const PixelFootprint pixel = context.paths.pixel;
  const GridCamera camera{context.paths.scene.camera.camera_to_world.translation, pixel.angle, pixel.size};
  return make_grid_layout(grid, camera, context.settings.seed, frame);
}

}  // namespace cistern
