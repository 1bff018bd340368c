// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/selftest/traffic.h"

namespace tendon::injector {

std::vector<double> delays(const Profile& profile, const Traffic& traffic, const SelftestOptions& options) {
  std::vector<double> result;
  result.reserve(options.count);
  play(profile, traffic, options,
       [&](std::size_t, const Decision& decision) { result.push_back(ns(delay(decision))); });
  return result;
}

}  // namespace tendon::injector
