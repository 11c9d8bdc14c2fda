#pragma once

#include <stdexcept>
#include <string>

namespace cistern {

/// Bad input: names the object (a Blender data-block where there is one), the offending value and what is
/// allowed. The binding raises it as `cistern_core.Error`. Programmer mistakes use `assert` instead.
class Error : public std::runtime_error {
 public:
  Error(const std::string& object_name, const std::string& what_is_wrong)
      : std::runtime_error(object_name + ": " + what_is_wrong) {}
};

}  // namespace cistern
