#pragma once

#include "lights/emitter_clusters.h"
#include "lights/learned_light_table.h"

namespace cistern {

/// Chooses emitters by what lights brought to the points around in earlier frames. Around each point the clusters that
/// matter have probabilities of their own; every other emitter keeps the chance that the light set gives it, in a
/// quarter of the draws. So whatever the table holds, each emitter that can light a point can be drawn, and an estimate
/// that divides by `pmf` is unbiased.
class LearnedLights {
 public:
  LearnedLights(const LightSet& lights, const NestedCells& cells,
                size_t most_clusters = EmitterClusters::kMostClusters);

  /// A table for the frames that follow; must not be learned from samples that it will weigh.
  void set_table(LearnedLightTable table) { table_ = std::move(table); }

  /// How lights are chosen for a receiver. `normal` as for LightSet::choose.
  struct Chooser {
    Vec3 position, normal;
    NestedCellKey cell = kNoNestedCell;
    const LearnedLightTable::Row* row = nullptr;  // null: as the light set does
    int candidates = 1;                           // light samples to take
    uint8_t light_set = kEveryLight;              // of the receiver
  };
  Chooser chooser(Vec3 position, Vec3 normal, uint8_t light_set = kEveryLight) const;

  /// As LightSet::choose; `u_within` decides between emitters of a cluster. Empty, too, where the draw from the light
  /// set falls on an emitter that has a probability of its own: probabilities then sum to less than one.
  struct Choice {
    LightSample sample;
    float pmf;
    float visibility = 1.0f;  // part of the emitter's light that seems to arrive here, above 0: for guesses only
  };
  std::optional<Choice> choose(const Chooser& chooser, double u_choice, double u_within, Vec2 u_emitter) const;
  float pmf(const Chooser& chooser, uint32_t emitter) const;

  const EmitterClusters& clusters() const { return clusters_; }
  const LearnedLightTable& table() const { return table_; }
  size_t memory_bytes() const { return clusters_.memory_bytes() + table_.memory_bytes(); }

 private:
  const LightSet& lights_;
  NestedCells cells_;
  EmitterClusters clusters_;
  LearnedLightTable table_;
};

}  // namespace cistern
