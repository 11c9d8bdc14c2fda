#include "render/sharing_trial.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/hash.h"
#include "render/banded_frame.h"
#include "render/frame_trial.h"

namespace cistern {
namespace {

/// Each made with and without: of the same random numbers, so that noise that both have decides nothing. (Of four, rare
/// light goes unseen: where a market gained by half, boxes of typical noise showed a loss of 0.7 as in scenes that
/// lose.)
constexpr uint32_t kFrames = 8;
constexpr uint64_t kTrialSeed = 0x747269616c;
/// Pixels on a side. A block has fewer groups than a cell of the picture, so that some pixels of its boxes have light
/// from the same one: here they have more noise when shared than in the picture, which `kTypically` makes up for.
constexpr int kBox = 4;

/// Samples that are shared take so many times as long as plain ones where sharing does not pay (outdoors, in a glossy
/// hall and a bedroom 1.7 to 2.0; with next vertices alone 1.3 to 1.5). Where it does it is 1.4 to 1.9, and 1.3 to 1.6
/// (eight scenes of the scoreboard).
constexpr double kCost = 1.85, kCostOfNextVertices = 1.45;

/// Standard errors by which a way must be better to count as such. Ways that do less have to prove that it is enough:
/// rare light is what few frames do not show, and then neither way is surely better.
constexpr double kSure = 1.0;

/// A sure difference may be that of few places, so boxes of typical noise must show one as well: they must have so much
/// less of it. (Three seeds each at 14,400 pixels with 32 samples, at 57,600 with 20 and with 64: noise of sharing over
/// that of paths alone, costs counted, and standard errors by which paths are better. Where sharing loses: glossy hall
/// 1.31 to 1.74 and 1.8 to 3.8, bedroom 1.22 to 1.58 and 0.3 to 4.2, outdoors 1.74 to 1.98 and 2.6 to 9.6. Where it
/// gains: City Grid 1.01 to 1.43, and below 1.2 but for three, which have 1.21 and 2.21, 1.26 and -0.8, 1.43 and 0.95.)
constexpr double kTypically = 0.775, kTypicallyOfNextVertices = 0.9;
/// And so much less that nothing else is asked, since one firefly in the trial makes every difference unsure. (57,600
/// pixels, 64 samples, five seeds, noise of paths over that of sharing, costs counted: outdoors 0.51 to 0.57, glossy
/// hall 0.61, unsure, to 0.75, City Grid 0.83 to 0.97, bright interior and market from 1.27 on.)
constexpr double kFarLess = 0.65;

/// Of a plain sample that asks two lights, over one that asks one. (City Grid 1.19, bright interior 1.07, glossy hall
/// and outdoors about 1.12; in the first two it lowers variance to 0.68 and 0.79, in the others not.)
constexpr double kCostOfMoreLights = 1.12;

/// Relative variance of a plain sample from which on guides are tried: where light is rare. A trial costs samples that
/// depend on one another less well, which weighs most where there is little noise. (Five scenes whose error x time
/// guides lower by 1.1 to 2: 2.7 to 15; Cornell box 0.4, bright interior 0.5, where a trial loses a quarter.)
constexpr double kRareLight = 2.0;

/// The same below which noise is even, for a denoiser. (In its boxes 5 to 10 in the market and 9 to 13 in Sponza; 1.9
/// in City Grid, 0.4 to 1.7 in the Cornell box and the bright interior.)
constexpr double kEvenNoise = 4.0;

/// And from which on it is shared whatever was seen, for a trial sees too little of it. (In boxes of denoisers 36 to 72
/// in both doors and with a far lamp, 5 to 13 in five others.)
constexpr double kTooRare = 20.0;
/// For a denoiser groups are then large and from far apart: there is no even noise to take out, and it fills the gaps.
/// (Cells so much wider, 57,600 pixels, 14 samples, three seeds, relMSE denoised: 0.73 with a far lamp and in Veach's
/// door, 0.91 in the door ajar; per pixel 1.27, 1.14 and 1.21. In Sponza and the market 0.97 and 1.06.)
constexpr float kWider = 4.0f;

/// Of the time of the picture's samples, at most about; the second where so little time would not decide.
constexpr double kTimeShare = 0.03, kMostTimeShare = 0.15;
/// Samples of long renders count no more than so many: a time limit may come first.
constexpr int kMostSamples = 256;
/// With fewer, chance decides; more know no better.
constexpr double kLeastPixels = 2048, kMostPixels = 1 << 16;

int block_side(int pixels) { return std::min(pixels, 16); }

double pixel_budget(const Settings& s) {
  const double pixels = static_cast<double>(s.region.width) * s.region.height;
  const double all = pixels * std::min(s.samples, kMostSamples) / (kFrames * (1.0 + kCost));
  return std::min({pixels, kMostPixels, std::max(kTimeShare * all, std::min(kLeastPixels, kMostTimeShare * all))});
}

/// Blocks at even distances.
PixelBlocks blocks_of(const Settings& s) {
  const int width = s.region.width, height = s.region.height;
  PixelBlocks blocks{block_side(width), block_side(height), 1, {}};
  const double count = pixel_budget(s) / (blocks.block_width * blocks.block_height);
  const auto clamped = [](double n, int most) { return std::clamp(static_cast<int>(std::lround(n)), 1, most); };
  const int most_columns = std::min(width / blocks.block_width, std::max(static_cast<int>(count), 1));
  blocks.columns = clamped(std::sqrt(count * width / height), most_columns);
  const int rows = clamped(count / blocks.columns, height / blocks.block_height);
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < blocks.columns; ++column)
      blocks.places.push_back({(2 * column + 1) * width / (2 * blocks.columns) - blocks.block_width / 2,
                               (2 * row + 1) * height / (2 * rows) - blocks.block_height / 2});
  return blocks;
}

bool shares_at_visible(const Settings& s) { return s.path_sharing.visible.groups.size > 1; }
bool is_for_denoiser(const Settings& s) { return s.path_sharing.for_denoiser || !shares_at_visible(s); }
int box_side(const Settings& s) { return is_for_denoiser(s) ? kBoxOfDenoisers : kBox; }
bool shares_at_next(const Settings& s) { return s.path_sharing.deep.groups.size > 1; }

Settings settings_of_trial(const Settings& s) {
  Settings trial = s;
  trial.seed = hash_combine(mix_bits(s.seed), kTrialSeed);
  trial.direct = DirectAnswer::NEE;
  trial.secondary = SecondaryAnswer::NEE;
  trial.guiding = Guiding::OFF;
  trial.passes = {};
  trial.surface_passes = {};
  trial.light_groups = 0;
  return trial;
}

float seen(const PathRecord& r) { return luminance(r.direct + r.indirect + r.emission + r.environment); }

}  // namespace

/// Of one sample of a pixel, without fireflies.
double SharingTrial::plain_variance(double sum_over_boxes) const {
  const auto boxes_along = [&](int pixels) { return (pixels + box_side(settings_) - 1) / box_side(settings_); };
  const double boxes = static_cast<double>(boxes_along(pixels_.width())) * boxes_along(pixels_.height());
  return sum_over_boxes / boxes * (static_cast<double>(pixels_.size()) / boxes);
}

bool SharingTrial::is_for(const Settings& s) {
  const bool is_unbiased = s.path_sharing.weights == PairWeights::BALANCE;  // either way has the same expectation
  return s.path_sharing.on_trial && is_unbiased && BandedFrame::is_for(s) &&
         (shares_at_visible(s) || shares_at_next(s)) && pixel_budget(s) >= kLeastPixels;
}

SharingTrial::SharingTrial(const Settings& settings, std::shared_ptr<const Scene> scene,
                           std::shared_ptr<const Accel> accel, std::shared_ptr<const LightSet> lights,
                           std::shared_ptr<const CausticGuide> caustics)
    : settings_(settings),
      world_(settings_of_trial(settings), std::move(scene), std::move(accel), std::move(lights), std::move(caustics)),
      pixels_(blocks_of(settings)),
      shared_(world_.context),
      luminance_(pixels_.size()),
      without_visible_(pixels_.size()),
      noise_(comparison_of(COUNT)) {}

NoiseComparison SharingTrial::comparison_of(size_t ways) const {
  return {pixels_.width(), pixels_.height(), box_side(settings_), ways};
}

double SharingTrial::cost(Way way) {
  switch (way) {
    case PLAIN:
      return 1.0;
    case NEXT_VERTICES:
      return kCostOfNextVertices;
    default:
      break;
  }
  return kCost;
}

bool SharingTrial::trace_plainly(const RenderWorld& world, uint32_t frame, const StopCondition& stop) {
  const auto trace = [&](int x, int y, PathScratch& scratch) {
    const PixelBlocks::Pixel place = pixels_.place(x, y);
    luminance_[static_cast<size_t>(y) * static_cast<size_t>(pixels_.width()) + static_cast<size_t>(x)] =
        seen(trace_pixel(world.context, place.x, place.y, frame, scratch));
  };
  return for_each_pixel<PathScratch>(pixels_.width(), pixels_.height(), stop, trace, [](const PathScratch&) {});
}

bool SharingTrial::share(uint32_t frame, const StopCondition& stop) {
  if (!shared_.render(pixels_, frame, stop)) return false;
  for (uint32_t i = 0; i < pixels_.size(); ++i) {
    const PathRecord record = shared_.record(i);
    luminance_[i] = seen(record);
    without_visible_[i] = luminance_[i] - luminance(record.shared);
  }
  noise_.add_frame(AS_ASKED, luminance_);
  noise_.add_frame(NEXT_VERTICES, without_visible_);
  return true;
}

bool SharingTrial::is_one_light_enough(double variance, const StopCondition& stop) {
  Settings settings = world_.settings;
  settings.light_samples = 1;
  const RenderWorld world(settings, world_.scene, world_.accel, world_.lights, world_.caustics);
  NoiseComparison noise = comparison_of(1);
  for (uint32_t frame = 0; frame < kFrames; ++frame) {
    if (!trace_plainly(world, frame, stop)) return false;
    noise.add_frame(0, luminance_);
  }
  return noise.variances()[0] < kCostOfMoreLights * variance;
}

Settings SharingTrial::decide(const StopCondition& stop) {
  for (uint32_t frame = 0; frame < kFrames; ++frame) {
    if (!trace_plainly(world_, frame, stop)) return settings_;
    noise_.add_frame(PLAIN, luminance_);
    if (!share(frame, stop)) return settings_;
  }
  const std::vector<double> typical = noise_.variances();
  const auto surely_beats = [&](Way way, Way other) {
    const double enough = other == AS_ASKED ? kTypically : kTypicallyOfNextVertices;
    const double share = cost(way) * typical[way] / (cost(other) * typical[other]);
    if (share < kFarLess) return true;
    return share < enough && noise_.significance(way, cost(way), other, cost(other)) < -kSure;
  };
  const double variance = plain_variance(typical[PLAIN]);
  Settings decided = settings_;
  if (variance > kTooRare) {
    PathSharing& sharing = decided.path_sharing;
    if (std::exchange(sharing.for_denoiser, false)) sharing.visible.pixels *= kWider;
    return decided;
  }
  const bool has_even_noise = settings_.path_sharing.for_denoiser && variance < kEvenNoise;
  const bool next_alone = !shares_at_visible(settings_) || has_even_noise ||
                          (shares_at_next(settings_) && surely_beats(NEXT_VERTICES, AS_ASKED));
  const bool plain_wins =
      (next_alone && !shares_at_next(settings_)) || surely_beats(PLAIN, next_alone ? NEXT_VERTICES : AS_ASKED);
  if (decided.guiding == Guiding::AUTO && (plain_wins || variance < kRareLight)) decided.guiding = Guiding::OFF;
  if (plain_wins) {
    decided.indirect = IndirectAnswer::PATH;
    if (decided.light_samples > 1 && is_one_light_enough(typical[PLAIN], stop)) decided.light_samples = 1;
  } else if (next_alone) {
    decided.path_sharing.visible.groups.size = 1;
  }
  return decided;
}

}  // namespace cistern
