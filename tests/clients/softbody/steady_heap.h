// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace tendon::softbody::testing {

/// What the program has asked for and not given back, bytes. A program that is linked with steady_heap.cc has a heap
/// whose calls always take as many instructions, whatever was asked for before: glibc's take more or fewer by a few
/// hundred.
std::size_t bytes_on_heap() noexcept;

}  // namespace tendon::softbody::testing
