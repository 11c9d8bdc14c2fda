#include "lights/learned_lights.h"

namespace cistern {
namespace {

/// Share of draws by the light set where there is a row.
constexpr float kBaseShare = 0.25f;

std::vector<EmitterPlace> places(const LightSet& lights) {
  std::vector<EmitterPlace> result(lights.emitter_count());
  for (uint32_t i = 0; i < result.size(); ++i) result[i] = lights.place(i);
  return result;
}

std::vector<float> powers(const LightSet& lights) {
  std::vector<float> result(lights.emitter_count());
  for (uint32_t i = 0; i < result.size(); ++i) result[i] = lights.receiver_free_pmf(i);
  return result;
}

}  // namespace

LearnedLights::LearnedLights(const LightSet& lights, const NestedCells& cells, size_t most_clusters)
    : lights_(lights), cells_(cells), clusters_(places(lights), powers(lights), most_clusters) {}

LearnedLights::Chooser LearnedLights::chooser(Vec3 position, Vec3 normal, uint8_t light_set) const {
  Chooser chooser{position, normal, cells_.key(position, normal)};
  chooser.row = table_.find(chooser.cell);
  chooser.light_set = light_set;
  if (chooser.row) chooser.candidates = chooser.row->candidates;
  return chooser;
}

std::optional<LearnedLights::Choice> LearnedLights::choose(const Chooser& chooser, double u_choice, double u_within,
                                                           Vec2 u_emitter) const {
  if (chooser.row && u_choice >= kBaseShare) {
    const double u_row = (u_choice - kBaseShare) / (1.0 - kBaseShare);
    const LearnedLightTable::Entry& entry = table_.choose(*chooser.row, u_row);
    const uint32_t emitter = clusters_.choose(entry.cluster, u_within);
    const float pmf = (1.0f - kBaseShare) * entry.pmf * clusters_.pmf(emitter);
    return Choice{{emitter, u_emitter}, pmf, entry.visibility};
  }
  const double u_base = chooser.row ? u_choice / kBaseShare : u_choice;
  const auto choice = lights_.choose(chooser.position, chooser.normal, u_base, u_emitter, chooser.light_set);
  if (!choice) return std::nullopt;
  if (!chooser.row) return Choice{choice->sample, choice->pmf};
  if (table_.find(*chooser.row, clusters_.cluster_of(choice->sample.emitter))) return std::nullopt;
  return Choice{choice->sample, kBaseShare * choice->pmf, chooser.row->other_visibility};
}

float LearnedLights::pmf(const Chooser& chooser, uint32_t emitter) const {
  if (!chooser.row) return lights_.pmf(emitter, chooser.position, chooser.normal, chooser.light_set);
  if (const LearnedLightTable::Entry* entry = table_.find(*chooser.row, clusters_.cluster_of(emitter)))
    return (1.0f - kBaseShare) * entry->pmf * clusters_.pmf(emitter);
  return kBaseShare * lights_.pmf(emitter, chooser.position, chooser.normal, chooser.light_set);
}

}  // namespace cistern
