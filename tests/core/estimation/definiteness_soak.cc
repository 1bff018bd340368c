// SPDX-License-Identifier: Apache-2.0
// This is a longer version of RecursiveLeastSquares.*StaysDefinite*. Use `nice definiteness_soak 100000000 --json` to
// run it. The result is in tests/tools/bench/RESULTS.md.
//
// Feeds nearly collinear regressors (s, s + 1e-4 r, 1), forgetting 0.999, p0 = 1e6, to the UD and the QR form in
// float32 and float64. After every step every D of P = U D Uᵀ must be positive (1/R² for the QR form), no sample
// refused, and the trace at most 3e6. The exit code is 1 if a check fails.
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <string_view>

#include "core/estimation/recursive_least_squares.h"
#include "tests/core/estimation/regressors.h"
#include "tests/support/plain_usage.h"

namespace {

struct Options {
  std::uint64_t steps = 100'000'000;
  bool json = false;
};

constexpr std::uint64_t kSeed = 7;

/// True if the covariance stayed definite and all samples were accepted.
template <class Estimator, class Scalar>
bool soak(const char* form, const char* scalar, const Options& options) {
  Estimator estimator({.forgetting = 0.999, .prior_variance = 1e6});
  const Eigen::Matrix<Scalar, 3, 1> truth(1, -2, Scalar(0.5));
  tendon::Dice dice(kSeed);
  const bool progress = ::isatty(STDERR_FILENO) == 1;
  double least = std::numeric_limits<double>::infinity();
  double largest_trace = 0;
  std::uint64_t refused = 0;
  for (std::uint64_t i = 0; i < options.steps; ++i) {
    const Eigen::Matrix<Scalar, 3, 1> phi = tendon::nearly_collinear<Scalar>(dice);
    refused += !estimator.observe(phi, phi.dot(truth));
    least = std::min(least, static_cast<double>(estimator.pivots().minCoeff()));
    largest_trace = std::max(largest_trace, static_cast<double>(estimator.trace()));
    if (progress && i % 1'000'000 == 0) {
      std::fprintf(stderr, "\r%s %s: %llu of %llu", form, scalar, static_cast<unsigned long long>(i),
                   static_cast<unsigned long long>(options.steps));
    }
  }
  if (progress) std::fprintf(stderr, "\r\x1b[K");
  const bool definite = least > 0 && refused == 0;
  const char* const format = options.json
                                 ? "{\"form\":\"%s\",\"scalar\":\"%s\",\"n\":%llu,\"seed\":%llu,\"least_d\":%.6g,"
                                   "\"largest_trace\":%.6g,\"refused\":%llu,\"result\":\"%s\"}\n"
                                 : "%s %s: n = %llu, seed %llu, least D %.6g, largest trace %.6g, refused %llu: %s\n";
  std::printf(format, form, scalar, static_cast<unsigned long long>(options.steps),
              static_cast<unsigned long long>(kSeed), least, largest_trace, static_cast<unsigned long long>(refused),
              definite ? "definite" : "not definite");
  std::fflush(stdout);
  return definite;
}

}  // namespace

int main(int argc, char** argv) {
  const tendon::PlainUsage usage{
      .help =
          "Usage: definiteness_soak [STEPS] [--json]\n\n"
          "Feeds STEPS (default 100000000) nearly collinear samples to each form of recursive least\n"
          "squares and says whether its covariance stayed positive definite.\n\n"
          "Example: definiteness_soak 1000000 --json\n"
          "Exit: 0 each stayed definite; 1 one did not; 2 wrong usage.\n",
      .most_arguments = 1,
      .options = {"--json"}};
  if (const auto code = tendon::answer(usage, argc, argv)) return *code;
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--json") {
      options.json = true;
      continue;
    }
    const char* const end = argument.data() + argument.size();
    const auto [rest, error] = std::from_chars(argument.data(), end, options.steps);
    if (error != std::errc() || rest != end || options.steps == 0) {
      std::fprintf(stderr, "STEPS: expected a whole number above 0, got %s\n\n%s", argv[i], usage.help);
      return 2;
    }
  }
  using tendon::UdLeastSquares;
  bool definite = soak<UdLeastSquares<3, float>, float>("UD", "float32", options);
  definite &= soak<UdLeastSquares<3, double>, double>("UD", "float64", options);
  return definite ? 0 : 1;
}
