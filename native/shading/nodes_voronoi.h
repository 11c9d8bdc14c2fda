#pragma once

#include "base/vec.h"

namespace cistern {

enum class VoronoiMetric : uint8_t { EUCLIDEAN, MANHATTAN, CHEBYCHEV, MINKOWSKI };
enum class VoronoiFeature : uint8_t { F1, F2, SMOOTH_F1, DISTANCE_TO_EDGE, N_SPHERE_RADIUS };

struct VoronoiSettings {
  VoronoiFeature feature = VoronoiFeature::F1;
  VoronoiMetric metric = VoronoiMetric::EUCLIDEAN;
  float detail = 0.0f;      // octaves - 1, fractions blend the last one in; not of N_SPHERE_RADIUS
  float roughness = 0.5f;   // [0, 1], amplitude ratio of octaves; without any there is one octave
  float lacunarity = 2.0f;  // frequency ratio of octaves
  float smoothness = 1.0f;  // [0, 1], of SMOOTH_F1
  float exponent = 0.5f;    // of MINKOWSKI
  float randomness = 1.0f;  // [0, 1]: 0 is a regular grid
  bool normalize = false;   // distances by the largest that there can be; not of N_SPHERE_RADIUS
  bool old_cells = false;   // from two dimensions on, where Cycles before 5.0 has them
};

struct VoronoiResult {
  float distance = 0.0f;  // for the last two features the only member set
  Vec3 color;
  Vec3 position;  // in scaled coordinates
  float w = 0.0f;
};

/// Blender's Voronoi Texture in 1 (w), 2 (x, y), 3 or 4 dimensions, coordinates already scaled.
VoronoiResult voronoi_node(Vec3 p, float w, int dimensions, const VoronoiSettings& settings);

}  // namespace cistern
