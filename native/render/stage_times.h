#pragma once

#include <ctime>
#include <string>
#include <utility>
#include <vector>

namespace cistern {

/// CPU seconds by stage, in the order in which stages first ended. They are those of the whole process: what else runs
/// in it meanwhile counts as well.
class StageTimes {
 public:
  void start() { lap_ = std::clock(); }
  /// What was spent since the last start or lap goes to a stage.
  void lap(const char* stage) {
    const std::clock_t now = std::clock();
    double& seconds = entry(stage);
    seconds += static_cast<double>(now - lap_) / CLOCKS_PER_SEC;
    lap_ = now;
  }
  const std::vector<std::pair<std::string, double>>& seconds() const { return seconds_; }

 private:
  double& entry(const char* stage) {
    for (auto& [name, seconds] : seconds_)
      if (name == stage) return seconds;
    return seconds_.emplace_back(stage, 0.0).second;
  }

  std::clock_t lap_ = 0;
  std::vector<std::pair<std::string, double>> seconds_;
};

}  // namespace cistern
