// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "clients/bridge/bridged_device.h"
#include "clients/bridge/inverse/inverse_json.h"

namespace tendon::bridge {

struct InverseDevice {  // as presented to the clients of the bridge
  std::string name;
  std::string id;
  std::string grip_id;
  BridgedDevice* bridged = nullptr;
};

/// Returns the devices with unique ids. The bridged devices must outlive the result.
std::vector<InverseDevice> inverse_devices(std::span<const std::pair<std::string, BridgedDevice*>> all_bridged);

struct InverseCounts {  // of all clients
  std::uint64_t clients = 0;
  std::uint64_t messages = 0;
  std::uint64_t skipped = 0;  ///< messages that were not read because a client sent too many and there was a newer one
  std::uint64_t unread = 0;   ///< messages that are not JSON, too long or too deep
  std::uint64_t refused = 0;
  std::uint64_t ignored = 0;
};

/// The conversation with one client: a first message, then one reply for each message. It uses no sockets or clocks.
///
/// * A force is sent once with the validity kFresh, which must be `client.valid_for` of the bridged devices. After a
///   client falls silent or leaves, the server holds, fades and stops the last force (protocol/SESSION.md).
/// * At most one force is sent for each state, or every kPace while no state arrives, because clients send as fast as
///   they receive replies. The newest force waits for the next state and replaces an older waiting one.
/// * A message is the complete request for a device: set_cursor_force without `tendon` requests no torque.
/// * A zero force only counts if the client is the owner, because other clients send it to obtain replies.
/// * The newest message of a batch is always read. Older messages are read up to kMostPerSecond, then only answered.
/// * Replies contain the newest state. A button pressed in any state since the previous reply counts as pressed.
///
/// Thread-safe: no. Realtime-safe: no.
class InverseSession {
 public:
  static constexpr Duration kFresh = std::chrono::milliseconds(100);
  static constexpr Duration kPace = std::chrono::milliseconds(1);
  static constexpr double kMostPerSecond = 4000;

  /// `devices` and `counts` must outlive the session. `program` identifies this client at the bridged devices.
  InverseSession(BridgedDevice::Program program, std::span<const InverseDevice> devices, InverseCounts& counts,
                 LocalTime now);
  ~InverseSession();  ///< releases its devices
  InverseSession(const InverseSession&) = delete;
  InverseSession& operator=(const InverseSession&) = delete;

  std::string greeting(LocalTime now);  ///< first message to the client
  std::vector<std::string> answer(LocalTime now, std::span<const std::string> messages);  ///< one for each, in order
  /// Must be called after each turn of the bridged devices and at due(). True if the next turn sends a waiting force.
  bool see(LocalTime now);
  /// Time at which a waiting force is sent even without a new state; LocalTime::max(): none is waiting.
  LocalTime due() const noexcept;

  BridgedDevice::Program program() const noexcept { return program_; }

 private:
  /// Settings of the client for one device, and the last reported data.
  struct Eye {
    std::string permutation = "XYZ";
    Frame frame = inverse_frame(Mat3::Identity());
    std::uint64_t states = 0;   ///< value of BridgedDevice::states() at the last turn
    std::uint32_t buttons = 0;  ///< pressed since the previous reply
    std::optional<Touch> waiting{};
    LocalTime until{};           ///< expiry of `waiting`
    LocalTime pushed{};          ///< time of the newest force
    std::uint64_t answered = 0;  ///< `states` at that time
  };

  std::string reply(LocalTime now, std::vector<std::string> refused, bool whole);
  DeviceNews news_of(LocalTime now, const InverseDevice& device, Eye& eye) const;
  void take(LocalTime now, Wish& wish);
  void take(LocalTime now, const DeviceWish& asked, Wish& wish);
  BridgedDevice::Answer push(LocalTime now, BridgedDevice& bridged, Eye& eye, const Touch& touch);
  bool may_push(LocalTime now, const BridgedDevice& bridged, const Eye& eye) const noexcept;
  void refill(LocalTime now);

  BridgedDevice::Program program_;
  std::span<const InverseDevice> devices_;
  InverseCounts& counts_;
  std::vector<Eye> eyes_;
  LocalTime refilled_;
  double readable_ = kMostPerSecond / 10;
};

}  // namespace tendon::bridge
