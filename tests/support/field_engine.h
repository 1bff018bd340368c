// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "protocol/connection.h"
#include "protocol/field/sender.h"
#include "tests/support/field_shape.h"

namespace tendon {

/// An engine that uploads fields, and can send what no library sends. Each of `uploads` is sent at once.
class FieldEngine {
 public:
  using Answer = Session::RequestAnswered;

  struct Config {
    Hello hello{.role = Role::kController, .name = "engine", .features = {"fields", "channels"}};
    std::optional<Key> key{};
    std::uint64_t seed = 1;
  };

  FieldEngine(Link& link, const Address& server, const Config& config, LocalTime now)
      : config_(config), connection_(link, server, {.key = config.key, .seed = config.seed}) {
    connection_.greet(now, config.hello);
  }

  FieldSender& upload(const FieldShape& shape) {
    const auto& kept = bricks_.emplace_back(shape.bricks);
    return uploads.emplace_back(FieldSender::Config{}, shape.lattice, kept, shape.primitives);
  }

  /// Returns the number of the request, or 0 if the session accepts none now.
  std::uint32_t ask(const Request& request) {
    return session() != nullptr ? session()->request(request).value_or(0) : 0;
  }
  std::uint32_t use(const FieldName& field, std::uint32_t generation,
                    std::vector<FieldMaterial> materials = {{.stiffness = 500}}, std::uint32_t channel = 0,
                    std::vector<FieldDepthTable> tables = {}) {
    return ask(UseField{.channel = channel,
                        .generation = generation,
                        .field = field,
                        .materials = std::move(materials),
                        .tables = std::move(tables)});
  }
  const Answer* answer(std::uint32_t id) const {
    const auto found = answers.find(id);
    return found != answers.end() ? &found->second : nullptr;
  }
  /// Sends the true force for the newest state.
  void tell(const Vec3& truth, std::uint32_t generation) {
    session()->send(ForceCommand{.sequence = ++sequence_,
                                 .based_on_tick = state->tick,
                                 .force = truth,
                                 .valid_for = std::chrono::milliseconds(100),
                                 .field = generation});
  }
  void move(FieldPose pose) {
    pose.sequence = ++poses_;
    session()->send(pose);
  }

  LocalTime turn(LocalTime now) {
    connection_.begin_turn();
    while (const auto* const event = connection_.next(now)) {
      if (std::holds_alternative<Connection::GreetingDue>(*event)) connection_.greet(now, config_.hello);
      if (const auto* const opened = std::get_if<Connection::Opened>(event)) welcome = opened->welcome;
      if (const auto* const ended = std::get_if<Connection::Ended>(event)) end = *ended;
      if (const auto* const of_session = std::get_if<const Session::Event*>(event)) take(now, **of_session);
    }
    if (session() != nullptr) send(now);
    connection_.flush(now);
    LocalTime next = connection_.next_turn();
    if (session() != nullptr) {
      for (const FieldSender& one : uploads)
        next = std::min(next, std::max(one.due(), now + std::chrono::milliseconds(1)));
    }
    return next;
  }

  Session* session() { return connection_.session(); }

  std::deque<FieldSender> uploads;
  std::optional<Welcome> welcome;
  std::optional<Connection::Ended> end;
  std::optional<DeviceState> state;  ///< the newest
  std::map<std::uint32_t, Answer> answers;
  std::vector<FieldStatus> statuses;

 private:
  void take(LocalTime now, const Session::Event& event) {
    if (const auto* const told = std::get_if<Session::StateArrived>(&event)) state = told->state;
    if (const auto* const told = std::get_if<Session::RequestAnswered>(&event)) answers[told->id] = *told;
    if (const auto* const told = std::get_if<Session::FieldStatusArrived>(&event)) {
      statuses.push_back(told->status);
      for (FieldSender& one : uploads) one.take(now, told->status, session()->stats().smoothed_round_trip);
    }
  }

  void send(LocalTime now) {
    for (FieldSender& one : uploads) {
      for (auto part = one.next_part(now); part && session()->request(*part); part = one.next_part(now))
        one.part_sent();
      for (auto brick = one.next_brick(now); brick; brick = one.next_brick(now)) {
        session()->send(*brick);
        connection_.flush(now);
      }
    }
  }

  Config config_;
  std::deque<std::vector<FieldSender::Brick>> bricks_;
  Connection connection_;
  std::uint64_t sequence_ = 0;
  std::uint64_t poses_ = 0;
};

}  // namespace tendon
