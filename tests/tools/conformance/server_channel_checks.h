// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tests/tools/conformance/server_guest.h"

namespace tendon::conformance {

/// For a server with the feature "channels"; otherwise not applicable. check_claims() must be first, because it detects
/// the feature.
class ChannelChecks {
 public:
  explicit ChannelChecks(ServerGuest& guest) : guest_(guest) {}

  /// No client may control the device. The handshakes are not completed, so that the device is free afterwards.
  void check_claims();
  /// The observer has not claimed the channel as a controller. `id`: its next request.
  void check_from_outside(Conversation& observer, std::uint32_t id);
  /// Returns a session that has claimed by name and requested the features for check_coupling(). `id`: its newest
  /// request.
  std::optional<ServerGuest::Session> check_channels(std::uint32_t& id);
  void check_reports(const Conversation& talk);

 private:
  pb::Hello claiming(const std::vector<pb::Claim>& claims) const;
  void check_description(Conversation& talk, const pb::Welcome& welcome, std::uint32_t& id);
  void check_lease(Conversation& talk, std::uint32_t& id);
  void check_deadband(Conversation& talk, const pb::Welcome& welcome, std::uint32_t& id);

  ServerGuest& guest_;
  bool channels_ = false;  ///< true if the server has the feature
  std::optional<pb::DeviceDescription> about_;
};

}  // namespace tendon::conformance
