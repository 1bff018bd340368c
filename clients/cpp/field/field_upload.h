// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "clients/cpp/field/field.h"
#include "protocol/field/sender.h"
#include "protocol/messages.h"
#include "protocol/session.h"

namespace tendon {

/// Uploads a field and uses it in the channel of the client. This is repeated in each session. If the field is replaced,
/// the previous one is removed from the server. Thread-safe: no. Realtime-safe: no.
class FieldUpload {
 public:
  struct Progress {
    std::uint32_t generation = 0;  ///< of the field that is rendered, or 0 if there is none
    bool current = false;          ///< true if this is the field of the last call of use()
    std::uint64_t bricks_sent = 0;
    std::string refused{};  ///< the error message of the server, or empty if there is none
  };

  /// Replaces the field. Throws std::invalid_argument with the name of a number that is out of bounds.
  void use(Field field);

  void drop() noexcept;  ///< stops using a field

  void begin();         ///< a new session
  void end() noexcept;  ///< without a session

  /// Must be called with these events of the session.
  void take(LocalTime now, const FieldStatus& status, Duration round_trip);
  void take(LocalTime now, const Session::RequestAnswered& answered);

  /// Sends what is due, except bricks. `holds` is true if the client has the lease of the channel.
  void turn(LocalTime now, Session& session, std::uint32_t device, std::uint32_t channel, bool holds);
  /// Sends a brick if one is due. The caller must then send a datagram.
  bool send_brick(LocalTime now, Session& session);
  LocalTime due() const noexcept;  ///< when to call both

  const Progress& progress() const noexcept { return progress_; }

 private:
  struct Uploaded {
    explicit Uploaded(Field the_field)
        : field(std::move(the_field)), sender({}, field.lattice, field.bricks, field.primitives) {}
    Field field;
    FieldSender sender;
  };

  bool busy() const noexcept { return uploaded_ != nullptr && progress_.refused.empty(); }

  std::unique_ptr<Uploaded> uploaded_;  ///< the sender refers to the field
  std::vector<FieldName> replaced_;
  std::vector<std::uint32_t> parts_;  ///< requests without an answer
  std::optional<std::uint32_t> use_;
  std::uint32_t generation_ = 0;  ///< of the last request
  std::optional<FieldName> used_;
  bool holds_ = false;
  bool blocked_ = false;                ///< until a request is answered
  LocalTime retry_ = LocalTime::min();  ///< of the request to use the field
  Progress progress_;
};

}  // namespace tendon
