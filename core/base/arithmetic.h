// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

/// Rejects -ffast-math at compile time. Must be included where NaN is caught or rounding errors are corrected.

// With -ffast-math, std::isfinite(NaN) is true, clamping NaN to ±5 N gives −5 N, and a compensated sum becomes a plain
// sum. GCC reports all of its options by __GCC_IEC_559, Clang only -ffast-math and -ffinite-math-only.
#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ != 0) || \
    (defined(__GCC_IEC_559) && __GCC_IEC_559 == 0)
#error \
    "Tendon is not built with -ffast-math or a part of it: a NaN would pass every check and reach the hand as a force"
#endif

namespace tendon {

/// If an object of this class exists, denormals (numbers below 2.2e-308) are treated as 0 by this thread, both as
/// operands and as results. Otherwise, decaying forces and velocities become denormal, which makes arithmetic a hundred
/// times slower on x86-64. Create one in each step rather than one per thread, because a driver or a library that is
/// loaded later can change the mode. The destructor restores the mode. x86-64 and AArch64; no effect elsewhere.
/// Realtime-safe: yes.
class [[nodiscard]] DenormalsOff {
 public:
  DenormalsOff() noexcept : before_(mode()) { set_mode(before_ | kFlush); }
  ~DenormalsOff() { set_mode(before_); }
  DenormalsOff(const DenormalsOff&) = delete;
  DenormalsOff& operator=(const DenormalsOff&) = delete;

#if defined(__x86_64__)
  using Mode = std::uint32_t;
  static constexpr Mode kFlush = 0x8040;  ///< MXCSR: FTZ (results) and DAZ (operands)
  static Mode mode() noexcept { return __builtin_ia32_stmxcsr(); }
  static void set_mode(Mode mode) noexcept { __builtin_ia32_ldmxcsr(mode); }
#elif defined(__aarch64__)
  using Mode = std::uint64_t;
  static constexpr Mode kFlush = 1U << 24U;  ///< FPCR: FZ (both)
  static Mode mode() noexcept {
    Mode mode = 0;
    asm volatile("mrs %0, fpcr" : "=r"(mode));
    return mode;
  }
  static void set_mode(Mode mode) noexcept { asm volatile("msr fpcr, %0" : : "r"(mode)); }
#else
  using Mode = std::uint32_t;
  static constexpr Mode kFlush = 0;
  static Mode mode() noexcept { return 0; }
  static void set_mode(Mode) noexcept {}
#endif

 private:
  Mode before_;
};

}  // namespace tendon
