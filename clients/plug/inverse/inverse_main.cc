// SPDX-License-Identifier: Apache-2.0
// tendon-plug inverse: for programs that use the JSON WebSocket protocol of Haply's Inverse service.
#include <CLI/CLI.hpp>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "clients/cpp/machine.h"
#include "clients/cpp/usage.h"
#include "clients/plug/subcommands.h"
#ifndef TENDON_MISSING
#include "clients/plug/inverse/inverse_server.h"
#endif

namespace tendon::plug {

#ifdef TENDON_MISSING

void add_inverse(CLI::App& app, Chosen& chosen) {
  CLI::App* const command = app.add_subcommand("inverse", "Not in this build: " TENDON_MISSING " was missing");
  command->allow_extras();
  command->callback([&chosen] {
    chosen = []() -> int {
      throw std::runtime_error("inverse is not in this build: " TENDON_MISSING
                               " was missing; install it and build again");
    };
  });
}

#else

namespace {

struct InverseOptions {
  DeskConfig desk;
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
              << ": beyond this machine only with --anybody, for whoever reaches the port moves a motor\n";
    return 2;
  }
  DeskConfig desk_config = options.desk;
  desk_config.client.valid_for = InverseSession::kFresh;
  Desk desk(std::move(desk_config), read_clock());
  InverseServer server(config, desk, read_clock);
  if (!local) desk.say("whoever reaches " + to_string(server.address()) + " moves a motor");
  const std::string at = to_string(server.address());
  if (options.desk.json) {
    std::cout << nlohmann::ordered_json{{"event", "listening"}, {"address", at}} << std::endl;
  } else {
    desk.say("clients find the device at ws://" + at);
  }
  server.run(from_seconds(options.duration_s));
  return desk.stop(read_clock());
}

}  // namespace

void add_inverse(CLI::App& app, Chosen& chosen) {
  CLI::App* const command = app.add_subcommand(
      "inverse",
      "A WebSocket that answers JSON as Haply's Inverse service does: for Isaac Lab, for pages, for any language");
  command->footer("Example: tendon-plug inverse --server lab:47100 --device right");
  static InverseOptions options;  // the parser writes to it until `chosen` is called
  add_common(*command, options.desk);
  command
      ->add_option("--listen", options.listen,
                   "Where clients find it; port 0 lets the system choose. Beyond this machine only with --anybody")
      ->type_name("HOST:PORT")
      ->capture_default_str()
      ->check(usage::accepted_by([](const std::string& text) { parse_address(text); }));
  command
      ->add_option("--origin", options.server.origins,
                   "Pages from there may come in, beside those of this machine: https://lab.example")
      ->type_name("URL");
  command->add_flag("--anybody", options.anybody, "Listen beyond this machine: whoever reaches the port moves a motor");
  command->add_option("--duration-s", options.duration_s, "Stop after this time, s. 0: run until Ctrl-C")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e9));
  command->callback([&chosen] { chosen = [] { return run_inverse(options); }; });
}

#endif

}  // namespace tendon::plug
