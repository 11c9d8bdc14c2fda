#pragma once

#include "accel/accel.h"
#include "shading/subsurface.h"
#include "shading/surface_point.h"
#include "transport/path_sampler.h"

namespace cistern {

/// Where a walk below a surface came out.
struct SubsurfaceExit {
  Ray ray;     // arrives at the surface from outside, against the direction in which the walk left
  Hit hit;     // of this ray
  Rgb weight;  // light that leaves here, over the density of the walk; what entered counts as 1
};

/// Random walk through the medium below `entry`, an object filled with it, up to where it meets the object's surface
/// again; other objects are not there. [Chiang, Kutz and Burley 2016, Practical and Controllable Subsurface Scattering
/// for Production Path Tracing] Of walks so long that hardly any is, nothing comes: 256 scatterings, as in Cycles.
/// Empty where the walk does not enter, or brings nothing.
///
/// Directions and free paths are from one of up to nine techniques, weighed by the balance heuristic: the medium's own,
/// or such as lead back to where light entered or to the opposite side [Krivanek and d'Eon 2014, A
/// Zero-Variance-Based Sampling Scheme for Monte Carlo Subsurface Scattering; Meng, Hanika and Dachsbacher 2016,
/// Improving the Dwivedi Sampling Scheme], each with the extinction of one of three channels.
std::optional<SubsurfaceExit> walk_below(const Accel& accel, const SurfacePoint& entry, const Subsurface& subsurface,
                                         int vertex, PathSampler& sampler);

}  // namespace cistern
