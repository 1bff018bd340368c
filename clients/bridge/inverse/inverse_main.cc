// SPDX-License-Identifier: Apache-2.0
// tendon-bridge inverse: for programs that use the JSON WebSocket protocol of Haply's Inverse service.
#include <CLI/CLI.hpp>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "clients/bridge/subcommands.h"
#include "clients/cpp/machine.h"
#include "clients/cpp/usage.h"
#ifndef TENDON_MISSING
#include "clients/bridge/inverse/inverse_server.h"
#endif

namespace tendon::bridge {

#ifdef TENDON_MISSING

void add_inverse(CLI::App& app, Chosen& chosen) {
  CLI::App* const command = app.add_subcommand("inverse", "Not included in this build: " TENDON_MISSING " was missing");
  command->allow_extras();
  command->callback([&chosen] {
    chosen = []() -> int {
      throw std::runtime_error("inverse is not included in this build: " TENDON_MISSING
                               " was missing; install it and build again");
    };
  });
}

#else

namespace {

struct InverseOptions {
  BridgeConfig bridge;
  InverseServer::Config server;
  std::string listen = to_string(InverseServer::Config{}.listen);
  bool anybody = false;
  double duration_s = 0;
};

int run_inverse(const InverseOptions& options) {
  InverseServer::Config config = options.server;
  config.listen = parse_address(options.listen);
  const bool local = is_loopback(config.listen);
  if (!local && !options.anybody) {
    std::cerr << "--listen " << options.listen
              << ": expected a loopback address, or --anybody: anyone who can reach this port can move the motors\n";
    return 2;
  }
  BridgeConfig host_config = options.bridge;
  host_config.client.valid_for = InverseSession::kFresh;
  BridgeHost host(std::move(host_config), read_clock());
  InverseServer server(config, host, read_clock);
  if (!local) host.say("anyone who can reach " + to_string(server.address()) + " can move the motors");
  const std::string at = to_string(server.address());
  if (options.bridge.json) {
    std::cout << nlohmann::ordered_json{{"event", "listening"}, {"address", at}} << std::endl;
  } else {
    host.say("listening at ws://" + at);
  }
  server.run(from_seconds(options.duration_s));
  return host.stop(read_clock());
}

}  // namespace

void add_inverse(CLI::App& app, Chosen& chosen) {
  CLI::App* const command = app.add_subcommand("inverse",
                                               "Serve the JSON protocol of Haply's Inverse service over a WebSocket, "
                                               "for Isaac Lab, web pages and all languages");
  command->footer("Example: tendon-bridge inverse --server lab:47100 --device right");
  static InverseOptions options;  // the parser writes to this until it calls `chosen`
  add_common(*command, options.bridge);
  command
      ->add_option("--listen", options.listen,
                   "Address of the WebSocket. Port 0: a free port. Other machines are only accepted with --anybody")
      ->type_name("HOST:PORT")
      ->capture_default_str()
      ->check(usage::accepted_by([](const std::string& text) { parse_address(text); }));
  command
      ->add_option(
          "--origin", options.server.origins,
          "Also accept web pages from this origin, such as https://lab.example; otherwise only from this machine")
      ->type_name("URL");
  command->add_flag("--anybody", options.anybody,
                    "Accept other machines. Anyone who can reach the port can move the motors");
  command->add_option("--duration-s", options.duration_s, "Stop after this time, s. 0: run until Ctrl-C")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e9));
  command->callback([&chosen] { chosen = [] { return run_inverse(options); }; });
}

#endif

}  // namespace tendon::bridge
