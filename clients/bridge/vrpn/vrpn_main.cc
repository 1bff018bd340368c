// SPDX-License-Identifier: Apache-2.0
// tendon-bridge vrpn: connects VRPN programs to Tendon devices.
#include <CLI/CLI.hpp>
#include <chrono>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "clients/bridge/bridge_loop.h"
#include "clients/bridge/subcommands.h"
#include "clients/bridge/vrpn/vrpn_server.h"

namespace tendon::bridge {
namespace {

struct VrpnOptions {
  BridgeConfig bridge;
  std::vector<std::string> names;
  std::string listen = "127.0.0.1:3883";
  bool anybody = false;
  double duration_s = 0;
};

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
  config.names = read_aliases(options.names, options.bridge.devices, vrpn::kLongestName, "Phantom0");
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
  return run_bridge(host, server, signals, end, [] {
    return std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch());
  });
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
