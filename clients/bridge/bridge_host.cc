// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/bridge_host.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "clients/cpp/machine.h"
#include "protocol/wire/text.h"

namespace tendon::bridge {
namespace {

constexpr Duration kLongestWait = std::chrono::milliseconds(100);  ///< signals before a sleep do not interrupt it
constexpr Duration kLineEvery = std::chrono::seconds(1);

BridgedDevice::Config config_of(const BridgeConfig& config, const std::string& device, const std::string& found) {
  BridgedDevice::Config of_bridged{.client = config.client,
                                   .new_seed = seed_from_system,
                                   .observe = config.observe,
                                   .always_observe = config.always_observe};
  of_bridged.client.device = device.empty() ? found : device;
  return of_bridged;
}

}  // namespace

BridgeHost::Served::Served(const BridgeConfig& config, const std::string& device, LocalTime now)
    : name(device.empty() ? "device" : device),
      watcher(config.server, config.client.key.has_value()),
      controller(config.server, config.client.key.has_value()),
      bridged({watcher, watcher.server()}, {controller, controller.server()},
              config_of(config, device, watcher.device()), now) {}

BridgeHost::BridgeHost(BridgeConfig config, LocalTime now) : config_(std::move(config)), next_line_(now + kLineEvery) {
  if (config_.devices.empty()) config_.devices.emplace_back();
  for (const std::string& device : config_.devices) served_.emplace_back(config_, device, now);
}

void BridgeHost::say(const std::string& sentence) const { std::cerr << "tendon-bridge: " + visible(sentence) + "\n"; }

/// The address of the server may have changed. If the current address did not answer, the next one is tried.
void BridgeHost::look_up_again(Served& served) {
  try {
    const bool another = served.phase == ForceClient::Phase::kUnanswered;
    served.watcher.look_up_again(another);
    served.controller.look_up_again(another);
    served.bridged.move_to(served.watcher.server(), served.controller.server());
  } catch (const std::runtime_error& error) {
    say(served.name + ": " + error.what());
  }
}

LocalTime BridgeHost::turn(LocalTime now, std::span<const Count> counts) {
  LocalTime next = LocalTime::max();
  for (Served& served : served_) {
    next = std::min(next, served.bridged.turn(now));
    while (const auto sentence = served.bridged.next_sentence()) say(served.name + ": " + *sentence);
    const ForceClient::Phase phase = served.bridged.phase();
    if (phase != std::exchange(served.phase, phase) && is_between_attempts(phase)) look_up_again(served);
  }
  if (config_.json) {
    if (now >= next_line_) {
      write_line(counts);
      next_line_ = now + kLineEvery;
    }
    next = std::min(next, next_line_);
  }
  return next;
}

void BridgeHost::write_line(std::span<const Count> counts) {
  for (const Served& served : served_) {
    const BridgedDevice& bridged = served.bridged;
    nlohmann::ordered_json line = {
        {"device", served.name},
        {"states", bridged.states()},
        {"forces", bridged.forces()},
        {"dropped", bridged.forces_dropped()},
        {"unusable", bridged.forces_unusable()},
        {"owner", bridged.owner()},
        {"pushes", bridged.pushes()},
        {"round_trip_ms", std::chrono::duration<double, std::milli>(bridged.link().smoothed_round_trip).count()}};
    for (const auto& [name, count] : counts) line[std::string(name)] = count;
    std::cout << line << std::endl;
  }
}

std::vector<int> BridgeHost::descriptors() const {
  std::vector<int> all;
  for (const Served& served : served_) {
    all.push_back(served.watcher.descriptor());
    all.push_back(served.controller.descriptor());
  }
  return all;
}

void BridgeHost::wait(std::span<pollfd> others, LocalTime now, LocalTime until) {
  polled_.assign(others.begin(), others.end());
  for (const int descriptor : descriptors()) polled_.push_back({descriptor, POLLIN, 0});
  const Duration left = std::clamp(until - now, Duration::zero(), kLongestWait);
  const auto whole = std::chrono::duration_cast<std::chrono::seconds>(left);
  const timespec time{static_cast<time_t>(whole.count()), static_cast<long>((left - whole).count())};
  if (::ppoll(polled_.data(), polled_.size(), &time, nullptr) <= 0) {
    for (pollfd& one : others) one.revents = 0;
    return;
  }
  std::copy_n(polled_.begin(), others.size(), others.begin());
}

int BridgeHost::stop(LocalTime now) {
  int exit_code = 0;
  for (Served& served : served_) {
    served.bridged.stop(now);
    if (served.bridged.states() > 0) continue;
    say(served.name + ": no state was received from " + config_.server.text());
    exit_code = 1;
  }
  return exit_code;
}

}  // namespace tendon::bridge
