// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/sweep/arithmetic.h"

#include <dlfcn.h>
#include <gnu/libc-version.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "tests/support/units.h"

namespace tendon::sweep {

std::string_view name_of(Arithmetic arithmetic) noexcept {
  return arithmetic == Arithmetic::kPortable ? "portable" : "native";
}

Arithmetic arithmetic_of(std::string_view name) {
  for (const Arithmetic one : {Arithmetic::kPortable, Arithmetic::kNative}) {
    if (name == name_of(one)) return one;
  }
  throw std::invalid_argument("arithmetic \"" + std::string(name) + "\": expected portable or native");
}

std::vector<std::string> environment_of(Arithmetic arithmetic) {
  // Sums depend on the number of threads.
  std::vector<std::string> environment = {"OPENBLAS_NUM_THREADS=1", "OMP_NUM_THREADS=1"};
  if (arithmetic == Arithmetic::kPortable) {
    environment.insert(environment.end(),
                       {"GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4", "OPENBLAS_CORETYPE=Nehalem"});
  }
  return environment;
}

Fingerprint fingerprint() {
  using Function = double (*)(double);
  constexpr std::array<Function, 12> kFunctions = {
      [](double x) { return std::sin(x); },         [](double x) { return std::cos(x); },
      [](double x) { return std::tan(x); },         [](double x) { return std::exp(x / 10); },
      [](double x) { return std::expm1(x / 10); },  [](double x) { return std::log(x + 101); },
      [](double x) { return std::log10(x + 101); }, [](double x) { return std::tanh(x / 10); },
      [](double x) { return std::atan2(x, 3.0); },  [](double x) { return std::pow(x + 101, 1.7); },
      [](double x) { return std::hypot(x, 0.7); },  [](double x) { return std::exp2(x / 10); },
  };
  constexpr int kCalls = 500;  // calls of each function
  UnitDigest digest;
  std::uint64_t number = 0;
  for (const Function function : kFunctions) {
    for (int i = 0; i < kCalls; ++i) {
      const volatile double x = 0.4 * i - 99.7;  // prevents constant folding
      const auto bits = std::bit_cast<std::array<char, sizeof(double)>>(function(x));
      digest.add(number++, {bits.data(), bits.size()});
    }
  }
  Fingerprint result{
      .c_library = std::string("glibc ") + gnu_get_libc_version(), .functions = digest.text(), .blas = "none"};
  if (void* const library = dlopen("libopenblas.so.0", RTLD_LAZY | RTLD_LOCAL)) {
    char* (*core)() = nullptr;
    void* const found = dlsym(library, "openblas_get_corename");
    std::memcpy(&core, &found, sizeof core);
    if (core != nullptr) result.blas = core();
  }
  return result;
}

}  // namespace tendon::sweep
