#include <pybind11/native_enum.h>
#include <pybind11/stl.h>

#include <functional>
#include <map>

#include "binding/arrays.h"
#include "binding/bind.h"
#include "binding/scene_handle.h"
#include "render/session.h"

namespace cistern::binding {
namespace {

template <class E>
E enum_member(const std::string& setting, const std::string& value,
              const std::vector<std::pair<const char*, E>>& allowed) {
  std::string names;
  for (const auto& [name, member] : allowed) {
    if (value == name) return member;
    names += std::string(names.empty() ? "" : ", ") + name;
  }
  throw Error("setting '" + setting + "'", "'" + value + "' is not one of " + names);
}

template <class T>
std::function<void(Settings&, const py::handle&)> member(T Settings::*field) {
  return [field](Settings& s, const py::handle& value) { s.*field = value.cast<T>(); };
}

template <class T>
std::function<void(Settings&, const py::handle&)> limit(T PathLimits::*field) {
  return [field](Settings& s, const py::handle& value) { s.limits.*field = value.cast<T>(); };
}

template <class T>
std::function<void(Settings&, const py::handle&)> reuse(T DirectReuse::*field) {
  return [field](Settings& s, const py::handle& value) { s.direct_reuse.*field = value.cast<T>(); };
}

template <class T>
std::function<void(Settings&, const py::handle&)> grid(T GridSettings::*field) {
  return [field](Settings& s, const py::handle& value) { s.grid.*field = value.cast<T>(); };
}

std::function<void(Settings&, const py::handle&)> light_cache(int LightCacheSettings::*field) {
  return [field](Settings& s, const py::handle& value) { s.light_cache.*field = value.cast<int>(); };
}

using Setter = std::function<void(Settings&, const py::handle&)>;

Setter set_passes() {
  return [](Settings& s, const py::handle& value) {
    s.passes.clear();
    s.light_groups = 0;
    for (const std::string& name : value.cast<std::vector<std::string>>()) {
      if (const std::optional<SurfaceLayer> layer = find_surface_layer(name))
        keep(*layer, s.surface_passes);
      else if (const std::optional<int> group = find_light_group(name))
        s.light_groups = std::max(s.light_groups, *group + 1);
      else
        s.passes.push_back(find_pass(name));
    }
  };
}

Setter set_mist_range() {
  return [](Settings& s, const py::handle& value) {
    const auto [start, depth, falloff] = value.cast<std::tuple<float, float, float>>();
    s.surface_passes.mist_range = {start, depth, falloff};
  };
}

Setter set_occlusion_distance() {
  return [](Settings& s, const py::handle& value) { s.surface_passes.occlusion_distance = value.cast<float>(); };
}

Setter set_region() {
  return [](Settings& s, const py::handle& value) {
    const auto [x, y, width, height] = value.cast<std::tuple<int, int, int, int>>();
    s.region = {x, y, width, height};
  };
}

template <class E>
Setter choice(const char* setting, E Settings::*field, std::vector<std::pair<const char*, E>> allowed) {
  return [=](Settings& s, const py::handle& value) {
    s.*field = enum_member(setting, value.cast<std::string>(), allowed);
  };
}

std::map<std::string, Setter> make_setters() {
  return {
      {"width", member(&Settings::width)},
      {"height", member(&Settings::height)},
      {"region", set_region()},
      {"samples", member(&Settings::samples)},
      {"seed", member(&Settings::seed)},
      {"threads", member(&Settings::threads)},
      {"direct", choice<DirectAnswer>("direct", &Settings::direct,
                                      {{"NEE", DirectAnswer::NEE},
                                       {"LEARNED", DirectAnswer::LEARNED},
                                       {"RIS", DirectAnswer::RIS},
                                       {"RESTIR", DirectAnswer::RESTIR},
                                       {"RESTIR_CACHE", DirectAnswer::RESTIR_CACHE}})},
      {"secondary", choice<SecondaryAnswer>("secondary", &Settings::secondary,
                                            {{"NEE", SecondaryAnswer::NEE},
                                             {"LEARNED", SecondaryAnswer::LEARNED},
                                             {"RIS", SecondaryAnswer::RIS},
                                             {"CELL_RESERVOIRS", SecondaryAnswer::CELL_RESERVOIRS}})},
      {"indirect", choice<IndirectAnswer>("indirect", &Settings::indirect,
                                          {{"PATH", IndirectAnswer::PATH},
                                           {"SCREEN_REUSE", IndirectAnswer::SCREEN_REUSE},
                                           {"WORLD_REUSE", IndirectAnswer::WORLD_REUSE},
                                           {"CELL_SHARED", IndirectAnswer::CELL_SHARED}})},
      {"keep_history", member(&Settings::keep_history)},
      {"is_draft", member(&Settings::is_draft)},
      {"keep_instances", member(&Settings::keep_instances)},
      {"light_sampling", member(&Settings::light_sampling)},
      {"find_openings", member(&Settings::find_openings)},
      {"light_through_panes", member(&Settings::light_through_panes)},
      {"light_samples", member(&Settings::light_samples)},
      {"guiding", choice<Guiding>("guiding", &Settings::guiding,
                                  {{"OFF", Guiding::OFF}, {"ON", Guiding::ON}, {"AUTO", Guiding::AUTO}})},
      {"caustic_guide", member(&Settings::caustic_guide)},
      {"sequence", choice<SampleSequence>("sequence", &Settings::sequence,
                                          {{"SOBOL", SampleSequence::SOBOL},
                                           {"PIXEL_SOBOL", SampleSequence::PIXEL_SOBOL},
                                           {"RANDOM", SampleSequence::RANDOM}})},
      {"pixel_filter", member(&Settings::pixel_filter)},
      {"filter_width", member(&Settings::filter_width)},
      {"max_bounces", limit(&PathLimits::max_bounces)},
      {"max_diffuse_bounces", limit(&PathLimits::max_diffuse_bounces)},
      {"max_glossy_bounces", limit(&PathLimits::max_glossy_bounces)},
      {"max_transmission_bounces", limit(&PathLimits::max_transmission_bounces)},
      {"max_volume_bounces", limit(&PathLimits::max_volume_bounces)},
      {"max_transparent_bounces", limit(&PathLimits::max_transparent_bounces)},
      {"min_bounces", limit(&PathLimits::min_bounces)},
      {"clamp_direct", limit(&PathLimits::clamp_direct)},
      {"clamp_indirect", limit(&PathLimits::clamp_indirect)},
      {"filter_glossy", limit(&PathLimits::filter_glossy)},
      {"caustics_reflective", limit(&PathLimits::caustics_reflective)},
      {"caustics_refractive", limit(&PathLimits::caustics_refractive)},
      {"film_transparent", limit(&PathLimits::film_transparent)},
      {"film_transparent_glass", limit(&PathLimits::film_transparent_glass)},
      {"time_limit", member(&Settings::time_limit)},
      {"noise_threshold", member(&Settings::noise_threshold)},
      {"adaptive_sampling", member(&Settings::adaptive_sampling)},
      {"display_exposure", member(&Settings::display_exposure)},
      {"film_exposure", member(&Settings::film_exposure)},
      {"shutter_curve", member(&Settings::shutter_curve)},
      {"passes", set_passes()},
      {"mist_range", set_mist_range()},
      {"occlusion_distance", set_occlusion_distance()},
      {"groups_behind_film", member(&Settings::groups_behind_film)},
  };
}

/// Of all answers that have a history.
void set_temporal_reuse(Settings& s, const py::handle& value) {
  const bool is_on = value.cast<bool>();
  s.direct_reuse.temporal_reuse = s.secondary_reuse.temporal_reuse = is_on;
  s.screen_paths.temporal_reuse = s.world_paths.temporal_reuse = s.path_sharing.temporal_reuse = is_on;
}

std::map<std::string, Setter> make_reuse_setters() {
  return {
      {"bias",
       [](Settings& s, const py::handle& value) {
         s.direct_reuse.bias =
             enum_member<Bias>("bias", value.cast<std::string>(), {{"UNBIASED", Bias::UNBIASED}, {"FAST", Bias::FAST}});
       }},
      {"light_candidates", reuse(&DirectReuse::light_candidates)},
      {"temporal_reuse", set_temporal_reuse},
      {"first_frame_history",
       [](Settings& s, const py::handle& value) { s.path_sharing.first_frame_history = value.cast<bool>(); }},
      {"confidence_cap", reuse(&DirectReuse::confidence_cap)},
      {"spatial_reuse", reuse(&DirectReuse::spatial_reuse)},
      {"path_spatial_reuse",
       [](Settings& s, const py::handle& value) {
         s.screen_paths.spatial_reuse = s.world_paths.spatial_reuse = value.cast<bool>();
       }},
      {"share_visible",
       [](Settings& s, const py::handle& value) { s.path_sharing.visible.groups.size = value.cast<int>(); }},
      {"share_deep", [](Settings& s, const py::handle& value) { s.path_sharing.deep.groups.size = value.cast<int>(); }},
      {"share_for_denoiser",
       [](Settings& s, const py::handle& value) { s.path_sharing.for_denoiser = value.cast<bool>(); }},
      {"share_trial", [](Settings& s, const py::handle& value) { s.path_sharing.on_trial = value.cast<bool>(); }},
      {"share_visible_pixels",
       [](Settings& s, const py::handle& value) { s.path_sharing.visible.pixels = value.cast<float>(); }},
      {"share_deep_pixels",
       [](Settings& s, const py::handle& value) { s.path_sharing.deep.pixels = value.cast<float>(); }},
      {"path_source",
       [](Settings& s, const py::handle& value) {
         s.screen_paths.source = enum_member<RoughSampling>(
             "path_source", value.cast<std::string>(),
             {{"BSDF", RoughSampling::BSDF}, {"COSINE", RoughSampling::COSINE}, {"UNIFORM", RoughSampling::UNIFORM}});
       }},
      {"path_target",
       [](Settings& s, const py::handle& value) {
         s.screen_paths.rules.target = s.world_paths.rules.target =
             enum_member<PathTarget>("path_target", value.cast<std::string>(),
                                     {{"REFLECTED", PathTarget::REFLECTED}, {"RADIANCE", PathTarget::RADIANCE}});
       }},
      {"path_validation",
       [](Settings& s, const py::handle& value) { s.screen_paths.validation_frames = value.cast<int>(); }},
      {"path_multi_bounce",
       [](Settings& s, const py::handle& value) { s.screen_paths.multi_bounce_share = value.cast<float>(); }},
      {"path_spatial_cap",
       [](Settings& s, const py::handle& value) { s.screen_paths.spatial_cap = value.cast<float>(); }},
      {"path_cell_count", [](Settings& s, const py::handle& value) { s.world_paths.max_count = value.cast<int>(); }},
      {"path_deep_points",
       [](Settings& s, const py::handle& value) { s.world_paths.deep_points = value.cast<bool>(); }},
      {"spatial_neighbours", reuse(&DirectReuse::spatial_neighbours)},
      {"spatial_radius", reuse(&DirectReuse::spatial_radius)},
      {"spatial_rounds", reuse(&DirectReuse::spatial_rounds)},
      {"visibility_reuse", reuse(&DirectReuse::visibility_reuse)},
      {"cache_merged", light_cache(&LightCacheSettings::merged)},
      {"cache_candidates", light_cache(&LightCacheSettings::candidates)},
      {"cache_refresh", light_cache(&LightCacheSettings::refresh_frames)},
      {"cell_pixels", grid(&GridSettings::cell_pixels)},
      {"min_cell_size", grid(&GridSettings::min_cell_size)},
      {"normal_cells", grid(&GridSettings::use_normals)},
  };
}

Settings make_settings(const py::kwargs& members) {
  Settings settings;
  std::map<std::string, Setter> setters = make_setters();
  setters.merge(make_reuse_setters());
  for (const auto& [key, value] : members) {
    const auto name = key.cast<std::string>();
    const auto found = setters.find(name);
    if (found == setters.end()) throw Error("setting '" + name + "'", "there is no setting of this name");
    try {
      found->second(settings, value);
    } catch (const py::cast_error&) {
      throw Error("setting '" + name + "'", "'" + py::str(value).cast<std::string>() + "' has the wrong type");
    }
  }
  check_settings(settings);
  return settings;
}

py::array read_pass(Session& session, const std::string& name) {
  const std::optional<SurfaceLayer> layer = find_surface_layer(name);
  const std::optional<int> group = find_light_group(name);
  const Pass pass = layer || group ? Pass::COMBINED : find_pass(name);
  auto pixels = std::make_unique<std::vector<float>>();
  {
    const py::gil_scoped_release nogil;
    *pixels = layer ? session.read(*layer) : group ? session.read_light_group(*group) : session.read(pass);
  }
  const Region& r = session.settings().region;
  const float* memory = pixels->data();
  const py::capsule owner(pixels.release(), [](void* p) { delete static_cast<std::vector<float>*>(p); });
  const int channels = layer ? layer->channels : group ? kLightGroupChannels : describe(pass).channels;
  return py::array_t<float>({r.height, r.width, channels}, memory, owner);
}

std::vector<std::string> pass_names(const Session& session) {
  std::vector<std::string> names{describe(Pass::COMBINED).name};
  for (Pass pass : session.settings().passes)
    if (pass != Pass::COMBINED) names.emplace_back(describe(pass).name);
  for (const SurfaceLayer& layer : layers_of(session.settings().surface_passes)) names.push_back(name_of(layer));
  for (int group = 0; group < session.settings().light_groups; ++group) names.push_back(light_group_name(group));
  return names;
}

void bind_enums(py::module_& m) {
  py::native_enum<LightSampling>(m, "LightSampling", "enum.Enum")
      .value("UNIFORM", LightSampling::UNIFORM)
      .value("POWER", LightSampling::POWER)
      .value("TREE", LightSampling::TREE)
      .finalize();
  py::native_enum<FilterKind>(m, "PixelFilter", "enum.Enum")
      .value("BOX", FilterKind::BOX)
      .value("GAUSSIAN", FilterKind::GAUSSIAN)
      .value("BLACKMAN_HARRIS", FilterKind::BLACKMAN_HARRIS)
      .finalize();
  py::native_enum<Status>(m, "Status", "enum.Enum")
      .value("RUNNING", Status::RUNNING)
      .value("DONE", Status::DONE)
      .value("CANCELLED", Status::CANCELLED)
      .value("FAILED", Status::FAILED)
      .finalize();
}

/// Destroying a session joins its thread, which must not wait for the GIL; a cache frees large buffers, for which
/// nobody else should wait.
struct DeleteWithoutGil {
  template <class T>
  void operator()(T* object) const {
    if (PyGILState_Check() != 0) {
      const py::gil_scoped_release nogil;
      delete object;
    } else {
      delete object;
    }
  }
};

}  // namespace

void bind_session(py::module_& m) {
  bind_enums(m);
  py::class_<Settings>(m, "Settings")
      .def(py::init(&make_settings))
      .def_property_readonly("tells_noise", &Settings::tells_noise);
  py::class_<Progress>(m, "Progress")
      .def_readonly("status", &Progress::status)
      .def_readonly("frames_done", &Progress::frames_done)
      .def_readonly("frames", &Progress::frames)
      .def_readonly("seconds", &Progress::seconds)
      .def_readonly("remaining_seconds", &Progress::remaining_seconds)
      .def_readonly("noise", &Progress::noise)
      .def_readonly("mean_samples", &Progress::mean_samples)
      .def_readonly("pixels_left", &Progress::pixels_left)
      .def_readonly("expected_frames", &Progress::expected_frames)
      .def_readonly("openings", &Progress::openings)
      .def_readonly("stage", &Progress::stage)
      .def_readonly("stage_done", &Progress::stage_done)
      .def_readonly("error", &Progress::error)
      .def_readonly("memory_bytes", &Progress::memory_bytes)
      .def_readonly("non_finite_samples", &Progress::non_finite_samples)
      .def_readonly("non_finite_weights", &Progress::non_finite_weights)
      .def_property_readonly("stage_seconds",
                             [](const Progress& p) {
                               py::dict result;
                               for (const auto& [stage, seconds] : p.stage_seconds) result[stage.c_str()] = seconds;
                               return result;
                             })
      .def_readonly("version", &Progress::version);
  py::class_<RenderCache, std::shared_ptr<RenderCache>>(m, "RenderCache")
      .def(py::init([] { return std::shared_ptr<RenderCache>(new RenderCache, DeleteWithoutGil()); }))
      .def("drop_history", &RenderCache::drop_history, py::call_guard<py::gil_scoped_release>())
      .def_property_readonly("memory_bytes", &RenderCache::memory_bytes);
  using NoGil = py::call_guard<py::gil_scoped_release>;
  py::class_<Session, std::unique_ptr<Session, DeleteWithoutGil>>(m, "Session")
      .def(py::init<Settings>(), py::arg("settings"))
      .def(
          "start",
          [](Session& session, const SceneHandle& handle, const std::shared_ptr<RenderCache>& cache,
             const std::optional<std::vector<SceneHandle>>& shutter) {
            if (shutter) {
              std::vector<std::shared_ptr<const Scene>> moments;
              for (const SceneHandle& moment : *shutter) moments.push_back(moment.scene);
              session.start(std::make_shared<const Shutter>(handle.scene, moments), cache);
            } else {
              session.start(handle.scene, cache);
            }
          },
          py::arg("scene"), py::arg("cache") = nullptr, py::arg("shutter") = std::nullopt, NoGil())
      .def_static("can_blur_motion", &Session::can_blur_motion, py::arg("settings"))
      .def("wait", &Session::wait, py::arg("seconds"), NoGil())
      .def("cancel", &Session::cancel, NoGil())
      .def("hold_after", &Session::hold_after, py::arg("samples"), NoGil())
      .def("read", &read_pass, py::arg("pass_name"))
      .def("pass_names", &pass_names);
}

}  // namespace cistern::binding
