// SPDX-License-Identifier: Apache-2.0
// tendon-bridge: connects existing programs to Tendon devices without changes. One subcommand for each protocol.
#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <string>

#include "clients/bridge/subcommands.h"
#include "clients/cpp/key_file.h"
#include "clients/cpp/usage.h"

namespace tendon::bridge {
void add_common(CLI::App& app, BridgeConfig& config) {
  config.client.name = "tendon-bridge " + app.get_name();
  app.add_option_function<std::string>(
         "--server", [&](const std::string& text) { config.server = text; },
         "Address of tendond: a host name or an IP address; or dns-sd:NAME, which requires --key")
      ->type_name("HOST:PORT")
      ->default_str(config.server.text())
      ->check(usage::accepted_by([](const std::string& text) { ServerName{text}; }));
  app.add_option_function<std::string>(
         "--key", [&](const std::string& file) { config.client.key = read_client_key(file).key; },
         "Key file from `tendond keygen`. Not required for a server on this machine without keys")
      ->type_name("FILE");
  app.add_option("--device", config.devices, "Name of a device, repeatable. Default: the first device of the server")
      ->allow_extra_args(false)
      ->type_name("NAME");
  app.add_option("--channel", config.client.channel, "Name of the channel of the device")->type_name("NAME");
  app.add_flag("--take-lease", config.client.take_lease, "Request the channel until it is free");
  app.add_flag("--observe", config.observe, "Send no forces");
  app.add_flag("--json", config.json, "Print JSON on stdout, one object per line, once a second for each device");
}

namespace {

constexpr const char* kExitCodes =
    "\n\n"
    "Exit: 0 success; 1 failed, or with --duration-s no server replied; 2 wrong usage.\n"
    "chai3d exits with the exit code of its program.";

int run(int argc, char** argv) {
  CLI::App app(
      "Let existing programs use a Tendon device without new code. tendon-bridge runs on the machine of the program, "
      "and\nconnects to the server over the network with Tendon's encryption and limits.",
      "tendon-bridge");
  usage::dress(app);
  app.footer(std::string("Example: tendon-bridge vrpn --server lab:47100 --name Phantom0=right\n\n"
                         "Run `tendon-bridge COMMAND --help` for the options of a command.") +
             kExitCodes);
  app.set_help_flag("-h,--help", "Print this help and exit");
  app.set_version_flag("--version", TENDON_VERSION);
  app.require_subcommand(1);
  Chosen chosen;
  add_chai3d(app, chosen);
  add_igtl(app, chosen);
  add_inverse(app, chosen);
  add_ros2(app, chosen);
  add_vrpn(app, chosen);
  for (CLI::App* const command : app.get_subcommands([](CLI::App*) { return true; })) {
    command->footer(command->get_footer() + kExitCodes);
  }
  try {
    usage::parse(app, argc, argv);
  } catch (const CLI::ParseError& error) {
    return usage::exit_code(app, error);
  }
  return chosen();
}

}  // namespace
}  // namespace tendon::bridge

int main(int argc, char** argv) {
  try {
    return tendon::bridge::run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "tendon-bridge: " << error.what() << '\n';
    return 1;
  }
}
