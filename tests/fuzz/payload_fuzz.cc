// SPDX-License-Identifier: Apache-2.0
#include "protocol/session.h"
#include "protocol/wire/bounds.h"
#include "tests/fuzz/target.h"
#include "tests/protocol/wire/by_protobuf.h"
#include "tests/protocol/wire/told.h"

// Sealed with the peer's key and given to a session. The fast parser, the one for fields in arbitrary order, and
// libprotobuf agree.

using namespace tendon;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr LocalTime kOpened{std::chrono::seconds(100)};
  constexpr std::uint32_t kConnection = 7;
  Ratchet random(1);
  const SessionKeys keys{.send = random.next(), .receive = random.next()};
  Session session({.connection_id = kConnection}, keys, kOpened);
  std::array<std::byte, kMaxDatagram> buffer;
  session.request(Rearm{});
  session.request(Disarm{});
  session.next_datagram(kOpened, buffer);

  const auto body = std::as_bytes(std::span(data, std::min(size, kMaxDatagram - kHeaderSize - crypto::kTagSize)));
  DataReader reader;
  DataReader reference;
  const std::string read = told(reader.read(body));
  fuzz::require(read == told(reference.read_in_any_order(body)));
  const auto anew = by_protobuf(body);
  fuzz::require(read == told(anew ? reference.read(*anew) : nullptr));
  Sealer peer(SealingKey(Suite::kNoise, keys.receive), {}, kOpened);
  const Header header{.suite = Suite::kNoise, .connection_id = kConnection};
  const auto clear = encode_header(header);
  std::copy(clear.begin(), clear.end(), buffer.begin());
  std::copy(body.begin(), body.end(), buffer.begin() + kHeaderSize);
  const std::size_t sealed = peer.seal(header, buffer, kHeaderSize + body.size());
  session.receive(kOpened, std::span(buffer).first(sealed));

  const LinkStats& s = session.stats();
  fuzz::require(s.datagrams_received + s.malformed == 1 && s.forged == 0 && s.old_key == 0);
  while (const auto event = session.next_event()) {
    if (const auto* force = std::get_if<Session::ForceArrived>(&*event)) {
      fuzz::require(in_bounds(force->command) && force->command.valid_for > Duration::zero());
    } else if (const auto* state = std::get_if<Session::StateArrived>(&*event)) {
      fuzz::require(state->state.position.allFinite() && state->state.velocity.allFinite());
      fuzz::require(!state->state.force_wanted || state->state.force_wanted->allFinite());
      if (const auto& joints = state->state.joints) {
        fuzz::require(joints->count > 0 && joints->count <= Joints::kMost);
        for (const double angle : joints->angle) fuzz::require(std::isfinite(angle));
        for (const double velocity : joints->velocity) fuzz::require(std::isfinite(velocity));
      }
      fuzz::require(!state->state.stiffness_wanted || state->state.stiffness_wanted->allFinite());
    } else if (const auto* device = std::get_if<Session::DeviceReportArrived>(&*event)) {
      std::uint64_t uncounted = device->report.steps;
      for (const std::uint64_t count : device->report.lateness) {
        fuzz::require(count <= uncounted);
        uncounted -= count;
      }
      fuzz::require(device->report.number > 0 && device->report.fault.size() <= limits::kMaxDetail);
    } else if (const auto* peer_report = std::get_if<Session::PeerReportArrived>(&*event)) {
      fuzz::require(peer_report->report.state_one_in > 0 && peer_report->report.link.number > 0);
      fuzz::require(peer_report->report.name.size() <= limits::kMaxName);
    } else if (const auto* port = std::get_if<Session::PortArrived>(&*event)) {
      fuzz::require(is_sound(port->port));
      fuzz::require(port->port.device < limits::kMaxDevices && port->port.channel < limits::kMaxChannels);
    } else if (const auto* request = std::get_if<Session::RequestArrived>(&*event)) {
      if (const auto* couple = std::get_if<Couple>(&request->request)) {
        fuzz::require(couple->position_scale >= 0.01 && couple->force_scale >= 0.01 && couple->stiffness >= 0);
        fuzz::require(couple->axes >= 1 && couple->axes <= 7 && couple->period > Duration::zero());
        fuzz::require(couple->method >= kCouplingMethods.front() && couple->method <= kCouplingMethods.back());
        fuzz::require(couple->turn_stiffness >= 0 && couple->turn_damping >= 0 && couple->grip_stiffness >= 0);
        fuzz::require(couple->grip_damping >= 0 && couple->drift_rate >= 0);
        fuzz::require(!couple->rate || (couple->rate->gain > 0 && couple->rate->max_speed > 0));
      }
      if (const auto* scale = std::get_if<SetScale>(&request->request)) {
        fuzz::require(refused_field(*scale).empty() && scale->device < limits::kMaxDevices);
      }
      if (const auto* share = std::get_if<SetShare>(&request->request)) {
        fuzz::require(refused_field(*share).empty() && share->channel < limits::kMaxChannels);
      }
      if (const auto* wanted = std::get_if<SetOutput>(&request->request)) {
        fuzz::require(refused_field(*wanted).empty() && wanted->device < limits::kMaxDevices);
      }
      session.answer(request->id, Code::kOk, {});
    }
  }
  while (const std::size_t out = session.next_datagram(kOpened, buffer)) fuzz::require(out <= kMaxDatagram);
  return 0;
}
