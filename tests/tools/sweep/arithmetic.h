// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tendon::sweep {

// The C library selects sin, exp, pow … and OpenBLAS its kernels by processor; results with and without fused
// multiply-add differ in their last bits. Shards that are compared byte by byte must use the same arithmetic.

enum class Arithmetic : std::uint8_t {
  kPortable,  ///< reproducible: the baseline x86-64 instructions on every processor
  kNative,    ///< the arithmetic of the node, for nodes of the same kind
};

std::string_view name_of(Arithmetic arithmetic) noexcept;
/// Throws std::invalid_argument for any other name.
Arithmetic arithmetic_of(std::string_view name);

/// Returns the environment variables (NAME=value) to add for a program.
std::vector<std::string> environment_of(Arithmetic arithmetic);

struct Fingerprint {
  std::string c_library;  ///< "glibc 2.36"
  std::string functions;  ///< hash of the results of some thousand calls of math functions
  std::string blas;       ///< OpenBLAS core; "none" if OpenBLAS is not installed

  bool operator==(const Fingerprint&) const = default;
};

Fingerprint fingerprint();

}  // namespace tendon::sweep
