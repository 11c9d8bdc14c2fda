#include <array>

#include "base/check.h"
#include "scene/material_program.h"

namespace cistern {
namespace {

// Inputs: f float, c colour, v vector. Comments: inputs in order -> output; [static parameters].
// Enum parameters are positions in the lists given here; the add-on's tables (addon/sync/nodes) follow them.
// clang-format off
constexpr std::array<OpDescription, static_cast<size_t>(Op::COUNT)> kOps{{
    // Coordinates: [shift] last everywhere.
    {"ATTRIBUTE", "", 'v', 2, false},              // [name index, shift]: UV maps give (u, v, 0), colours rgb
    {"ATTRIBUTE_FACTOR", "", 'f', 2, false},       // the same: the mean of three numbers, the first of two
    {"ATTRIBUTE_ALPHA", "", 'f', 3, false},        // [name index, alpha of a mesh without it (0 or 1), shift]
    {"GENERATED", "", 'v', 1, false},              // [shift]: mesh bounds mapped to [0,1]; world: the direction
    {"OBJECT_COORDINATE", "", 'v', 1, false},      // [shift]: object space position
    {"NORMAL_COORDINATE", "", 'v', 1, false},      // [shift]: object space shading normal
    {"REFLECTION_COORDINATE", "", 'v', 1, false},  // [shift]: world direction of mirror reflection
    {"CAMERA_COORDINATE", "", 'v', 1, false},      // [shift]: camera space, +z forward, as Blender's Camera output
    {"WINDOW_COORDINATE", "", 'v', 1, false},      // [shift]: (s, t, 0) on the full frame
    {"POSITION", "", 'v', 1, false},               // [shift]: world space
    {"NORMAL", "", 'v', 0, false},                 // shading normal, world, facing wo
    {"TRUE_NORMAL", "", 'v', 0, false},            // geometric normal, world, facing wo
    {"TANGENT", "", 'v', 1, false},                // [name index of the UV map]: world dP/du, by the transform of normals
    {"STRAND_TANGENT", "", 'v', 1, false},         // unit, along the strand; [on meshes from corner 0 to: 0 corner 1, 1 corner 2]
    {"INCOMING", "", 'v', 0, false},               // wo
    {"BACKFACING", "", 'f', 0, false},             // 0 or 1
    {"OBJECT_RANDOM", "", 'f', 0, false},          //
    {"OBJECT_LOCATION", "", 'v', 0, false},        //
    {"INSTANCE_VALUE", "", 'v', 1, false},         // [name index]: of Scene::instance_values; 0 where there is none
    {"INSTANCE_VALUE_ALPHA", "", 'f', 1, false},   // [name index]
    {"GRID_FACTOR", "", 'v', 1, false},            // [name index]: ATTRIBUTE inside of a volume object; 1 where it lacks it
    // [output]: 0 is camera, 1 is shadow, 2 is diffuse, 3 is glossy, 4 is singular, 5 is reflection, 6 is transmission,
    // 7 ray length, 8 ray depth, 9 diffuse depth, 10 glossy depth, 11 transparent depth, 12 transmission depth, 13 is volume scatter
    {"LIGHT_PATH", "", 'f', 1, false},
    // Conversions.
    {"BROADCAST", "f", 'c', 0, false},   // float -> colour or vector, all components equal
    {"LUMINANCE", "c", 'f', 0, false},   // colour -> float (Rec. 709)
    {"AVERAGE", "v", 'f', 0, false},     // vector -> float
    {"ENCODE_COLOR", "c", 'v', 0, false},  // colour <-> vector: a no-op that changes the type
    // Arithmetic. MATH [operation, clamp]: 0 ADD 1 SUBTRACT 2 MULTIPLY 3 DIVIDE 4 MULTIPLY_ADD 5 POWER 6 LOGARITHM 7 SQRT
    // 8 INVERSE_SQRT 9 ABSOLUTE 10 EXPONENT 11 MINIMUM 12 MAXIMUM 13 LESS_THAN 14 GREATER_THAN 15 SIGN 16 COMPARE
    // 17 SMOOTH_MIN 18 SMOOTH_MAX 19 ROUND 20 FLOOR 21 CEIL 22 TRUNC 23 FRACT 24 MODULO 25 FLOORED_MODULO 26 WRAP 27 SNAP
    // 28 PINGPONG 29 SINE 30 COSINE 31 TANGENT 32 ARCSINE 33 ARCCOSINE 34 ARCTANGENT 35 ARCTAN2 36 SINH 37 COSH 38 TANH
    // 39 RADIANS 40 DEGREES
    {"MATH", "fff", 'f', 2, false},
    // Of whole parts. [operation]: 0 ADD 1 SUBTRACT 2 MULTIPLY 3 DIVIDE 4 MULTIPLY_ADD 5 ABSOLUTE 6 NEGATE 7 POWER 8 MINIMUM
    // 9 MAXIMUM 10 SIGN 11 DIVIDE_ROUND 12 DIVIDE_FLOOR 13 DIVIDE_CEIL 14 FLOORED_MODULO 15 MODULO 16 GCD 17 LCM
    {"INTEGER_MATH", "fff", 'f', 1, false},
    // [operation]: 0 ADD 1 SUBTRACT 2 MULTIPLY 3 DIVIDE 4 MULTIPLY_ADD 5 CROSS_PRODUCT 6 PROJECT 7 REFLECT 8 REFRACT 9 FACEFORWARD
    // 10 SCALE 11 NORMALIZE 12 ABSOLUTE 13 MINIMUM 14 MAXIMUM 15 FLOOR 16 CEIL 17 FRACTION 18 MODULO 19 WRAP 20 SNAP
    // 21 SINE 22 COSINE 23 TANGENT 24 POWER 25 SIGN; fourth input: scale
    {"VECTOR_MATH", "vvvf", 'v', 1, false},
    {"VECTOR_MATH_VALUE", "vv", 'f', 1, false},  // [operation]: 0 DOT_PRODUCT 1 DISTANCE 2 LENGTH (of the first)
    {"MIX_FLOAT", "fff", 'f', 1, false},         // factor, a, b; [clamp factor]
    {"MIX_VECTOR", "vvv", 'v', 1, false},        // factor per component, a, b; [clamp factor]
    // factor, a, b; [blend, clamp factor, clamp result]: 0 MIX 1 DARKEN 2 MULTIPLY 3 BURN 4 LIGHTEN 5 SCREEN 6 DODGE 7 ADD 8 OVERLAY
    // 9 SOFT_LIGHT 10 LINEAR_LIGHT 11 DIFFERENCE 12 EXCLUSION 13 SUBTRACT 14 DIVIDE 15 HUE 16 SATURATION 17 COLOR 18 VALUE
    {"MIX_COLOR", "fcc", 'c', 3, false},
    {"CLAMP", "fff", 'f', 1, false},        // value, min, max; [0 MINMAX, 1 RANGE]
    // value, from min, from max, to min, to max, steps; [0 LINEAR 1 STEPPED 2 SMOOTHSTEP 3 SMOOTHERSTEP, clamp]
    {"MAP_RANGE", "ffffff", 'f', 2, false},
    {"COMBINE_XYZ", "fff", 'v', 0, false},  // also RGB: colour and vector share registers
    {"SEPARATE_X", "v", 'f', 0, false},
    {"SEPARATE_Y", "v", 'f', 0, false},
    {"SEPARATE_Z", "v", 'f', 0, false},
    // Colour.
    {"INVERT", "fc", 'c', 0, false},           // factor, colour
    {"GAMMA", "cf", 'c', 0, false},            // colour, gamma
    {"BRIGHT_CONTRAST", "cff", 'c', 0, false}, // colour, bright, contrast
    {"HUE_SATURATION", "cffff", 'c', 0, false},  // colour, hue, saturation, value, factor
    {"RGB_TO_HSV", "c", 'c', 0, false},
    {"HSV_TO_RGB", "c", 'c', 0, false},
    {"RGB_TO_HSL", "c", 'c', 0, false},
    {"HSL_TO_RGB", "c", 'c', 0, false},
    {"BLACKBODY", "f", 'c', 0, false},         // kelvin -> linear Rec. 709 colour of luminance about 1
    {"WAVELENGTH", "f", 'c', 0, false},        // nm -> linear Rec. 709 colour of a spectral line, channels up to 1 and below 0
    {"CURVE_LOOKUP", "fcff", 'c', 1, false},   // factor, colour, min x, max x; [table]: per channel, extrapolated linearly
    {"RAMP_LOOKUP", "f", 'c', 2, false},       // [table, 1 = constant steps (no interpolation)]
    {"RAMP_LOOKUP_ALPHA", "f", 'f', 2, false}, // [table, 1 = constant steps]
    // Vectors.
    {"MAPPING", "vvvv", 'v', 1, false},        // vector, location, rotation (XYZ Euler), scale; [0 POINT 1 TEXTURE 2 VECTOR 3 NORMAL]
    // colour, strength -> world normal facing wo; [space: 0 TANGENT 1 OBJECT 2 WORLD, name index of the UV map, 1 = DirectX green,
    // 1 = in tangents of what was there before displacement]
    {"NORMAL_MAP", "cfv", 'v', 4, false},
    // height, height at +dx, height at +dy (steps 1 and 2), strength, distance, normal; [invert, shift of any step] -> world normal facing wo
    {"BUMP", "fffffv", 'v', 2, false},
    {"VECTOR_TRANSFORM", "v", 'v', 3, false},  // [kind 0 POINT 1 VECTOR 2 NORMAL, from, to: 0 WORLD 1 OBJECT 2 CAMERA]
    // vector, centre, axis, angle, Euler angles; [0 AXIS_ANGLE 1 X 2 Y 3 Z 4 EULER_XYZ, invert]
    {"VECTOR_ROTATE", "vvvfv", 'v', 2, false},
    // Shading helpers.
    {"FRESNEL", "fv", 'f', 0, false},              // ior, normal
    {"LAYER_WEIGHT_FRESNEL", "fv", 'f', 0, false}, // blend, normal
    {"LAYER_WEIGHT_FACING", "fv", 'f', 0, false},  // blend, normal
    {"WIREFRAME", "f", 'f', 2, false},              // width of a line; [whether in pixels, else metres; shift]: 1 within half of
                                                   // it from an edge of a triangle, else 0
    // Both trace rays, and where there is nothing to trace them in (environment, lamps, media, displacement) return
    // 1 or the normal. AMBIENT_OCCLUSION: distance (nothing is met up to one of 0), normal; [rays, inside: of the other
    // side, only of the object itself]. BEVEL: radius, shading normal to return where there is no other; [rays].
    {"AMBIENT_OCCLUSION", "fv", 'f', 3, false},
    {"BEVEL", "fv", 'v', 1, false},
    // The same, of a ray that meets nothing there: from a place in a direction, up to that many times the direction's
    // length; [0 = whether something is met, whether that is the object itself, how often the direction's length away,
    // 1 = shading normal there, towards the ray; only of the object itself; shift].
    {"RAYCAST", "vvf", 'v', 3, false},
    // Textures.
    // vector, shading normal for BOX; [image index, interpolation: 0 LINEAR 1 CLOSEST 2 CUBIC, extension: 0 REPEAT 1 EXTEND 2 CLIP 3 MIRROR,
    // projection: 0 FLAT 2 SPHERE 3 TUBE; 1 BOX with the blend factor in percent in bits 8 to 15;
    // bit 16: the colour stays multiplied by alpha]
    {"IMAGE", "vv", 'c', 4, false},
    {"IMAGE_ALPHA", "vv", 'f', 4, false},
    // The same, parameter 0 is the index of a table of tiles. As in Cycles, the tile is that of the
    // coordinates cut to whole numbers, 1001 + u + 10 v: what reaches up to 1 below 0 still belongs to the tiles at 0.
    {"TILED_IMAGE", "vv", 'c', 4, false},
    {"TILED_IMAGE_ALPHA", "vv", 'f', 4, false},
    // direction; [image index, interpolation, 0 EQUIRECTANGULAR 1 MIRROR_BALL 2 HORIZON: equirectangular with rows that
    // are dense where z = 0: v = 1/2 + sign(e) sqrt(|e| / 2 pi) for the elevation e, nothing repeats up and down]
    {"ENVIRONMENT_IMAGE", "v", 'c', 3, false},
    // direction, colour of the sky, direction of the sun, (half angle, elevation of its bottom, of its top), radiance at its
    // bottom, at its top, elevation of the horizon; [1: the disc hides the sky, 0: it is added]
    {"SUN_DISC", "vcvvccf", 'c', 1, false},
    {"CHECKER", "vccf", 'c', 0, false},          // vector, colour 1, colour 2, scale
    {"CHECKER_FACTOR", "vf", 'f', 0, false},     // vector, scale
    {"GRADIENT", "v", 'f', 1, false},            // [0 LINEAR 1 QUADRATIC 2 EASING 3 DIAGONAL 4 RADIAL 5 QUADRATIC_SPHERE 6 SPHERICAL]
    // vector, w, scale, detail, roughness, lacunarity, offset, gain, distortion; [dimensions 1..4, normalize,
    // type 0 FBM 1 MULTIFRACTAL 2 HYBRID_MULTIFRACTAL 3 RIDGED_MULTIFRACTAL 4 HETERO_TERRAIN]
    {"NOISE", "vffffffff", 'f', 3, false},
    {"NOISE_COLOR", "vffffffff", 'c', 3, false},
    // vector, w, scale, detail, roughness, lacunarity, smoothness, exponent, randomness; [dimensions 1..4, metric 0 EUCLIDEAN
    // 1 MANHATTAN 2 CHEBYCHEV 3 MINKOWSKI, feature 0 F1 1 F2 2 SMOOTH_F1 3 DISTANCE_TO_EDGE 4 N_SPHERE_RADIUS, bits: 1 normalize, 2 old cells]
    {"VORONOI_DISTANCE", "vffffffff", 'f', 4, false},
    {"VORONOI_COLOR", "vffffffff", 'c', 4, false},
    {"VORONOI_POSITION", "vffffffff", 'v', 4, false},
    // vector, scale, distortion, detail, detail scale, detail roughness, phase; [type 0 BANDS 1 RINGS, direction 0 X 1 Y 2 Z
    // 3 DIAGONAL / SPHERICAL, profile 0 SIN 1 SAW 2 TRI]
    {"WAVE", "vffffff", 'f', 3, false},
    {"WHITE_NOISE", "vf", 'f', 1, false},        // vector, w; [dimensions 1..4]
    {"WHITE_NOISE_COLOR", "vf", 'c', 1, false},
    // vector, colour 1, colour 2, mortar colour, scale, mortar size, mortar smooth, bias, brick width, row height;
    // [offset in 1/1000, offset frequency, squash in 1/1000, squash frequency]
    {"BRICK", "vcccffffff", 'c', 4, false},
    {"BRICK_FACTOR", "vcccffffff", 'f', 4, false},
    {"MAGIC", "vff", 'c', 2, false},             // vector, scale, distortion; [depth, 1 = wrapped around after it is scaled]
    // vector, scale, frequency, anisotropy, angle of the 2D orientation, 3D orientation; [0 2D 1 3D, 0 value 1 phase 2 intensity]
    {"GABOR", "vffffv", 'f', 2, false},
    {"RADIAL_TILING", "vff", 'v', 1, false},        // vector, sides, roundness -> (along a side, across, 0); [normalize]
    {"RADIAL_TILING_VALUE", "vff", 'f', 1, false},  // [0 number of the side, 1 its half width, 2 its rotation]
    // Closures: weight first. Normals are world space facing wo; an unlinked one is the NORMAL register.
    // weight, 1 base colour c, 2 metallic, 3 roughness, 4 ior, 5 alpha, 6 normal v, 7 diffuse roughness, 8 subsurface weight,
    // 9 specular ior level, 10 specular tint c, 11 anisotropic, 12 anisotropic rotation, 13 tangent v, 14 transmission weight,
    // 15 coat weight, 16 coat roughness, 17 coat ior, 18 coat tint c, 19 coat normal v, 20 sheen weight, 21 sheen roughness,
    // 22 sheen tint c, 23 emission colour c, 24 emission strength, 25 subsurface radius v, 26 subsurface scale, 27 subsurface ior,
    // 28 subsurface anisotropy, 29 thin film thickness in nm, 30 its ior, 31 dispersion: inverse Abbe number;
    // [1 = multiple-scattering GGX, 0 = plain GGX; SubsurfaceMethod; bits: 1 the film covers metal too, 2 glass is anisotropic too,
    // 4 rough diffuse reflection is dim, 8 coats dim and tint as in Blender 5.3; 1 = thin walls, 2 = such as spread what passes them as in Blender 5.2]
    {"CLOSURE_PRINCIPLED", "fcffffvfffcffvffffcvffccfvffffff", 0, 4, true},
    {"CLOSURE_DIFFUSE", "fcfv", 0, 1, true},          // weight, colour, roughness, normal; [1 = dim as before Blender 5.3]
    // weight, colour, roughness, anisotropy, rotation, normal, tangent; [distribution: 0 GGX 1 MULTI_GGX 2 BECKMANN 3 ASHIKHMIN_SHIRLEY]
    {"CLOSURE_GLOSSY", "fcfffvv", 0, 1, true},
    // weight, colour, roughness, ior, normal, thin film thickness in nm, its ior, anisotropy, rotation, tangent; [distribution]
    {"CLOSURE_GLASS", "fcffvffffv", 0, 1, true},
    {"CLOSURE_REFRACTION", "fcffv", 0, 1, true},      // weight, colour, roughness, ior, normal; [distribution]
    {"CLOSURE_TRANSLUCENT", "fcv", 0, 0, true},       // weight, colour, normal
    {"CLOSURE_TRANSPARENT", "fc", 0, 0, true},        // weight, colour
    {"CLOSURE_EMISSION", "fcf", 0, 0, true},          // weight, colour, strength
    {"CLOSURE_SHEEN", "fcfv", 0, 1, true},            // weight, colour, roughness, normal; [0 MICROFIBER 1 ASHIKHMIN]
    // weight, base colour, edge tint, roughness, anisotropy, rotation, normal, tangent, thin film thickness in nm, its ior;
    // [distribution; 1: of a conductor, the colours are the parts n and k of its index n + ik]
    {"CLOSURE_METALLIC", "fccfffvvff", 0, 2, true},
    {"CLOSURE_SUBSURFACE", "fcvffffv", 0, 1, true},   // weight, colour, radius, scale, ior, roughness, anisotropy, normal; [SubsurfaceMethod]
    {"CLOSURE_TOON", "fcffv", 0, 1, true},            // weight, colour, size, smooth, normal; [0 DIFFUSE 1 GLOSSY]
    // weight, tangent, colour, melanin, melanin redness, tint, absorption, roughness, radial roughness, coat, ior, tilt of scales;
    // [0 ABSORPTION 1 MELANIN, with the tint, 2 COLOR]
    {"CLOSURE_HAIR", "fvcffccfffff", 0, 1, true},
    // weight, tangent, major axis, colour, melanin, melanin redness, tint, absorption, roughness, aspect ratio, ior, tilt of scales, factors of
    // what is reflected, passes, and is reflected inside; [as CLOSURE_HAIR]
    {"CLOSURE_MICROFACET_HAIR", "fvvcffccfffffff", 0, 1, true},
    {"CLOSURE_SIMPLE_HAIR", "fvcfff", 0, 1, true},    // weight, tangent, colour, roughness along and across, offset; [1 = what passes]
    {"CLOSURE_HOLDOUT", "f", 0, 0, true},             // weight
    {"CLOSURE_RAY_PORTAL", "fcvv", 0, 0, true},       // weight, colour, position, direction (zero: straight on)
    {"CLOSURE_NORMAL", "fv", 0, 0, true},             // weight 1, normal
    {"CLOSURE_AOV", "fcf", 0, 1, true},               // weight 1, colour, value; [name index]
    // weight, scattering colour, absorption colour, density in 1/m that multiplies both, anisotropy, or of MIE the diameter in micrometres
    // and of FOURNIER_FORAND the ior; of DRAINE alpha, and of FOURNIER_FORAND the backscattered fraction; [Phase]
    {"CLOSURE_VOLUME", "fccfff", 0, 1, true},
    {"CLOSURE_VOLUME_EMISSION", "fcf", 0, 0, true},   // weight, colour, strength: radiance per metre
    {"CLOSURE_DISPLACEMENT", "fv", 0, 1, true},       // weight 1, world space vector; [1: normals are not made anew]
    {"CLOSURE_DISPLACED_BUMP", "ffff", 0, 1, true},   // weight 1, heights at steps 0, 1, 2; [shift]
}};
// clang-format on

}  // namespace

const OpDescription& describe(Op op) { return kOps[static_cast<size_t>(op)]; }

Op find_op(const std::string& name, const std::string& program_name) {
  for (size_t i = 0; i < kOps.size(); ++i)
    if (name == kOps[i].name) return static_cast<Op>(i);
  throw Error(program_name, "unknown operation '" + name + "' in the material program");
}

}  // namespace cistern
