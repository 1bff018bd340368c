// SPDX-License-Identifier: Apache-2.0
#include "tests/realtime/heap_guard.h"

#include <bit>
#include <cerrno>
#include <cstddef>

// The allocator of glibc under the names that are not replaced here.
extern "C" {
void* __libc_malloc(std::size_t size);                           // NOLINT(readability-identifier-naming)
void* __libc_calloc(std::size_t count, std::size_t size);        // NOLINT(readability-identifier-naming)
void* __libc_realloc(void* block, std::size_t size);             // NOLINT(readability-identifier-naming)
void* __libc_memalign(std::size_t alignment, std::size_t size);  // NOLINT(readability-identifier-naming)
void __libc_free(void* block);                                   // NOLINT(readability-identifier-naming)
}

namespace {

thread_local bool counting = false;
thread_local std::uint64_t calls = 0;

void count() noexcept {
  if (counting) ++calls;
}

}  // namespace

extern "C" {

void* malloc(std::size_t size) {
  count();
  return __libc_malloc(size);
}
void* calloc(std::size_t number, std::size_t size) {
  count();
  return __libc_calloc(number, size);
}
void* realloc(void* block, std::size_t size) {
  count();
  return __libc_realloc(block, size);
}
void free(void* block) {
  count();
  __libc_free(block);
}
// The aligned form of operator new calls one of the following functions.
void* memalign(std::size_t alignment, std::size_t size) {
  count();
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  count();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  count();
  if (!std::has_single_bit(alignment) || alignment % sizeof(void*) != 0) return EINVAL;
  void* const made = __libc_memalign(alignment, size);
  if (made == nullptr) return ENOMEM;
  *block = made;
  return 0;
}

}  // extern "C"

namespace tendon {

HeapGuard::HeapGuard() {
  ::calls = 0;
  ::counting = true;
}
HeapGuard::~HeapGuard() { ::counting = false; }
std::uint64_t HeapGuard::calls() const { return ::calls; }

}  // namespace tendon
