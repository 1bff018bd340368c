// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "protocol/handshake.h"
#include "protocol/session.h"
#include "tests/support/dice.h"
#include "tests/tools/worlds/world.h"

namespace tendon::simulation {

/// It knows the protocol. It answers steps that do not exist or are too old, with forces that are not finite or 10⁶ N,
/// validities that are zero or infinite, and invalid requests, and stops without a Bye at `quits`.
class Rogue final : public CustomClient {
 public:
  struct Config {
    Role role = Role::kController;
    std::uint64_t seed = 0;
    LocalTime quits{};
    std::optional<Key> key{};  ///< seals all datagrams if set
    Suites suites = {Suite::kNoise};
  };

  Rogue(Link& link, const Address& server, const Config& config)
      : link_(link), server_(server), config_(config), dice_(config.seed) {}

  LocalTime turn(LocalTime now) override {
    if (now >= config_.quits) return LocalTime::max();
    if (!session_ && !handshake_) greet(now);
    drain(now);
    if (session_) {
      session_->tick(now);
      take_events();
    } else if (handshake_) {
      handshake_->tick(now);
    }
    flush(now);
    const LocalTime due = session_ ? session_->next_tick() : handshake_ ? handshake_->next_tick() : LocalTime::max();
    return std::min(due, config_.quits);
  }

 private:
  void greet(LocalTime now) {
    ClientHandshake::Config config;
    config.hello.role = config_.role;
    config.hello.name = "rogue";
    config.hello.features = {std::string(kFeatureLocalModel)};
    for (std::byte& b : config.random) b = static_cast<std::byte>(dice_.bits());
    config.suites = config_.suites;
    if (config_.key) config.secret = {.key = *config_.key, .ephemeral = Ratchet(dice_.bits()).next()};
    handshake_.emplace(config, now);
  }

  void drain(LocalTime now) {
    std::array<std::byte, kMaxDatagram> buffer;
    Address from;
    while (const std::size_t size = link_.receive(from, buffer)) {
      const auto datagram = std::span<const std::byte>(buffer).first(std::min(size, buffer.size()));
      if (handshake_) {
        handshake_->receive(now, datagram);
        settle(now);
      } else if (session_) {
        session_->receive(now, datagram);
      }
    }
  }

  void settle(LocalTime now) {
    if (!handshake_->outcome()) return;
    const auto outcome = *handshake_->outcome();
    handshake_.reset();
    if (const auto* accepted = std::get_if<ClientHandshake::Accepted>(&outcome)) {
      Session::Config config;
      config.connection_id = accepted->connection_id;
      accepted->keys ? session_.emplace(config, *accepted->keys, now) : session_.emplace(config, now);
    }  // refused: stays silent
  }

  void take_events() {
    while (session_) {
      const auto event = session_->next_event();
      if (!event) return;
      if (const auto* arrived = std::get_if<Session::StateArrived>(&*event)) {
        misbehave(arrived->state);
      } else if (std::get_if<Session::Closed>(&*event) != nullptr) {
        session_.reset();
      }
    }
  }

  void misbehave(const DeviceState& state) {
    constexpr double kInf = std::numeric_limits<double>::infinity();
    ForceCommand command;
    sequence_ += dice_.chance(0.9) ? 1 : 1 + dice_.bits() % 1000;
    command.sequence = dice_.chance(0.02) ? dice_.bits() % (sequence_ + 1) : sequence_;
    switch (static_cast<int>(dice_.within(0, 6))) {
      case 0:
        command.based_on_tick = state.tick - std::min(state.tick, dice_.bits() % 6000);
        break;
      case 1:
        command.based_on_tick = state.tick + dice_.bits() % 6000;
        break;
      case 2:
        command.based_on_tick = dice_.bits();
        break;
      default:
        command.based_on_tick = state.tick;
    }
    command.force = dice_.direction() * (dice_.chance(0.1) ? 1e6 : dice_.decades(-2, 2));
    if (dice_.chance(0.05)) command.force.x() = std::nan("");
    if (dice_.chance(0.05)) command.force.y() = -kInf;
    if (dice_.chance(0.05)) command.force.z() = 1e300;
    if (dice_.chance(0.2)) {
      command.model =
          LocalModel{state.position, Mat3(Mat3::Identity() * dice_.decades(0, 6) * (dice_.chance(0.5) ? -1 : 1))};
      if (dice_.chance(0.1)) command.model->stiffness(0, 1) = std::nan("");
      if (dice_.chance(0.2)) command.model->valid_radius = dice_.chance(0.5) ? std::nan("") : -dice_.decades(-3, 0);
      if (dice_.chance(0.5)) {
        ForceTable steep{.first = -0.01, .step = dice_.decades(-9, 1), .size = 2, .force = {0, dice_.decades(0, 12)}};
        if (dice_.chance(0.2)) steep.size = 1;
        if (dice_.chance(0.2)) steep.force[1] = kInf;
        command.model->contact = Contact{.normal = dice_.direction(), .gap = 0, .table = steep};
        if (dice_.chance(0.2)) command.model->contact->normal *= 1e6;
      }
    }
    command.valid_for = dice_.chance(0.1) ? Duration::zero() : from_seconds(dice_.decades(-4, 1));
    session_->send(command);
    if (dice_.chance(0.01)) session_->request(SetStateRate{static_cast<std::uint32_t>(dice_.bits() % 3000)});
    if (dice_.chance(0.002)) session_->request(Rearm{});
  }

  void flush(LocalTime now) {
    std::array<std::byte, kMaxDatagram> buffer;
    const auto next = [&] {
      if (session_) return session_->next_datagram(now, buffer);
      return handshake_ ? handshake_->next_datagram(now, buffer) : std::size_t{0};
    };
    while (const std::size_t size = next()) link_.send(server_, std::span<const std::byte>(buffer).first(size));
  }

  Link& link_;
  Address server_;
  Config config_;
  Dice dice_;
  std::optional<ClientHandshake> handshake_;
  std::optional<Session> session_;
  std::uint64_t sequence_ = 0;
};

}  // namespace tendon::simulation
