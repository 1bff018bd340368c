// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tendon::sweep {

// The C library picks sin, exp, pow … by the processor, and OpenBLAS its kernels: with and without fused multiply-adds
// their last bits differ. Shards that are to be compared byte by byte run with the same arithmetic.

enum class Arithmetic : std::uint8_t {
  kPortable,  ///< that of the oldest x86-64 processor, on any of them
  kNative,    ///< that of the node: for nodes of one kind
};

/// "portable", "native".
std::string_view name_of(Arithmetic arithmetic) noexcept;
/// Throws std::invalid_argument for any other name.
Arithmetic arithmetic_of(std::string_view name);

/// What a program's environment has to have beside what is there, NAME=value.
std::vector<std::string> environment_of(Arithmetic arithmetic);

/// By what the numbers of a process can be told.
struct Fingerprint {
  std::string c_library;  ///< "glibc 2.36"
  std::string functions;  ///< hash of the results of some thousand calls of the functions that are used here
  std::string blas;       ///< OpenBLAS' core; "none" where it is not installed

  bool operator==(const Fingerprint&) const = default;
};

/// Of this process.
Fingerprint fingerprint();

}  // namespace tendon::sweep
