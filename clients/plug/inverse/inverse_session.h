// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "clients/plug/inverse/inverse_json.h"
#include "clients/plug/plug.h"

namespace tendon::plug {

/// A device as the clients of the bridge know it.
struct InverseDevice {
  std::string name;
  std::string id;
  std::string grip_id;
  Plug* plug = nullptr;
};

/// The devices with their ids, which differ from each other. The plugs must outlive what is returned.
std::vector<InverseDevice> inverse_devices(std::span<const std::pair<std::string, Plug*>> plugs);

/// What the bridge has counted, of all clients.
struct InverseCounts {
  std::uint64_t clients = 0;   ///< that came
  std::uint64_t messages = 0;  ///< each was answered
  std::uint64_t skipped = 0;   ///< of these, not read: too many of one client, and a newer one was there
  std::uint64_t unread = 0;    ///< … not JSON, too long, too deep
  std::uint64_t refused = 0;   ///< sentences of refusal
  std::uint64_t ignored = 0;   ///< commands that mean nothing here
};

/// One client's conversation: the first message, and then exactly one reply for each message of the client. It has no
/// socket and no clock.
///
/// * A force is sent once, and the server takes it as fresh for kFresh, which the plugs' `client.valid_for` says. A client
///   that falls silent, or leaves, sends no more; the server holds, fades and stops the last one (protocol/SESSION.md).
/// * One force for each state, or for each kPace where no state comes: a client may say many more, because it is answered
///   as fast as it asks. Then the newest waits for the next state, and replaces the one that waits.
/// * A message says all that is wanted of a device: a set_cursor_force without the word `tendon` asks for no torque.
///   One without either asks for nothing.
/// * A force of zero claims nothing, because clients send it to be answered at all. It counts only from the client that
///   owns the device.
/// * Of the messages that are there at once the newest is always read. The older are read while they are not more than
///   kMostPerSecond; beyond that they are answered and counted, and not read.
/// * Positions are of the newest state at the time of the reply. A button that was held in a state since the reply
///   before is held in this one.
///
/// Thread-safe: no. Realtime-safe: no.
class InverseSession {
 public:
  static constexpr Duration kFresh = std::chrono::milliseconds(100);
  static constexpr Duration kPace = std::chrono::milliseconds(1);
  static constexpr double kMostPerSecond = 4000;

  /// `devices` and `counts` must outlive the session. `program` names this client to the plugs.
  InverseSession(Plug::Program program, std::span<const InverseDevice> devices, InverseCounts& counts, LocalTime now);
  /// Lets go of what it owns.
  ~InverseSession();
  InverseSession(const InverseSession&) = delete;
  InverseSession& operator=(const InverseSession&) = delete;

  /// The message that a client is sent when it comes.
  std::string greeting(LocalTime now);
  /// One reply for each message, in their order.
  std::vector<std::string> answer(LocalTime now, std::span<const std::string> messages);
  /// To be called after each turn of the plugs, and when it is due. Whether a force that waited leaves in the next turn.
  bool see(LocalTime now);
  /// When a force that waits leaves without a state; LocalTime::max(): none waits.
  LocalTime due() const noexcept;

  Plug::Program program() const noexcept { return program_; }

 private:
  /// A device as this client wants to see it, and what it has seen.
  struct Eye {
    std::string permutation = "XYZ";
    Frame frame = inverse_frame(Mat3::Identity());
    std::uint64_t states = 0;   ///< of the plug, when it was seen last
    std::uint32_t buttons = 0;  ///< held since the reply before
    std::optional<Touch> waiting{};
    LocalTime until{};           ///< it waits
    LocalTime pushed{};          ///< when the newest force was sent
    std::uint64_t answered = 0;  ///< `states` when it was
  };

  std::string reply(LocalTime now, std::vector<std::string> refused, bool whole);
  DeviceNews news_of(LocalTime now, const InverseDevice& device, Eye& eye) const;
  void take(LocalTime now, Wish& wish);
  void take(LocalTime now, const DeviceWish& asked, Wish& wish);
  Plug::Answer push(LocalTime now, Plug& plug, Eye& eye, const Touch& touch);
  bool may_push(LocalTime now, const Plug& plug, const Eye& eye) const noexcept;
  void refill(LocalTime now);

  Plug::Program program_;
  std::span<const InverseDevice> devices_;
  InverseCounts& counts_;
  std::vector<Eye> eyes_;
  LocalTime refilled_;
  double readable_ = kMostPerSecond / 10;  ///< older messages that may be read now
};

}  // namespace tendon::plug
