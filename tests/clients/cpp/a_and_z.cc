// SPDX-License-Identifier: Apache-2.0
#include "tests/clients/cpp/a_and_z.h"

#include <algorithm>
#include <stdexcept>

#include "protocol/wire/header.h"

namespace tendon::a_and_z {

void Network::send(LocalTime now, const Address& from, const Address& to, std::span<const std::byte> bytes) {
  const bool lost = uniform() < weather_.loss;
  const Duration delay = weather_.delay + from_seconds(uniform() * seconds(weather_.jitter));
  if (!lost) flying_.emplace(now + delay, Datagram{from, to, {bytes.begin(), bytes.end()}});
}

std::size_t Network::receive(LocalTime now, const Address& to, Address& from, std::span<std::byte> buffer) {
  for (auto it = flying_.begin(); it != flying_.end() && it->first <= now; ++it) {
    const Datagram& datagram = it->second;
    if (datagram.to != to) continue;
    const std::size_t size = datagram.bytes.size();
    from = datagram.from;
    std::copy_n(datagram.bytes.begin(), std::min(size, buffer.size()), buffer.begin());
    flying_.erase(it);
    return size;
  }
  return 0;
}

void Network::drop_arrived(LocalTime now) { flying_.erase(flying_.begin(), flying_.upper_bound(now)); }

LocalTime Server::turn(LocalTime now) {
  std::array<std::byte, kMaxDatagram> buffer{};
  Address from;
  while (const std::size_t size = link_.receive(from, buffer)) {
    const auto datagram = std::span<const std::byte>(buffer).first(size);
    const std::optional<Header> header = decode_header(datagram);
    if (!header) continue;
    if (header->type == DatagramType::kHello) {
      hello(now, from, datagram);
    } else if (session_ && header->connection_id == session_->connection_id()) {
      session_->receive(now, datagram);
    }
  }
  if (!session_) return LocalTime::max();

  session_->tick(now);
  if (now >= next_state_) {
    DeviceState state;
    tick += static_cast<std::uint64_t>(kLoopHz / state_hz);
    state.tick = tick;
    state.position = position(tick);
    state.turning = turning;
    state.buttons = press_every > 0 && tick % press_every == 0 ? 2 : 0;
    session_->send(state);
    next_state_ = now + from_seconds(1.0 / state_hz);
  }
  while (session_) {
    const Session::Event* const event = session_->next_event();
    if (event == nullptr) break;
    if (const auto* force = std::get_if<Session::ForceArrived>(&*event)) {
      forces.emplace_back(now, force->command);
    } else if (const auto* request = std::get_if<Session::RequestArrived>(&*event)) {
      if (!std::holds_alternative<Describe>(request->request)) requests.push_back(request->request);
      if (const auto* wanted = std::get_if<TakeLease>(&request->request)) {
        give_lease(request->id, *wanted);
      } else {
        const Code code = answer_to(now, request->request);
        session_->answer(request->id, code, code == Code::kOk ? "" : "refused by Z");
      }
    } else if (const auto* end = std::get_if<Session::Closed>(&*event)) {
      closed = end->code;
      session_.reset();
    } else if (fields) {
      take_field(now, *event);
    }
  }
  while (session_ && fields) {
    const auto status = fields->next_status(now);
    if (!status) break;
    session_->send(*status);
  }
  flush(now);
  const LocalTime status_due = fields ? fields->due() : LocalTime::max();
  return session_ ? std::min({session_->next_tick(), next_state_, status_due}) : LocalTime::max();
}

void Server::take_field(LocalTime now, const Session::Event& event) {
  if (const auto* brick = std::get_if<Session::BrickArrived>(&event)) {
    if (const auto refused = fields->take(now, brick->brick)) refused_fields.push_back(*refused);
  } else if (const auto* pose = std::get_if<Session::FieldPoseArrived>(&event)) {
    poses.push_back(pose->pose);
  }
}

Code Server::answer_to(LocalTime now, const Request& request) {
  if (!fields) return Code::kOk;
  if (const auto* part = std::get_if<OfferField>(&request)) {
    const auto refused = fields->take(now, *part);
    if (refused) refused_fields.push_back(*refused);
    return refused ? refused->code : Code::kOk;
  }
  if (const auto* use = std::get_if<UseField>(&request)) {
    return fields->ready(use->field) ? Code::kOk : Code::kInvalid;
  }
  if (const auto* drop = std::get_if<DropField>(&request)) {
    return fields->drop(drop->field) ? Code::kOk : Code::kInvalid;
  }
  return Code::kOk;
}

void Server::give_lease(std::uint32_t id, const TakeLease& wanted) {
  Code code = Code::kOk;
  if (!lease_answers.empty()) {
    code = lease_answers.front();
    lease_answers.erase(lease_answers.begin());
  }
  session_->answer(id, code, "");
  if (code != Code::kOk || snatches == 0) return;
  --snatches;
  session_->request(LeaseLost{.device = wanted.device, .channel = wanted.channel, .to = "another"});
}

void Server::say_bye(LocalTime now, Code code) {
  session_->close(code, "Z closes");
  flush(now);
  session_.reset();
}

void Server::hello(LocalTime now, const Address& from, std::span<const std::byte> datagram) {
  std::array<std::byte, kMaxDatagram> buffer{};
  const ServerHandshake::Reply reply = handshake_.receive(now, from, datagram, buffer);
  const auto send = [&](std::size_t size) {
    if (size > 0) link_.send(from, std::span<const std::byte>(buffer).first(size));
  };
  send(reply.size);
  if (!reply.client) return;
  if (attempt_ != reply.client->random) {
    attempt_ = reply.client->random;
    attempts.push_back(now);
    hellos.push_back(reply.client->hello);
    if (!refusal) {
      ++welcomes;
      Session::Config config;
      config.connection_id = ++connection_id_;
      session_.emplace(config, now);
      client_ = from;
      next_state_ = now;
    }
  }
  if (refusal) {
    send(handshake_.refuse(*reply.client, *refusal, buffer).size);
    return;
  }
  Welcome welcome;
  welcome.version = kProtocolVersion;
  if (features) welcome.features = reply.client->hello.features;
  welcome.role = reply.client->hello.role;
  welcome.device_name = "hand at Z";
  welcome.max_force = 10;
  welcome.loop_hz = kLoopHz;
  welcome.timeout = std::chrono::seconds(2);
  welcome.server = "Z";
  send(handshake_.welcome(*reply.client, connection_id_, welcome, buffer).size);
}

void Server::flush(LocalTime now) {
  std::array<std::byte, kMaxDatagram> buffer{};
  while (session_) {
    const std::size_t size = session_->next_datagram(now, buffer);
    if (size == 0) break;
    link_.send(client_, std::span<const std::byte>(buffer).first(size));
  }
}

void World::run(Duration length) {
  const LocalTime end = now + length;
  for (turn(); next() <= end; turn()) advance();
  now = end;
}

bool World::run_until(ForceClient::Phase phase, Duration limit) {
  const LocalTime end = now + limit;
  for (turn(); a->phase() != phase; turn()) {
    if (next() > end) return false;
    advance();
  }
  return true;
}

void World::advance() {
  constexpr int kMaxTurns = 1000;  // a few datagrams arrive at one instant, and each costs two turns
  turns_at_once_ = next() > now ? 0 : turns_at_once_ + 1;
  if (turns_at_once_ > kMaxTurns) throw std::logic_error("somebody wants to be called again and again at one instant");
  now = std::max(now, next());
}

void World::turn() {
  if (z) z_next_ = z->turn(now);
  if (a) a_next_ = a->turn(now);
  network_.drop_arrived(now);
}

LocalTime World::next() const {
  LocalTime next = network_.next_arrival();
  if (a) next = std::min(next, a_next_);
  if (z) next = std::min(next, z_next_);
  return next;
}

}  // namespace tendon::a_and_z
