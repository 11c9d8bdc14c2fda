#include "binding/subdivision_arrays.h"

#include "binding/choice.h"

namespace cistern::binding {

SubdivisionArrays::SubdivisionArrays(const py::dict& members, const std::string& owner) {
  for (const auto& [key, value] : members) {
    const auto member = key.cast<std::string>();
    if (member == "scheme") {
      input.scheme = choice_of<SubdivisionScheme>(
          owner, "scheme", value.cast<std::string>(),
          {{"CATMULL_CLARK", SubdivisionScheme::CATMULL_CLARK}, {"LINEAR", SubdivisionScheme::LINEAR}});
    } else if (member == "uv_smoothing") {
      input.uv_smoothing =
          choice_of<UvSmoothing>(owner, "UV smoothing", value.cast<std::string>(),
                                 {{"NONE", UvSmoothing::NONE},
                                  {"CORNERS", UvSmoothing::CORNERS},
                                  {"CORNERS_AND_JUNCTIONS", UvSmoothing::CORNERS_AND_JUNCTIONS},
                                  {"CORNERS_JUNCTIONS_AND_CONCAVE", UvSmoothing::CORNERS_JUNCTIONS_AND_CONCAVE},
                                  {"BOUNDARIES", UvSmoothing::BOUNDARIES},
                                  {"ALL", UvSmoothing::ALL}});
    } else if (member == "keeps_corners") {
      input.keeps_corners = value.cast<bool>();
    } else if (member == "uv_maps") {
      input.uv_maps = value.cast<int>();
    } else if (member == "encoded_colors") {
      input.encoded_colors = value.cast<std::vector<std::string>>();
    } else if (member == "pixels") {
      input.pixels = value.cast<float>();
    } else if (member == "length") {
      input.length = value.cast<float>();
    } else if (member == "creases") {
      creases_ = value.cast<Array<int32_t>>();
      input.creases = {creases_.data(), 2 * checked_rows(creases_, 2, owner, "creases")};
    } else if (member == "crease_sharpness") {
      crease_sharpness_ = value.cast<Array<float>>();
      input.crease_sharpness = flat_span(crease_sharpness_, owner, "crease_sharpness");
    } else if (member == "sharp_vertices") {
      sharp_vertices_ = value.cast<Array<int32_t>>();
      input.sharp_vertices = flat_span(sharp_vertices_, owner, "sharp_vertices");
    } else if (member == "vertex_sharpness") {
      vertex_sharpness_ = value.cast<Array<float>>();
      input.vertex_sharpness = flat_span(vertex_sharpness_, owner, "vertex_sharpness");
    } else {
      throw Error(owner, "subdivision has no '" + member + "'");
    }
  }
}

}  // namespace cistern::binding
