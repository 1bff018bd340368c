// SPDX-License-Identifier: Apache-2.0
// tendon-dash: a web page with live and recorded data of a Tendon server. It can only arm if permitted explicitly.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstddef>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "clients/cpp/key_file.h"
#include "clients/cpp/machine.h"
#include "clients/cpp/server_name.h"
#include "clients/cpp/usage.h"
#include "clients/dashboard/board.h"
#include "clients/dashboard/feed.h"
#include "clients/dashboard/foxglove_feed.h"
#include "clients/dashboard/metrics.h"
#include "clients/dashboard/observer.h"
#include "clients/dashboard/operator.h"
#include "clients/dashboard/page_files.h"
#include "clients/dashboard/recordings.h"
#include "clients/dashboard/routes.h"
#include "clients/dashboard/server_link.h"
#include "clients/dashboard/web_server.h"
#include "protocol/wire/text.h"
#include "server/machine/output.h"

namespace tendon::dash {
namespace {

std::string new_pass() {
  const Seed seed = seed_from_system();
  std::string pass;
  for (const std::byte byte : std::span(seed.bytes).first(16)) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    pass += kDigits[std::to_integer<unsigned>(byte) >> 4];
    pass += kDigits[std::to_integer<unsigned>(byte) & 15];
  }
  return pass;
}

struct Options {
  ServerName server = "127.0.0.1:47100";
  WebServer::Config web;  ///< `server` is the resolved address
  Routes::Config routes;
  std::string device;
  std::string key_file;
  std::string arm_channel;
  std::string recordings;
  double duration_s = 0;
  bool json = false;
};

std::optional<int> parse(int argc, char** argv, Options& options) {
  CLI::App app(
      "Serve a web page that shows live and recorded data of a Tendon server, /metrics for Prometheus, and /bridge "
      "for\nengines in browsers.",
      "tendon-dash");
  usage::dress(app);
  app.footer(
      "Example: tendon-dash --server 127.0.0.1:47100 --recordings . --listen 127.0.0.1:8080\n"
      "then open http://127.0.0.1:8080 in a browser, or ws://127.0.0.1:8080/foxglove in Foxglove or Lichtblick.\n\n"
      "Exit: 0 success; 1 failed, or no server replied; 2 wrong usage.");
  app.set_help_flag("-h,--help", "Print this help and exit");
  app.set_version_flag("--version", TENDON_VERSION);
  std::string server = options.server.text();
  std::string listen = to_string(options.web.listen);
  const auto address = usage::accepted_by([](const std::string& text) { parse_address(text); });
  const auto name = usage::accepted_by([](const std::string& text) { ServerName{text}; });
  app.add_option("--server", server,
                 "Address of tendond: an IP address, a host name or dns-sd:NAME. Names are resolved once, and all of "
                 "their addresses are tried")
      ->type_name("HOST:PORT")
      ->capture_default_str()
      ->check(name);
  app.add_option("--device", options.device,
                 "Show the bank of this device, for a server with more than 16 devices, which has banks of 16. "
                 "Default: the first bank")
      ->type_name("NAME");
  app.add_option("--key", options.key_file,
                 "Key file from `tendond keygen --observer`. Not required for a server on this machine without keys")
      ->type_name("FILE");
  app.add_option("--arm", options.arm_channel,
                 "Let anyone who opens the printed address in a browser on this machine arm and disarm through this "
                 "channel. Use a separate channel and a controller's key (--key) for the operator")
      ->type_name("CHANNEL");
  app.add_option("--listen", listen,
                 "Address of the page. Port 0: a free port. Other machines are only accepted with --host")
      ->type_name("HOST:PORT")
      ->capture_default_str()
      ->check(address);
  app.add_option(
         "--host", options.routes.hosts,
         "Host name that browsers on other machines use for this machine. Anyone who can reach it sees all data")
      ->type_name("NAME");
  app.add_option("--origin", options.routes.origins,
                 "Also accept web pages from this origin, such as https://lab.example, for /bridge and /foxglove")
      ->type_name("URL");
  app.add_option("--recordings", options.recordings, "Folder of the recordings (*.mcap) that the page can open")
      ->type_name("FOLDER");
  app.add_option("--duration-s", options.duration_s, "Stop after this time, s. 0: run until Ctrl-C")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e9));
  app.add_flag("--json", options.json, "Print JSON on stdout, one object per line: listening, stopped");
  try {
    usage::parse(app, argc, argv);
  } catch (const CLI::ParseError& error) {
    return usage::exit_code(app, error);
  }
  options.server = server;
  options.web.listen = parse_address(listen);
  if (!is_loopback(options.web.listen) && options.routes.hosts.empty()) {
    std::cerr
        << "--listen " << listen
        << ": expected a loopback address, or --host NAME with the host name that browsers on other machines use\n";
    return 2;
  }
  if (!options.arm_channel.empty() && options.key_file.empty()) {
    std::cerr << "--arm " << options.arm_channel << ": expected --key FILE with a controller's key\n";
    return 2;
  }
  return std::nullopt;
}

int run(const Options& options) {
  const UnblockedOutput output;
  std::optional<ClientKey> key;
  if (!options.key_file.empty()) key = read_client_key(options.key_file);
  const bool arms = !options.arm_channel.empty();
  std::optional<Recordings> recordings;
  if (!options.recordings.empty()) recordings.emplace(options.recordings);

  std::vector<Address> addresses = options.server.look_up(key.has_value()).addresses;
  WebServer::Config web_config = options.web;
  web_config.server = addresses.front();
  addresses.erase(addresses.begin());
  const LocalTime start = read_clock();
  Board board;
  WebCounts counts;
  BridgeCounts bridge;
  std::optional<ServerLink> operator_link;  // separate socket, because the server identifies clients by address
  std::optional<Operator> operates;
  Abilities abilities{.server = options.server.text(), .recordings = recordings.has_value()};
  std::function<std::string(std::uint32_t, Order)> press;
  if (arms) {
    if (key->role != Role::kController) {
      throw std::runtime_error(options.key_file + ": expected a controller's key for --arm, found an observer's key");
    }
    operator_link.emplace(web_config.server);
    abilities.arms = true;
    operates.emplace(*operator_link, web_config.server,
                     Operator::Config{.channel = options.arm_channel, .key = key->key, .seed = seed_from_system()},
                     board);
    abilities.arming_objection = [&](std::uint32_t device) { return operates->objection(device); };
    press = [&](std::uint32_t device, Order order) { return operates->press(read_clock(), device, order); };
  }
  const std::string pass = arms ? new_pass() : std::string();
  Feed feed(board, abilities, counts, start);
  const Routes routes(options.routes, {.page = page_files(),
                                       .recordings = recordings ? &*recordings : nullptr,
                                       .metrics = [&] { return metrics_text(board, counts, bridge); },
                                       .press = press,
                                       .pass = pass});
  FoxgloveFeed foxglove(
      board, {.name = "tendon-dash of " + abilities.server,
              .unix_offset = std::chrono::system_clock::now().time_since_epoch() - read_clock().time_since_epoch()});
  WebServer web(web_config, routes, feed, foxglove, counts, bridge, read_clock);
  Observer observer(web.link(), web_config.server,
                    {.device = options.device,
                     .further = std::move(addresses),
                     .key = key ? std::optional(key->key) : std::nullopt,
                     .seed = seed_from_system()},
                    board, start);

  const std::string at = to_string(web.address());
  const std::string operator_url = arms ? "http://" + at + "/#/operator/" + pass : std::string();
  if (options.json) {
    nlohmann::ordered_json json = {{"event", "listening"}, {"address", at}, {"server", abilities.server}};
    if (arms) json["operator_url"] = operator_url;
    std::cout << json << std::endl;
  } else {
    std::cerr << "tendon-dash: open http://" << at << "/\n";
    if (arms) std::cerr << "tendon-dash: to arm and disarm, open " << operator_url << "\n";
  }

  std::string said;
  const auto turn = [&](LocalTime now) {
    observer.set_watched(feed.pages() > 0 || foxglove.wants_states());
    const LocalTime next = observer.turn(now);
    if (board.contact() != Contact::kGreeting && board.words() != said) {
      std::cerr << "tendon-dash: " << visible(said = board.words()) << '\n';
    }
    return next;
  };
  web.run(from_seconds(options.duration_s), turn, [&](LocalTime now) {
    if (!operates) return;
    operates->move_to(observer.server());
    operates->turn(now);
  });
  if (operates) operates->stop(read_clock());
  observer.stop(read_clock());
  if (options.json) {
    std::cout << nlohmann::ordered_json{{"event", "stopped"},
                                        {"requests", counts.requests},
                                        {"refused", counts.refused},
                                        {"states_skipped", counts.states_skipped},
                                        {"sessions", board.sessions()}}
              << std::endl;
  }
  return board.sessions() > 0 ? 0 : 1;
}

}  // namespace
}  // namespace tendon::dash

int main(int argc, char** argv) {
  tendon::dash::Options options;
  if (const auto exit_code = tendon::dash::parse(argc, argv, options)) return *exit_code;
  try {
    return tendon::dash::run(options);
  } catch (const std::exception& error) {
    std::cerr << "tendon-dash: " << error.what() << '\n';
    return 1;
  }
}
