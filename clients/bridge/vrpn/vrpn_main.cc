// SPDX-License-Identifier: Apache-2.0
// tendon-bridge vrpn: connects VRPN programs to Tendon devices.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "clients/bridge/subcommands.h"
#include "clients/bridge/vrpn/vrpn_server.h"
#include "clients/cpp/machine.h"
#include "clients/cpp/stop_signals.h"

namespace tendon::bridge {
namespace {

struct VrpnOptions {
  BridgeConfig bridge;
  std::vector<std::string> names;
  std::string listen = "127.0.0.1:3883";
  bool anybody = false;
  double duration_s = 0;
};

constexpr int kTurnsAtOnce = 4;

/// Parses "Phantom0=right", or "Phantom0" for the first device. Adds the device to `devices`.
vrpn::Server::Alias alias_of(const std::string& text, std::vector<std::string>& devices) {
  const std::size_t equals = text.find('=');
  const std::string name = text.substr(0, equals);
  if (name.empty() || name.size() > vrpn::kLongestName || name.find_first_of("@: /") != std::string::npos) {
    throw std::runtime_error("--name " + text + ": expected NAME=DEVICE, with a name of at most " +
                             std::to_string(vrpn::kLongestName) + " characters without @, :, / and spaces");
  }
  if (equals == std::string::npos) {
    if (devices.empty()) devices.emplace_back();
    return {name, 0};
  }
  const std::string device = text.substr(equals + 1);
  const auto found = std::ranges::find(devices, device);
  const auto index = static_cast<std::size_t>(found - devices.begin());
  if (found == devices.end()) devices.push_back(device);
  return {name, index};
}

vrpn::Server::Config config_of(VrpnOptions& options) {
  vrpn::Server::Config config{.listen = parse_address(options.listen), .names = {}};
  if (!is_ipv4(config.listen))
    throw std::runtime_error("--listen " + options.listen +
                             ": expected an IPv4 address, because VRPN only supports IPv4");
  if (!is_loopback(config.listen) && !options.anybody) {
    throw std::runtime_error("--listen " + options.listen +
                             ": expected a loopback address, or --anybody: anyone who can reach this port can move the "
                             "motors, because VRPN has no authentication");
  }
  for (const std::string& text : options.names) config.names.push_back(alias_of(text, options.bridge.devices));
  if (config.names.empty() && options.bridge.devices.empty())
    config.names.push_back(alias_of("Phantom0", options.bridge.devices));
  if (options.names.empty()) {
    for (std::size_t i = config.names.size(); i < options.bridge.devices.size(); ++i) {
      config.names.push_back({options.bridge.devices[i], i});
    }
  }
  for (std::size_t i = 0; i < config.names.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (config.names[i].name == config.names[k].name) {
        throw std::runtime_error("--name " + config.names[i].name + ": expected unique names");
      }
    }
  }
  return config;
}

int run_vrpn(VrpnOptions& options) {
  const vrpn::Server::Config config = config_of(options);
  const StopSignals signals;
  const LocalTime start = read_clock();
  const LocalTime end = options.duration_s > 0 ? start + from_seconds(options.duration_s) : LocalTime::max();
  BridgeHost host(options.bridge, start);
  vrpn::Server server(host, config, start);
  if (options.bridge.json) {
    std::cout << nlohmann::json{{"event", "listening"}, {"address", to_string(server.address())}} << std::endl;
  }
  std::string names;
  for (const auto& alias : config.names)
    names += (names.empty() ? "" : ", ") + alias.name + " (" + host.name(alias.index) + ")";
  host.say("VRPN at " + to_string(server.address()) + ": " + names);
  if (!is_loopback(config.listen))
    host.say("anyone who can reach this port can move the motors: VRPN has no authentication");
  // Messages contain the time of day, and the system clock may be adjusted while running.
  Duration to_1970{};
  LocalTime look_again = start;
  LocalTime now = start;
  while (!signals.asked() && now < end) {
    if (now >= look_again) {
      to_1970 = std::chrono::system_clock::now().time_since_epoch() - now.time_since_epoch();
      look_again = now + std::chrono::seconds(1);
    }
    LocalTime next = host.turn(now, server.counts());
    for (int i = 0; i < kTurnsAtOnce && next <= now; ++i) next = host.turn(now = read_clock(), server.counts());
    next = std::min(next, server.turn({now, now.time_since_epoch() + to_1970}));
    now = read_clock();
    host.wait(server.polled(), now, std::min(next, end));
    now = read_clock();
  }
  return host.stop(now);
}

}  // namespace

void add_vrpn(CLI::App& app, Chosen& chosen) {
  CLI::App* vrpn = app.add_subcommand("vrpn", "Run a VRPN server; programs connect to NAME@localhost");
  static VrpnOptions options;  // written by CLI11 while parsing
  vrpn->footer("Example: tendon-bridge vrpn --server lab:47100 --name Phantom0=right");
  add_common(*vrpn, options.bridge);
  vrpn->add_option("--name", options.names,
                   "VRPN name, and its device (default: the first device), repeatable. Default: the name of each "
                   "--device, or Phantom0")
      ->type_name("NAME=DEVICE");
  vrpn->add_option("--listen", options.listen, "Address for programs, TCP and UDP. Port 0: a free port")
      ->type_name("HOST:PORT")
      ->capture_default_str();
  vrpn->add_flag(
      "--anybody", options.anybody,
      "Accept other machines. Anyone who can reach the port can move the motors, because VRPN has no authentication");
  vrpn->add_option("--duration-s", options.duration_s, "Stop after this time, s. 0: run until Ctrl-C")
      ->check(CLI::NonNegativeNumber);
  vrpn->callback([&chosen] { chosen = [] { return run_vrpn(options); }; });
}

}  // namespace tendon::bridge
