#include "render/learning_views.h"

#include <algorithm>
#include <array>

#include "shading/material.h"
#include "transport/path_guide.h"

namespace cistern {

void show_learning(const FrameContext& context, Film& film, const StopCondition& stop) {
  constexpr std::array kViews{Pass::LIGHT_CHOICE_ENTROPY, Pass::LIGHT_CHOICE_SAMPLES, Pass::GUIDED};
  if (std::ranges::none_of(kViews, [&](Pass pass) { return film.has(pass); })) return;
  const LearnedLightUse* lights = context.paths.learned;
  const auto show = [&](int x, int y, PathScratch& scratch) {
    PathCapture capture;
    trace_pixel(context, x, y, 0, scratch, &capture);
    if (!capture.visible.exists) return;
    const auto pixel = static_cast<uint32_t>(y * film.width() + x);
    const SurfacePoint point = surface_point(capture.visible);
    Bsdf bsdf = evaluate_material(context.paths.scene, point, capture.visible.state, &context.paths.accel);
    guide_bounce(context.paths, guide_cells(context.paths, point), bsdf);
    film.show(Pass::GUIDED, pixel, Rgb(bsdf.guide ? 1.0f : 0.0f));
    if (!lights || !lights->at_visible_point) return;
    const LearnedLightTable::Row* row = lights->lights->chooser(point.position, light_side(point, bsdf)).row;
    film.show(Pass::LIGHT_CHOICE_ENTROPY, pixel, Rgb(row ? row->entropy : 0.0f));
    film.show(Pass::LIGHT_CHOICE_SAMPLES, pixel, Rgb(row ? row->effective_sample_size : 0.0f));
  };
  for_each_pixel<PathScratch>(film.width(), film.height(), stop, show, [](const PathScratch&) {});
}

}  // namespace cistern
