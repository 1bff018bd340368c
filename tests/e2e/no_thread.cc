// SPDX-License-Identifier: Apache-2.0
// A library for LD_PRELOAD that lets the n-th call of pthread_create fail, where n is TENDON_REFUSED_THREAD.
#include <dlfcn.h>
#include <pthread.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>

extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*begin)(void*),
                              void* argument) {
  static std::atomic<int> calls{0};
  const char* const refused = std::getenv("TENDON_REFUSED_THREAD");  // NOLINT(concurrency-mt-unsafe): nobody sets it
  if (refused != nullptr && ++calls == std::atoi(refused)) return EAGAIN;
  const auto next = reinterpret_cast<decltype(&pthread_create)>(dlsym(RTLD_NEXT, "pthread_create"));
  return next(thread, attributes, begin, argument);
}
