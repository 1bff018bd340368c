// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tests/tools/conformance/server_guest.h"

namespace tendon::conformance {

/// Devices, channels and leases, for a server that offers the feature "channels"; the checks of any other are not
/// applicable. check_claims() comes first: it finds out which one this is.
class ChannelChecks {
 public:
  explicit ChannelChecks(ServerGuest& guest) : guest_(guest) {}

  /// Nobody controls the device, and nobody does afterwards: each Hello stays half-open.
  void check_claims();
  /// Of one who has not claimed the channel as a controller. `id`: its next request.
  void check_from_outside(Conversation& observer, std::uint32_t id);
  /// A session that has claimed by name, with the features for check_coupling(), and still goes on. `id`: its newest
  /// request.
  std::optional<ServerGuest::Session> check_channels(std::uint32_t& id);
  /// The link reports in all that was heard.
  void check_reports(const Conversation& talk);

 private:
  pb::Hello claiming(const std::vector<pb::Claim>& claims) const;
  void check_description(Conversation& talk, const pb::Welcome& welcome, std::uint32_t& id);
  void check_lease(Conversation& talk, std::uint32_t& id);
  void check_deadband(Conversation& talk, const pb::Welcome& welcome, std::uint32_t& id);

  ServerGuest& guest_;
  bool channels_ = false;                       ///< it offers the feature
  std::optional<pb::DeviceDescription> about_;  ///< device 0
};

}  // namespace tendon::conformance
