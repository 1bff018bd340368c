// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/netem.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace tendon::lab::netem_test {
namespace {

TEST(Netem, UncorrelatedNumbersAreUniformAndCorrelatedOnesAreTooNarrow) {
  for (const double rho : {0.0, 0.25, 0.5, 0.9}) {
    NetemRandom random(rho, 1);
    std::vector<double> x(100'000);
    for (auto& value : x) value = random.next() * 0x1p-32;
    const double mean = std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
    double variance = 0;
    for (const double value : x) variance += (value - mean) * (value - mean) / static_cast<double>(x.size());
    EXPECT_NEAR(variance / ((1 - rho) / (1 + rho) / 12), 1, 0.05) << rho;
  }
}

TEST(Netem, TheFigureNeedsEnoughToCount) {
  std::ostringstream out;
  EXPECT_THROW(netem({.count = 10}, out), std::invalid_argument);
}

TEST(Netem, TheInjectorLosesWhatItIsAskedForAndNetemDoesNot) {
  std::ostringstream out;
  netem({.count = 20'000, .json = true}, out);
  const std::string line = out.str();
  const auto at = line.find(R"("loss_asked":0.1,"correlation_asked":0.5)");
  ASSERT_NE(at, std::string::npos);
  const auto value = [&](const std::string& key) {
    return std::stod(line.substr(line.find(key, at) + key.size() + 2));
  };
  EXPECT_LT(value("netem_loss"), 0.003);
  EXPECT_NEAR(value("inject_loss"), 0.1, 0.02);
}

}  // namespace
}  // namespace tendon::lab::netem_test
