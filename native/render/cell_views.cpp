#include "render/cell_views.h"

#include <algorithm>
#include <array>

#include "grid/hash_grid.h"
#include "render/cell_layout.h"

namespace cistern {
namespace {

CellKey cache_key(const LightCacheCells& cells, const VisiblePoint& visible, bool with_normals) {
  const LightCacheKey key = cells.key_of(visible.receiver.position, visible.ng);
  if (key == kNoLightCacheKey) return kNoCell;
  return with_normals ? key : key / LightCacheCells::kNormalBins;
}

/// Keys of cells that are not divided by normal all have the same bin.
uint64_t bin_of(CellKey key) { return static_cast<uint64_t>(key_normal_bin(key)); }
uint64_t cache_bin(CellKey key, const Settings& s) {
  return s.grid.use_normals ? key % LightCacheCells::kNormalBins : 0;
}

}  // namespace

bool show_cells(const FrameContext& context, const LightCacheCells* cache_cells, Film& film,
                const StopCondition& stop) {
  constexpr std::array kViews{Pass::CELLS, Pass::CELL_OCCUPANCY, Pass::CELL_LEVEL, Pass::NORMAL_BIN};
  if (std::ranges::none_of(kViews, [&](Pass pass) { return film.has(pass); })) return true;
  const Settings& s = context.settings;
  const GridLayout layout = shown_cell_layout(context);
  std::vector<CellKey> keys(static_cast<size_t>(film.width()) * static_cast<size_t>(film.height()), kNoCell);
  const auto pixel_of = [&](int x, int y) { return static_cast<uint32_t>(y * film.width() + x); };
  const auto find_key = [&](int x, int y, PathScratch& scratch) {
    PathCapture capture;
    trace_pixel(context, x, y, 0, scratch, &capture);
    const VisiblePoint& visible = capture.visible;
    if (!visible.exists) return;
    keys[pixel_of(x, y)] = cache_cells ? cache_key(*cache_cells, visible, s.grid.use_normals)
                                       : cell_key(layout, visible.receiver.position, visible.receiver.n);
  };
  const auto nothing = [](const PathScratch&) {};
  if (!for_each_pixel<PathScratch>(film.width(), film.height(), stop, find_key, nothing)) return false;
  HashGrid grid;
  if (film.has(Pass::CELL_OCCUPANCY)) grid.build(keys);
  return for_each_pixel<PathScratch>(
      film.width(), film.height(), stop,
      [&](int x, int y, PathScratch&) {
        const CellKey key = keys[pixel_of(x, y)];
        film.show(Pass::CELLS, pixel_of(x, y), cell_color(key));
        film.show(Pass::CELL_OCCUPANCY, pixel_of(x, y), Rgb(static_cast<float>(grid.find(key).size())));
        if (key == kNoCell) return;
        film.show(Pass::CELL_LEVEL, pixel_of(x, y),
                  Rgb(cache_cells ? 1.0f : 1.0f + static_cast<float>(key_level(key))));
        film.show(Pass::NORMAL_BIN, pixel_of(x, y), cell_color(cache_cells ? cache_bin(key, s) : bin_of(key)));
      },
      nothing);
}

}  // namespace cistern
