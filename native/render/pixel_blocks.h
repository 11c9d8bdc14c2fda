#pragma once

#include <vector>

namespace cistern {

/// Pixels of the region that are rendered together, as a small picture of their own: a band of rows, or blocks from all
/// over the region beside each other.
struct PixelBlocks {
  struct Pixel {
    int x, y;
  };

  int block_width, block_height;
  int columns = 1;            // blocks beside each other
  std::vector<Pixel> places;  // of the lowest pixel of each block in the region; whole rows of blocks

  int width() const { return columns * block_width; }
  int height() const { return static_cast<int>(places.size()) / columns * block_height; }
  size_t size() const { return static_cast<size_t>(width()) * static_cast<size_t>(height()); }

  /// Where in the region a pixel of the small picture lies.
  Pixel place(int x, int y) const {
    if (places.size() == 1) return {places.front().x + x, places.front().y + y};
    const auto row = static_cast<size_t>(y / block_height), column = static_cast<size_t>(x / block_width);
    const Pixel& block = places[row * static_cast<size_t>(columns) + column];
    return {block.x + x % block_width, block.y + y % block_height};
  }

  /// Rows [begin, end) of a region.
  static PixelBlocks band(int width, int begin, int end) { return {width, end - begin, 1, {{0, begin}}}; }
};

}  // namespace cistern
