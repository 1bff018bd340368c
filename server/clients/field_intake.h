// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "protocol/field/brick_store.h"
#include "protocol/field/pace.h"
#include "protocol/field/receiver.h"
#include "protocol/messages.h"
#include "server/clients/field_slots.h"
#include "server/clients/requests.h"
#include "server/clients/served_client.h"

namespace tendon {

/// Receives the fields and poses of all clients of a network loop, and passes them to the haptic threads. The bricks of
/// all clients are in one store, in which each key can only find its own. A client can only use a field in a channel
/// that it holds and that allows fields (FieldLimits). The offers of a client that leaves are removed, but its bricks
/// remain in the store.
/// The constructor allocates the store, and the slots of each channel that allows fields.
/// Thread-safe: no. Realtime-safe: no.
class FieldIntake {
 public:
  static constexpr double kPosesPerS = 250;                               ///< of a client
  static constexpr Duration kPoseBurst = std::chrono::milliseconds(200);  ///< allows for delays of the network
  /// Building a field of all bricks takes some milliseconds, in which no force is received. It is not built again while
  /// it is in a slot of its channel.
  static constexpr double kBuiltBricksPerS = 10'000;                       ///< of a client
  static constexpr Duration kBuildBurst = std::chrono::milliseconds(300);  ///< a large field for each slot

  struct Config {
    std::array<std::byte, 16> secret{};  ///< random, for the store
    std::vector<std::string> keys{};     ///< names of all keys. Clients without a key share their bricks
  };

  /// The references must outlive the object.
  FieldIntake(const Config& config, const std::vector<ServedDevice>& devices, std::vector<ServedClient>& clients);

  /// Returns true if a device has a channel that allows fields.
  static bool needed(const std::vector<ServedDevice>& devices);

  Outcome offer(LocalTime now, const ServedClient& client, const OfferField& part);
  Outcome use(LocalTime now, const ServedClient& client, const UseField& wanted);
  Outcome drop(LocalTime now, const ServedClient& client, const DropField& wanted);

  /// Return false if the client may not send this. Other refusals are only noted (take_notices).
  bool take(LocalTime now, const ServedClient& client, const FieldBrick& brick);
  bool take(LocalTime now, const ServedClient& client, const FieldPose& pose);

  /// Sends what is due and returns the time of the next call.
  LocalTime turn(LocalTime now);

  std::vector<std::string> take_notices();

 private:
  struct Guest {
    Guest(const FieldReceiver::Config& config, BrickStore& store);
    FieldReceiver receiver;
    Pace poses;
    Pace built;
    LocalTime noted = LocalTime::min();  ///< time of the last notice
  };
  struct Channel {
    explicit Channel(FieldBox& box) : slots(box) {}
    FieldSlots slots;
    std::uint32_t source = 0;  ///< the client to which the rest belongs
    std::uint32_t generation = 0;
    FieldName name{};
    std::optional<FieldName> recorded{};  ///< name of the last field that was recorded with its bricks
  };

  Guest& guest_of(const ServedClient& client);
  Channel* channel_of(std::uint32_t device, std::uint32_t channel);
  bool holds(const ServedClient& client, std::uint32_t device, std::uint32_t channel) const;
  Outcome pass_on(LocalTime now, Guest& guest, Channel& channel, const FieldManifest& manifest, const UseField& wanted,
                  std::uint32_t source);
  void record(LocalTime now, const Guest& guest, Channel& channel, const FieldManifest& manifest,
              const UseField& wanted, const field::Field& field, std::uint32_t source);
  void note(LocalTime now, const ServedClient& client, Guest& guest, const std::string& refused);

  const std::vector<ServedDevice>& devices_;
  std::vector<ServedClient>& clients_;
  std::vector<std::string> keys_;
  BrickStore store_;
  std::vector<std::vector<std::unique_ptr<Channel>>> channels_;  ///< by device and channel; null if not allowed
  std::map<std::uint32_t, Guest> guests_;                        ///< by connection id
  std::vector<std::string> notices_;
};

}  // namespace tendon
