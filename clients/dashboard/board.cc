// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/board.h"

#include <algorithm>
#include <utility>

namespace tendon::dash {
namespace {

/// A silent engine is removed after this number of reports. Both are sent once per second, and one may be lost.
constexpr std::uint64_t kForgetAfter = 3;

/// Ignores counters that always increase.
bool same(const DeviceDescription& a, const DeviceDescription& b) {
  if (a.name != b.name || a.model != b.model || a.loop_hz != b.loop_hz || a.max_force != b.max_force ||
      a.channels.size() != b.channels.size()) {
    return false;
  }
  for (std::size_t i = 0; i < a.channels.size(); ++i) {
    if (a.channels[i].name != b.channels[i].name || a.channels[i].holder != b.channels[i].holder) return false;
  }
  return true;
}

}  // namespace

void Board::tell(Contact contact, std::string words) {
  if (contact_ == contact && words_ == words) return;
  contact_ = contact;
  words_ = std::move(words);
  ++version_;
}

void Board::tell(Press press) {
  press_ = std::move(press);
  ++version_;
}

void Board::welcomed(const Welcome& welcome) {
  welcome_ = welcome;
  for (auto& [number, device] : devices_) {
    device.handle.reset();
    device.ports.reset();
    device.ports_waiting.clear();
  }
  ++sessions_;
  ++version_;
}

void Board::described(const DeviceDescription& about) {
  Device& device = devices_[about.device];
  if (device.about && same(*device.about, about)) return;
  device.about = about;
  ++version_;
}

void Board::described(const HandleDescription& handle) {
  devices_[handle.device].handle = handle;
  ++version_;
}

void Board::counted(std::uint32_t devices) {
  if (std::erase_if(devices_, [&](const auto& device) { return device.first >= devices; }) > 0) ++version_;
}

void Board::observe(const DeviceState& state) {
  Device& device = devices_[state.device];
  device.newest = state;
  ++device.states;
  for (std::size_t bit = 0; bit < kReasons; ++bit) device.limited[bit] += (state.reasons >> bit) & 1U;
  if (device.waiting.size() >= kMaxWaiting) {
    const auto half = device.waiting.size() / 2;  // amortizes the cost of erasing
    device.waiting.erase(device.waiting.begin(), device.waiting.begin() + static_cast<std::ptrdiff_t>(half));
    device.dropped += half;
  }
  device.waiting.push_back(state);
}

void Board::observe(const DeviceReport& report) {
  Device& device = devices_[report.device];
  device.report = report;
  for (std::size_t i = 0; i < report.lateness.size(); ++i) device.lateness[i] += report.lateness[i];
  device.steps += report.steps;
  device.missed += report.missed;
  device.overruns += report.overruns;
  device.unseen += report.unseen;
  for (auto& [channel, engine] : device.engines) ++engine.silent_for;
  std::erase_if(device.engines, [](const auto& engine) { return engine.second.silent_for > kForgetAfter; });
}

void Board::observe(const PeerReport& report) {
  auto& engines = devices_[report.device].engines;
  if (const auto known = engines.find(report.channel);
      known != engines.end() && known->second.newest.name != report.name) {
    engines.erase(known);
  }
  Engine& engine = engines[report.channel];
  engine.newest = report;
  engine.forces += report.link.forces;
  engine.late_server += report.link.late_server;
  engine.late_network += report.link.late_network;
  engine.late_engine += report.link.late_engine;
  engine.late_unknown += report.link.late_unknown;
  engine.refused.not_finite += report.link.refused.not_finite;
  engine.refused.out_of_bounds += report.link.refused.out_of_bounds;
  engine.refused.unknown_tick += report.link.refused.unknown_tick;
  engine.refused.old_sequence += report.link.refused.old_sequence;
  engine.silent_for = 0;
}

void Board::observe(const PortFrame& port) {
  Device& device = devices_[port.device];
  if (port.of_peer) {
    if (!device.ports) return;
    device.ports->peer = port;
    if (!device.ports_waiting.empty()) device.ports_waiting.back().peer = port;
    return;
  }
  if (!device.ports) device.ports.emplace();
  device.ports->own = port;
  device.ports->at = device.newest ? device.newest->sampled : PeerTime{};
  if (port.phase == PortPhase::kAlone || port.phase == PortPhase::kLost) device.ports->peer.reset();
  if (device.ports_waiting.size() >= kMaxPortsWaiting) device.ports_waiting.erase(device.ports_waiting.begin());
  device.ports_waiting.push_back(*device.ports);
}

std::vector<Board::Ports> Board::take_ports(std::uint32_t number) {
  const auto device = devices_.find(number);
  if (device == devices_.end()) return {};
  return std::exchange(device->second.ports_waiting, {});
}

std::vector<DeviceState> Board::take_states(std::uint32_t number) {
  const auto device = devices_.find(number);
  if (device == devices_.end()) return {};
  return std::exchange(device->second.waiting, {});
}

std::optional<PortRole> role_of(const Board::Ports& ports) {
  // Observers receive the scales only from the leader.
  if (ports.own.position_scale > 0) return PortRole::kLeader;
  if (ports.peer && ports.peer->position_scale > 0) return PortRole::kFollower;
  return std::nullopt;
}

std::optional<double> pair_account(const Board::Ports& ports) {
  const auto role = role_of(ports);
  if (!role || !ports.peer) return std::nullopt;
  const bool leads = *role == PortRole::kLeader;
  const PortFrame& leader = leads ? ports.own : *ports.peer;
  const PortFrame& follower = leads ? *ports.peer : ports.own;
  if (leader.need <= 0 || follower.need <= 0) return std::nullopt;
  if (leader.answers_epoch != follower.epoch || follower.answers_epoch != leader.epoch) return std::nullopt;
  const double worth = leader.force_scale / leader.position_scale;
  // Payments are reported in joules of the payer by both ends. The receiver's state may be newer.
  const double to_follower = std::max(0.0, leader.given - follower.taken);
  const double to_leader = std::max(0.0, follower.given - leader.taken);
  return leader.account + to_follower + worth * (follower.account + to_leader);
}

}  // namespace tendon::dash
