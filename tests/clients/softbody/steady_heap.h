// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace tendon::softbody::testing {

/// If steady_heap.cc is linked, the number of instructions of a heap call does not depend on previous calls. In glibc,
/// it varies by a few hundred.
std::size_t bytes_on_heap() noexcept;

}  // namespace tendon::softbody::testing
