// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace tendon::softbody::testing {

/// Allocated bytes. In a program that links steady_heap.cc, every heap call takes the same number of instructions,
/// whatever was allocated before. With glibc it varies by a few hundred.
std::size_t bytes_on_heap() noexcept;

}  // namespace tendon::softbody::testing
