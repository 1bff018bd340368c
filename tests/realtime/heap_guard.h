// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tendon {

/// Counts every heap call of the calling thread while it lives: malloc, calloc, realloc, free, their aligned forms
/// (aligned_alloc, posix_memalign, memalign), and everything that ends in them (new, delete, std::string …). Tests that
/// the haptic thread makes none.
///
/// Works by interposing glibc's malloc in this executable: link heap_guard.cc, not into sanitizer builds.
class HeapGuard {
 public:
  HeapGuard();
  ~HeapGuard();
  HeapGuard(const HeapGuard&) = delete;
  HeapGuard& operator=(const HeapGuard&) = delete;

  std::uint64_t calls() const;
};

}  // namespace tendon
