#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/check.h"

namespace cistern::binding {

/// The value whose name is given; throws Error that names the others.
template <class T>
T choice_of(const std::string& owner, const std::string& what, const std::string& given,
            const std::vector<std::pair<std::string, T>>& choices) {
  std::string names;
  for (const auto& [choice, value] : choices) {
    if (choice == given) return value;
    names += (names.empty() ? "" : ", ") + choice;
  }
  throw Error(owner, what + " '" + given + "' is none of " + names);
}

}  // namespace cistern::binding
