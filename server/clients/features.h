// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/messages.h"

namespace tendon {

class Features {
 public:
  /// The optional features of this server. The order determines the bits.
  static constexpr std::array kSupported = {
      kFeatureLocalModel,    kFeatureChannels, kFeatureDiagnostics,  kFeatureHandle, kFeatureJoints,
      kFeatureTeleoperation, kFeatureOutputs,  kFeatureStateColumns, kFeatureWays,   kFeatureFields};

  Features() = default;
  explicit Features(const std::vector<std::string>& names) {
    for (std::size_t i = 0; i < kSupported.size(); ++i) {
      if (std::ranges::find(names, kSupported[i]) != names.end()) bits_ |= 1U << i;
    }
  }

  template <const std::string_view& feature>
  bool has() const noexcept {
    constexpr auto kPlace = static_cast<std::size_t>(std::ranges::find(kSupported, feature) - kSupported.begin());
    static_assert(kPlace < kSupported.size());
    return (bits_ >> kPlace & 1U) != 0;
  }

 private:
  std::uint32_t bits_ = 0;
};

}  // namespace tendon
