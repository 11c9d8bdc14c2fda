#include "render/session.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <bit>
#include <new>

#include "base/check.h"
#include "base/sobol.h"
#include "render/caustic_photons.h"
#include "render/cell_views.h"
#include "render/index_views.h"
#include "render/learning_views.h"
#include "render/opening_search.h"
#include "render/sharing_trial.h"
#include "scene/scene_memory.h"
#include "scene/surface_sheet.h"
#include "shading/dispersion.h"
#include "transport/camera_ray.h"
#include "transport/media.h"

namespace cistern {
namespace {

/// Frames are rendered in batches, for fewer passes over the picture; a batch should not take longer than this, so that
/// progress and published pixels stay fresh.
constexpr double kBatchSeconds = 0.5;
constexpr uint32_t kMaxBatch = 16;

/// Of the time limit, what a trial may take: then it ends undecided.
constexpr double kTrialShareOfLimit = 0.15;
/// Frames before a trial of those without history, at least: the picture changes soon, and often for good.
constexpr uint32_t kFramesBeforeTrial = 2;
constexpr uint64_t kMomentSeed = 0x6d6f6d656e74;

/// With fewer frames noise is not looked at: what is rare in them is in none.
constexpr uint32_t kFramesBeforeLook = 16;
/// Light that few samples find must have had its chance: the less noise is asked for, the more of them are taken.
constexpr double kSamplesPerThreshold = 0.4;

/// Frames after which noise is looked at next: powers of two and the middles between them, of which points of Sobol's
/// sequence cover all well. No clock is asked, so that pictures with a threshold are the same for each seed.
uint32_t next_look(uint32_t frames) {
  if (frames < kFramesBeforeLook) return kFramesBeforeLook;
  const uint32_t power = std::bit_floor(frames);
  return frames < power + power / 2 ? power + power / 2 : 2 * power;
}

void check_sheet(const Scene& scene, const Settings& settings) {
  if (scene.camera.type != CameraType::SHEET) return;
  const SurfaceSheet& sheet = *scene.camera.sheet;
  if (sheet.width == settings.width && sheet.height == settings.height) return;
  throw Error("camera", "looks at a sheet of " + std::to_string(sheet.width) + " x " + std::to_string(sheet.height) +
                            " pixels: the picture has to have that size");
}

double seconds_since(std::chrono::steady_clock::time_point t) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - t).count();
}

/// Whether techniques of reuse know all that paths meet.
bool can_share(const Scene& scene) {
  return Media::find_name(scene).empty() && find_dispersive_material(scene).empty();
}

}  // namespace

Session::Session(Settings settings) : settings_(std::move(settings)) {
  check_settings(settings_);
  published_.resize(static_cast<size_t>(Pass::COUNT));
  published_surfaces_.resize(layers_of(settings_.surface_passes).size());
  published_groups_.resize(static_cast<size_t>(settings_.light_groups));
}

Session::~Session() {
  {
    std::lock_guard lock(mutex_);
    cancelled_ = true;
  }
  released_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Session::start(std::shared_ptr<const Scene> scene, std::shared_ptr<RenderCache> cache) {
  std::lock_guard lock(mutex_);
  if (was_started_) throw Error("session", "was started already; make a new one for another render");
  was_started_ = true;
  check_sheet(*scene, settings_);
  if (!can_share(*scene)) settings_ = settings_.by_path_tracing();
  if (settings_.noise_threshold > 0.0 && !settings_.tells_noise())
    throw Error("noise_threshold", "needs frames that are independent of each other, without temporal reuse");
  scene_ = std::move(scene);
  cache_ = cache ? std::move(cache) : std::make_shared<RenderCache>();
  started_ = Clock::now();
  progress_.status = Status::RUNNING;
  progress_.stage = "Building";
  progress_.frames = progress_.expected_frames = settings_.samples;
  thread_ = std::thread([this] { run(); });
}

bool Session::can_blur_motion(const Settings& settings) {
  return !ReuseFrame::is_needed(settings) || BandedFrame::is_for(settings);
}

void Session::start(std::shared_ptr<const Shutter> shutter, std::shared_ptr<RenderCache> cache) {
  if (can_share(*shutter->middle()) && !can_blur_motion(settings_))
    throw Error("motion blur",
                "needs frames that keep no samples: indirect 'PATH' or 'CELL_SHARED' without temporal "
                "reuse, and light by 'NEE' or 'LEARNED'");
  if (shutter->moves_anything()) shutter_ = shutter;
  start(shutter->middle(), std::move(cache));
}

Progress Session::wait(double seconds) {
  std::unique_lock lock(mutex_);
  const auto has_ended = [this] { return progress_.status != Status::RUNNING; };
  ended_.wait_for(lock, std::chrono::duration<double>(seconds), has_ended);
  return progress_locked();
}

Progress Session::progress_locked() const {
  Progress p = progress_;
  if (p.status != Status::RUNNING) return p;
  p.seconds = seconds_since(started_);
  if (p.frames_done > 0) {
    const double rendering = std::chrono::duration<double>(last_frame_ - rendering_since_).count();
    const double samples_left = p.pixels_left * (p.expected_frames - p.frames_done);
    p.remaining_seconds = rendering / p.mean_samples * samples_left - seconds_since(last_frame_);
    if (settings_.time_limit > 0.0)
      p.remaining_seconds = std::min(p.remaining_seconds, settings_.time_limit - seconds_since(rendering_since_));
    p.remaining_seconds = std::max(p.remaining_seconds, 0.0);
  }
  return p;
}

void Session::cancel() {
  std::unique_lock lock(mutex_);
  cancelled_ = true;
  released_.notify_all();
  const auto has_ended = [this] { return progress_.status != Status::RUNNING; };
  // Not wait(): it would bind the module to the C++ library of GCC 12, newer than that of RHEL 9.
  while (!ended_.wait_for(lock, std::chrono::seconds(1), has_ended)) {
  }
}

void Session::hold_after(int frames) {
  {
    std::lock_guard lock(mutex_);
    held_after_ = static_cast<uint32_t>(std::max(frames, 0));
  }
  released_.notify_all();
}

/// How many frames may follow at once; 0 when cancelled.
uint32_t Session::await_release(uint32_t frames_done) {
  std::unique_lock lock(mutex_);
  const auto may_go_on = [&] { return cancelled_ || frames_done < held_after_; };
  while (!released_.wait_for(lock, std::chrono::seconds(1), may_go_on)) {  // see cancel
  }
  return cancelled_ ? 0 : held_after_ - frames_done;
}

std::vector<float> Session::read(Pass pass) {
  std::lock_guard lock(mutex_);
  // Once the render has ended nobody writes to the film: resolving it here costs no one who only cancels.
  if (progress_.status != Status::RUNNING && film_) return film_->resolve(pass);
  return read_published(published_[static_cast<size_t>(pass)], describe(pass).channels);
}

std::vector<float> Session::read(const SurfaceLayer& layer) {
  std::lock_guard lock(mutex_);
  if (progress_.status != Status::RUNNING && surfaces_) return surfaces_->resolve(layer);
  const std::vector<SurfaceLayer> layers = layers_of(settings_.surface_passes);
  const auto found = std::ranges::find(layers, layer);
  if (found == layers.end()) throw Error("pass", "was not enabled for this render");
  return read_published(published_surfaces_[static_cast<size_t>(found - layers.begin())], layer.channels);
}

std::vector<float> Session::read_light_group(int group) {
  std::lock_guard lock(mutex_);
  if (group < 0 || group >= settings_.light_groups)
    throw Error("pass '" + light_group_name(group) + "'", "was not enabled for this render");
  if (progress_.status != Status::RUNNING && film_) return film_->resolve_light_group(group);
  return read_published(published_groups_[static_cast<size_t>(group)], kLightGroupChannels);
}

/// Under the lock.
std::vector<float> Session::read_published(const std::vector<float>& pixels, int channels) {
  wants_pixels_ = true;
  if (!pixels.empty()) return pixels;
  const Region& r = settings_.region;
  return std::vector<float>(static_cast<size_t>(r.width) * static_cast<size_t>(r.height) * channels, 0.0f);
}

void Session::run() {
  std::unique_ptr<ReuseFrame> reuse;  // freed when the render has ended: buffers of a gigabyte take their time
  try {
    std::optional<tbb::global_control> workers;  // more than processors, where they are asked for
    if (settings_.threads > tbb::info::default_concurrency())
      workers.emplace(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(settings_.threads));
    tbb::task_arena arena(settings_.threads > 0 ? settings_.threads : tbb::task_arena::automatic);
    arena.execute([this, &reuse] {
      std::vector<Pass> passes = settings_.passes;
      if (settings_.noise_threshold > 0.0) passes.push_back(Pass::COMBINED_NOISE);
      film_ = std::make_unique<Film>(settings_.region.width, settings_.region.height, passes, settings_.light_groups,
                                     settings_.film_exposure);
      if (settings_.surface_passes.any())
        surfaces_ = std::make_shared<SurfaceFilm>(
            settings_.surface_passes, film_->width(), film_->height(),
            Vec2{static_cast<float>(settings_.width), static_cast<float>(settings_.height)});
      const auto accel = cache_->accel(scene_, settings_.keep_instances || (shutter_ && shutter_->moves_surfaces()),
                                       [this] { return cancelled_.load(); });
      if (!accel) return;
      const Clock::time_point trial_start = Clock::now();
      const auto lights = find_lights(accel);
      const StopCondition in_time{cancelled_, deadline_from(trial_start, kTrialShareOfLimit)};
      const auto caustics = make_caustic_guide(settings_, *scene_, *accel, *lights,
                                               [&in_time] { return in_time.cancelled || in_time.deadline_passed(); });
      const Settings decided = decided_settings(settings_, accel, lights, caustics);
      const Clock::duration trial_time = Clock::now() - trial_start;
      const auto world = std::make_shared<const RenderWorld>(decided, scene_, accel, lights, caustics, surfaces_);
      std::shared_ptr<const LightCacheCells> cache_cells;
      if (settings_.direct == DirectAnswer::RESTIR_CACHE) {
        const WorkMonitor monitor{[this] { return cancelled_.load(); }, [this](float done) { report_caching(done); }};
        cache_cells = cache_->light_cache_cells(*scene_, static_cast<uint32_t>(settings_.light_cache.surface_points),
                                                settings_.seed, monitor);
        if (!cache_cells) return;
      }
      reuse = make_reuse_frame(world, cache_cells);
      {
        std::lock_guard lock(mutex_);
        progress_.memory_bytes = memory_bytes(*scene_) + world->accel->memory_bytes() + world->lights->memory_bytes() +
                                 (caustics ? caustics->memory_bytes() : 0) + film_->memory_bytes() +
                                 (surfaces_ ? surfaces_->memory_bytes() : 0);
        progress_.openings = static_cast<int>(openings_.size());
        progress_.stage = "Rendering";
        rendering_since_ = Clock::now() - trial_time;  // of the samples' time a part
      }
      const StopCondition no_limit{cancelled_, Clock::time_point::max()};
      if (show_cells(world->context, cache_cells.get(), *film_, no_limit) &&
          show_indices(world->context, *film_, no_limit)) {
        render(world, reuse.get());
        tell_noise_left();
      }
      show_learning(world->context, *film_, no_limit);
      if (reuse) leave_history(std::move(reuse));
    });
    end(cancelled_ ? Status::CANCELLED : Status::DONE, "");
  } catch (const std::bad_alloc&) {
    end(Status::FAILED, "out of memory");
  } catch (const std::exception& e) {
    end(Status::FAILED, e.what());
  }
}

/// Of what starts at `start` and may take so much of the time limit.
Session::Clock::time_point Session::deadline_from(Clock::time_point start, double share) const {
  if (!(settings_.time_limit > 0.0)) return Clock::time_point::max();
  return start +
         std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(share * settings_.time_limit));
}

/// What adapts itself to the scene before the frames that are asked for; in a share of the time limit, if there is one.
Settings Session::decided_settings(const Settings& asked, const std::shared_ptr<const Accel>& accel,
                                   const std::shared_ptr<const LightSet>& lights,
                                   const std::shared_ptr<const CausticGuide>& caustics) const {
  if (!SharingTrial::is_for(asked)) return asked;
  const StopCondition stop{cancelled_, deadline_from(Clock::now(), kTrialShareOfLimit)};
  return SharingTrial(asked, scene_, accel, lights, caustics).decide(stop);
}

/// The lights that light samples are for, with what openings pay.
std::shared_ptr<const LightSet> Session::find_lights(const std::shared_ptr<const Accel>& accel) {
  const EnvironmentDensity density = settings_.environment_density();
  auto lights = cache_->lights(scene_, settings_.light_sampling, density);
  if (!may_find_openings(*scene_, settings_, *lights)) return lights;
  if (const auto kept = cache_->openings(*scene_, settings_)) {
    openings_ = *kept;
  } else {
    const auto is_stopped = [this] { return cancelled_.load(); };
    const SkyWalks walks(*scene_, *accel, settings_);
    openings_ = find_openings(walks, is_stopped);
    if (!openings_.empty()) {
      const auto with = cache_->lights(scene_, settings_.light_sampling, density, openings_);
      if (!openings_pay(walks, *lights, *with, is_stopped)) openings_.clear();
    }
    if (cancelled_) return lights;
    cache_->keep_openings(scene_, settings_, openings_);
  }
  return openings_.empty() ? lights : cache_->lights(scene_, settings_.light_sampling, density, openings_);
}

bool Session::keeps_history() const { return settings_.keep_history && settings_.has_temporal_reuse(); }

/// Null for the reference path tracer and where all frames are banded.
std::unique_ptr<ReuseFrame> Session::make_reuse_frame(const std::shared_ptr<const RenderWorld>& world,
                                                      std::shared_ptr<const LightCacheCells> cache_cells) {
  if (!ReuseFrame::is_needed(settings_) || BandedFrame::is_for(settings_)) return nullptr;
  auto frame =
      std::make_unique<ReuseFrame>(world, std::move(cache_cells), [this](float done) { report_caching(done); });
  if (std::unique_ptr<ReuseFrame> finer = cache_->lend_history(settings_)) {
    SceneChange change = compare_scenes(*finer->history_world()->scene, *scene_);
    frame->borrow(std::move(finer), std::move(change));
    return frame;
  }
  std::unique_ptr<ReuseFrame> earlier = keeps_history() ? cache_->take_history(settings_) : nullptr;
  if (earlier) frame->take_over(std::move(*earlier), compare_scenes(*earlier->history_world()->scene, *scene_));
  return frame;
}

/// To later renders, and gives back what was borrowed.
void Session::leave_history(std::unique_ptr<ReuseFrame> frame) {
  std::unique_ptr<ReuseFrame> lender = frame->give_back();
  const bool has_history = frame->has_finished_frame() || !lender;
  if (lender) cache_->return_history(std::move(lender));
  if (keeps_history() && has_history) cache_->leave_history(std::move(frame));
}

/// Of frames without history that follow one with it: how they go on after `frames` of the picture. False, and nothing
/// happens, while these took too little time for a trial to be a small part of it.
bool Session::try_sharing(uint32_t frames, const RenderWorld& world, std::optional<BandedFrame>& banded) {
  Settings later = world.settings.of_later_frames();
  later.samples = static_cast<int>(frames);
  if (!SharingTrial::is_for(later)) return false;
  const Settings decided = decided_settings(later, world.accel, world.lights, world.caustics);
  if (BandedFrame::is_for(decided)) {
    banded.emplace(world.context, decided);
  } else {
    banded.reset();
    const auto pixels = static_cast<uint32_t>(settings_.region.width * settings_.region.height);
    for (uint32_t pixel = 0; pixel < pixels; ++pixel) film_->show(Pass::REUSE_COUNT, pixel, Rgb());
  }
  return true;
}

/// Whether pixels end by themselves: not where frames look at those of others.
bool Session::adapts() const { return settings_.adaptive_sampling && can_blur_motion(settings_.of_later_frames()); }

/// After so many frames, if it is time to look: whether nothing is left to do.
bool Session::is_clean(uint32_t frames, const FrameContext& context) {
  const double threshold = settings_.noise_threshold;
  if (!(threshold > 0.0) || next_look(frames - 1) != frames) return false;
  const PictureNoise noise = look_at_noise(frames);
  if (frames * threshold < kSamplesPerThreshold) return false;
  if (!adapts()) return noise.of_most() <= threshold;
  if (context.guiding && context.guiding->awaits_trial(frames)) return noise.of_worst() <= threshold;
  const size_t left = noise.finish_quiet_blocks(*film_, threshold);
  std::lock_guard lock(mutex_);
  progress_.pixels_left = static_cast<double>(left) / (static_cast<double>(film_->width()) * film_->height());
  return left == 0;
}

PictureNoise Session::look_at_noise(uint32_t frames) {
  const auto most = static_cast<uint32_t>(settings_.samples);
  PictureNoise noise(*film_, settings_.display_exposure);
  const double excess = (adapts() ? noise.of_worst() : noise.of_most()) / settings_.noise_threshold;
  std::lock_guard lock(mutex_);
  progress_.noise = noise.of_most();
  const double fewest = std::max<double>(frames, kSamplesPerThreshold / settings_.noise_threshold);
  const auto enough = static_cast<uint32_t>(std::min<double>(std::max(frames * excess * excess, fewest), most));
  progress_.expected_frames = static_cast<int>(std::min(next_look(enough), most));
  return noise;
}

/// Of a picture that ends after any number of frames, all of them or as many as there was time for: two have a
/// difference to tell it by.
void Session::tell_noise_left() {
  const auto frames = static_cast<uint32_t>(progress_.frames_done);
  if (!(settings_.noise_threshold > 0.0) || cancelled_ || frames < 2) return;
  if (next_look(frames - 1) != frames) look_at_noise(frames);
}

/// By `reuse`, all frames or the first one; where that is null or has made its own, in bands or by the reference path
/// tracer, whose frames come in batches.
void Session::render(std::shared_ptr<const RenderWorld> world, ReuseFrame* reuse) {
  const auto frames = static_cast<uint32_t>(settings_.samples);
  const size_t fixed_memory = progress_.memory_bytes;
  const uint32_t first_number = reuse ? reuse->next_frame() : 0;  // later renders know those by `reuse` alone
  const bool has_later_frames = reuse && world->settings.of_later_frames() != world->settings;
  bool is_reusing = reuse, is_decided = false;
  std::optional<BandedFrame> banded;
  if (BandedFrame::is_for(world->settings)) banded.emplace(world->context, world->settings);
  // Every pixel gets at least one sample: the limit holds from the second frame on.
  StopCondition stop{cancelled_, Clock::time_point::max()};
  uint32_t batch = 1;
  for (uint32_t frame = 0; frame < frames && !cancelled_ && !stop.deadline_passed();) {
    const uint32_t released = await_release(frame);
    if (released == 0) break;
    if (shutter_) {
      std::shared_ptr<const RenderWorld> next = at_moment(frame, *world);
      if (!next) break;
      world = std::move(next);
      if (banded) banded.emplace(world->context, world->settings);
      batch = 1;
    }
    const FrameContext& context = world->context;
    if (has_later_frames && frame == 1) {
      is_reusing = false;
      banded.emplace(context, world->settings.of_later_frames());
    }
    if (has_later_frames && !is_decided && frame >= kFramesBeforeTrial) is_decided = try_sharing(frame, *world, banded);
    batch = std::min({batch, released, frames - frame});
    if (settings_.noise_threshold > 0.0) batch = std::min(batch, next_look(frame) - frame);
    if (context.learning) batch = std::min(batch, context.learning->frames_to_update(frame));
    if (context.guiding) batch = std::min(batch, context.guiding->frames_to_update(frame));
    const Clock::time_point batch_start = Clock::now();
    const uint32_t number = first_number + frame;
    begin_frames(context, frame, number);
    if (!(is_reusing ? reuse->render(*film_, stop)
          : banded   ? banded->render(number, *film_, stop)
                     : render_frames(context, number, batch, *film_, stop)))
      break;
    const double batch_seconds = seconds_since(batch_start);
    frame += batch;
    context.sequences.finish(number + batch);
    if (context.learning && frame < frames) context.learning->finish_frames(frame);
    if (context.guiding && frame < frames) context.guiding->finish_frames(frame);
    stop.deadline = deadline_from(rendering_since_, 1.0);
    bool publish_now;
    {
      std::lock_guard lock(mutex_);
      progress_.frames_done = static_cast<int>(frame);
      progress_.mean_samples += batch * progress_.pixels_left;
      last_frame_ = Clock::now();
      if (reuse) {
        progress_.non_finite_weights = reuse->non_finite_weights();
        progress_.stage_seconds = reuse->stage_times().seconds();
      }
      progress_.memory_bytes = fixed_memory + (reuse ? reuse->memory_bytes() : 0) +
                               (banded ? banded->memory_bytes() : 0) +
                               (context.learning ? context.learning->memory_bytes() : 0) +
                               (context.guiding ? context.guiding->memory_bytes() : 0);
      publish_now = wants_pixels_ && frame < frames && (held_after_ == kFree || frame >= held_after_);
    }
    if (publish_now) publish();
    if (is_clean(frame, context)) break;
    if (!is_reusing && !banded && batch_seconds * 2.0 < kBatchSeconds) batch = std::min(2 * batch, kMaxBatch);
    if (batch_seconds > kBatchSeconds) batch = std::max(batch / 2, 1u);
  }
}

/// The scene at the moment of a frame, null when cancelled. Of any number of frames the moments are spread evenly, and
/// each is anywhere.
std::shared_ptr<const RenderWorld> Session::at_moment(uint32_t frame, const RenderWorld& earlier) const {
  const auto seed = static_cast<uint32_t>(hash_combine(mix_bits(settings_.seed), kMomentSeed));
  const std::shared_ptr<const Scene> scene =
      shutter_->at(time_of_exposure(settings_.shutter_curve, sobol_point(frame, 0, seed).pair.x));
  const auto is_stopped = [this] { return cancelled_.load(); };
  const auto accel = shutter_->moves_surfaces() ? cache_->accel(scene, true, is_stopped) : earlier.accel;
  if (!accel) return nullptr;
  const auto lights = cache_->lights(scene, settings_.light_sampling, settings_.environment_density(), openings_);
  return std::make_shared<const RenderWorld>(earlier, scene, accel, lights);
}

void Session::report_caching(float done) {
  const std::lock_guard lock(mutex_);
  progress_.stage = done < 1.0f ? "Caching light" : "Rendering";
  progress_.stage_done = done;
}

void Session::publish() {
  std::vector<std::vector<float>> resolved(static_cast<size_t>(Pass::COUNT));
  for (size_t i = 0; i < resolved.size(); ++i)
    if (film_->has(static_cast<Pass>(i))) resolved[i] = film_->resolve(static_cast<Pass>(i));
  std::vector<std::vector<float>> surfaces;
  for (const SurfaceLayer& layer : layers_of(settings_.surface_passes)) surfaces.push_back(surfaces_->resolve(layer));
  std::vector<std::vector<float>> groups;
  groups.reserve(static_cast<size_t>(settings_.light_groups));
  for (int group = 0; group < settings_.light_groups; ++group) groups.push_back(film_->resolve_light_group(group));
  std::lock_guard lock(mutex_);
  published_ = std::move(resolved);
  published_surfaces_ = std::move(surfaces);
  published_groups_ = std::move(groups);
  wants_pixels_ = false;
  ++progress_.version;
}

void Session::end(Status status, const std::string& error) {
  std::lock_guard lock(mutex_);
  progress_.seconds = seconds_since(started_);
  progress_.remaining_seconds = 0.0;
  progress_.non_finite_samples = film_ ? film_->non_finite_samples() : 0;
  progress_.error = error;
  progress_.status = status;
  ++progress_.version;
  for (auto* pictures : {&published_, &published_surfaces_, &published_groups_})
    *pictures = std::vector<std::vector<float>>(pictures->size());  // assigned to, each would keep its memory
  scene_.reset();
  cache_.reset();
  ended_.notify_all();
}

}  // namespace cistern
