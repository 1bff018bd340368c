// SPDX-License-Identifier: Apache-2.0
// tendon-bridge igtl: connects OpenIGTLink programs to Tendon devices.
#include <CLI/CLI.hpp>
#include <chrono>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "clients/bridge/bridge_loop.h"
#include "clients/bridge/igtl/igtl_server.h"
#include "clients/bridge/subcommands.h"
#include "clients/cpp/usage.h"

namespace tendon::bridge {
namespace {

struct IgtlOptions {
  BridgeConfig bridge;
  igtl::Station::Config station;
  std::vector<std::string> names;
  std::string frame = "ras";
  std::string listen = "127.0.0.1:18944";
  bool anybody = false;
  double duration_s = 0;
};

constexpr double kMillimetres = 1000;

igtl::Server::Config config_of(IgtlOptions& options) {
  igtl::Server::Config config{
      .listen = parse_address(options.listen),
      .names = read_aliases(options.names, options.bridge.devices, igtl::Station::kLongestName, "device"),
      .station = options.station};
  if (!is_ipv4(config.listen)) {
    throw std::runtime_error("--listen " + options.listen +
                             ": expected an IPv4 address, as OpenIGTLink's library uses");
  }
  if (!is_loopback(config.listen) && !options.anybody) {
    throw std::runtime_error("--listen " + options.listen +
                             ": expected a loopback address, or --anybody: anyone who can reach this port can move the "
                             "motors, because OpenIGTLink has no authentication");
  }
  if (!config.station.target.empty() && config.names.size() > 1) {
    throw std::runtime_error("--target " + config.station.target + ": expected one device");
  }
  if (config.station.target.size() > igtl::kLongestName) {
    throw std::runtime_error("--target " + config.station.target + ": expected at most " +
                             std::to_string(igtl::kLongestName) + " characters");
  }
  config.station.frame = *find_frame(options.frame);
  config.station.frame.per_metre = kMillimetres;
  return config;
}

int run_igtl(IgtlOptions& options) {
  const igtl::Server::Config config = config_of(options);
  const StopSignals signals;
  const LocalTime start = read_clock();
  const LocalTime end = options.duration_s > 0 ? start + from_seconds(options.duration_s) : LocalTime::max();
  BridgeHost host(options.bridge, start);
  igtl::Server server(host, config);
  if (options.bridge.json) {
    std::cout << nlohmann::json{{"event", "listening"}, {"address", to_string(server.address())}} << std::endl;
  }
  host.say("OpenIGTLink at " + to_string(server.address()) + ", in mm; " + options.frame + ": " +
           std::string(config.station.frame.axes));
  if (!is_loopback(config.listen))
    host.say("anyone who can reach this port can move the motors: OpenIGTLink has no authentication");
  return run_bridge(host, server, signals, end, [] {
    return std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch());
  });
}

}  // namespace

void add_igtl(CLI::App& app, Chosen& chosen) {
  CLI::App* igtl = app.add_subcommand("igtl", "Run an OpenIGTLink server, for 3D Slicer and other programs");
  static IgtlOptions options;  // written by CLI11 while parsing
  igtl->footer("Example: tendon-bridge igtl --server lab:47100 --device right");
  add_common(*igtl, options.bridge);
  igtl->add_option("--name", options.names,
                   "Name of a device in the messages, and the device (default: the first device), repeatable. Default: "
                   "the name of each --device, or device")
      ->type_name("NAME=DEVICE");
  igtl->add_option(
          "--frame", options.frame,
          "Axes of all positions and forces. ras: of a patient who faces the operator, as in the front view of "
          "3D Slicer; operator: x right, y up, z to the user")
      ->check(usage::one_of(std::vector<std::string>{"ras", "operator"}))
      ->capture_default_str();
  igtl->add_option("--rate", options.station.rate_hz, "Poses and forces per second")
      ->type_name("HZ")
      ->check(CLI::Range(1.0, 1000.0))
      ->capture_default_str();
  igtl->add_option("--stiffness", options.station.stiffness, "N/m, of the spring that pulls the hand to the target")
      ->check(CLI::Range(0.0, 100'000.0))
      ->capture_default_str();
  igtl->add_option("--target", options.station.target, "Name of the TRANSFORM with the target. Default: NAMETarget")
      ->type_name("TRANSFORM");
  igtl->add_option("--listen", options.listen, "Address for programs. Port 0: a free port")
      ->type_name("HOST:PORT")
      ->capture_default_str();
  igtl->add_flag("--anybody", options.anybody,
                 "Accept other machines. Anyone who can reach the port can move the motors, because OpenIGTLink has no "
                 "authentication");
  igtl->add_option("--duration-s", options.duration_s, "Stop after this time, s. 0: run until Ctrl-C")
      ->check(CLI::NonNegativeNumber);
  igtl->callback([&chosen] { chosen = [] { return run_igtl(options); }; });
}

}  // namespace tendon::bridge
