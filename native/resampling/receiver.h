#pragma once

#include "base/rgb.h"

namespace cistern {

/// How a point of a rough surface scatters light, in few enough bytes to keep for every pixel. Good for target
/// functions, which may be any positive guess of what light a direction brings; shading evaluates the true BSDF.
struct Receiver {
  Vec3 position;
  Vec3 side;                  // light comes from the half space it points into; zero: from anywhere
  Vec3 n;                     // mean shading normal, unit
  Vec3 wo;                    // unit, towards the eye
  Rgb diffuse;                // albedo of what scatters evenly
  Rgb glossy;                 // albedo of rough reflections
  float alpha = 1.0f;         // their GGX roughness
  float transmission = 0.0f;  // albedo (luminance) of what scatters to the far side
};

/// Guess of f cos(theta) and of the density of BSDF sampling (per solid angle) for light from `wi`. `f_cos` is zero for
/// light from behind `side`, and positive for all other light that a surface with these albedos can scatter.
struct Response {
  Rgb f_cos;
  float pdf = 0.0f, glossy_pdf = 0.0f;  // the latter: its part by rough reflections
};
Response respond(const Receiver& receiver, Vec3 wi);

}  // namespace cistern
