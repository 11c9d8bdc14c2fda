#pragma once

#include <string>

namespace cistern {

/// Path of the shared library (or program) whose `function` this process calls; empty when it cannot be told.
/// Several libraries in Blender's process may define the same names: this says which of them answers.
std::string library_of(const void* function);

}  // namespace cistern
