#include "base/shared_library.h"

#include <dlfcn.h>

namespace cistern {

std::string library_of(const void* function) {
  Dl_info found = {};
  return dladdr(function, &found) != 0 && found.dli_fname ? found.dli_fname : "";
}

}  // namespace cistern
