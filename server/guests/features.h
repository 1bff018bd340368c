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

/// A set of the features that a session uses (protocol/messages.h). It has one bit for each feature.
class Features {
 public:
  /// The optional features that this server supports. Their order determines the bits.
  static constexpr std::array kSupported = {kFeatureLocalModel, kFeatureChannels,     kFeatureDiagnostics,
                                            kFeatureHandle,     kFeatureJoints,       kFeatureTeleoperation,
                                            kFeatureOutputs,    kFeatureStateColumns, kFeatureWays};

  Features() = default;
  /// Ignores the names of unknown features.
  explicit Features(const std::vector<std::string>& names) {
    for (std::size_t i = 0; i < kSupported.size(); ++i) {
      if (std::ranges::find(names, kSupported[i]) != names.end()) bits_ |= 1U << i;
    }
  }

  /// Realtime-safe: yes.
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
