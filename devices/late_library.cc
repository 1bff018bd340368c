// SPDX-License-Identifier: Apache-2.0
#include "devices/late_library.h"

#include <dlfcn.h>

#include <stdexcept>

namespace tendon {

LateLibrary::LateLibrary(const std::string& file) {
  // RTLD_GLOBAL is used as if it was linked. RTLD_NOW, because symbols must not be resolved by a realtime thread.
  if (dlopen(file.c_str(), RTLD_NOW | RTLD_GLOBAL) != nullptr) return;
  const char* const why = dlerror();  // NOLINT(concurrency-mt-unsafe): the C library has one for each thread
  throw std::runtime_error(std::string(why) + "; is the package installed?");
}

LateLibrary::Function LateLibrary::operator[](const char* name) const {
  if (void* const found = dlsym(RTLD_DEFAULT, name); found != nullptr) return Function(found);
  throw std::runtime_error(dlerror());  // NOLINT(concurrency-mt-unsafe): the C library has one for each thread
}

}  // namespace tendon
