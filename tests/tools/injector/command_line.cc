// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/command_line.h"

#include <CLI/CLI.hpp>
#include <charconv>
#include <stdexcept>
#include <system_error>
#include <type_traits>

#include "clients/cpp/usage.h"
#include "server/build_info.h"
#include "tests/tools/injector/profile/scenario.h"

namespace tendon::injector {
namespace {

constexpr const char* kAbout =
    "Simulate a bad network, reproducibly: a UDP proxy between any client and any server, without root.\n"
    "Prints the seed of every run. The same seed and the same traffic give the same result.";

constexpr const char* kExamples =
    "Examples\n"
    "  Simulate a bad Wi-Fi. Clients connect to port 47101 instead of 47100\n"
    "    tendon-inject --listen 127.0.0.1:47101 --to 127.0.0.1:47100 --profile wifi-bad --seed 7\n"
    "  Delay by 20 ms each way, and lose 2 % in bursts of three; limit the rate to the client\n"
    "    tendon-inject --listen 127.0.0.1:47101 --to 127.0.0.1:47100 --profile 'delay=20ms loss=burst(2%,3)' \\\n"
    "      --down 'delay=20ms rate=1Mbit/s queue=20packets'\n"
    "  Record a run, and repeat it\n"
    "    tendon-inject --listen 127.0.0.1:47101 --to 127.0.0.1:47100 --profile lte-driving --record run.csv\n"
    "    tendon-inject --listen 127.0.0.1:47101 --to 127.0.0.1:47100 --replay run.csv\n"
    "  Repeat it once, with more losses\n"
    "    tendon-inject --listen 127.0.0.1:47101 --to 127.0.0.1:47100 --replay run.csv --at-end stop \\\n"
    "      --add 'loss=burst(1%,3)' --seed 7\n"
    "  Print what would happen to 1000 packets, without sending them\n"
    "    tendon-inject --dry-run --count 1000 --seed 7 --profile wifi-bad --json\n\n"
    "Commands during a run: type them in the terminal, or use --control PATH and `tendon-inject control PATH "
    "COMMAND`:\n"
    "  up|down|both LINE|NAME    change the network now; `link N up …` for client N only\n"
    "  stats                     print the report as one JSON object\n"
    "  note TEXT                 add a note to the trace\n"
    "  stop                      end the run\n\n"
    "Exit: 0 success; 1 failed, or the run was INVALID, because the proxy could not simulate the network exactly;\n"
    "2 wrong usage.";

/// CLI11 would accept -1 as 2⁶⁴ − 1.
std::uint64_t parse_seed(const std::string& text) {
  std::uint64_t seed = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, seed);
  if (error != std::errc{} || stop != end) {
    throw std::invalid_argument("--seed: expected a whole number from 0 to 18446744073709551615, got \"" + text + "\"");
  }
  return seed;
}

/// `Where` is an Address or a ServerName. Does not resolve names.
template <class Where>
Where parse_option(const char* option, const std::string& text) {
  try {
    if constexpr (std::is_same_v<Where, Address>) {
      return parse_address(text);
    } else {
      return Where(text);
    }
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(std::string(option) + ": " + error.what());
  }
}

CLI::Validator between(double least, double most) { return CLI::Range(least, most).description(""); }

struct Said {
  NetworkOptions network;
  std::string seed;
  std::string replay_by = "index";
  std::string at_end;
  std::string listen;
  std::string to;
  bool open_to_network = false;
  double duration_s = 0;
  double max_release_error_us = static_cast<double>(kMaxReleaseError.count()) / 1e3;
  double spin_us = static_cast<double>(kSpin.count()) / 1e3;
  int realtime = 0;
  std::size_t max_clients = 64;
  std::filesystem::path record;
  std::filesystem::path control;
  bool json = false;
  bool profiles = false;
  bool scenario_help = false;
  bool dry = false;
  DryRun dry_run;
  std::filesystem::path control_path;
  std::vector<std::string> control_words;
  ImportTask import;
  std::string share;
  double interval_ms = 1000;
  double clock_offset_ms = 0;
  std::filesystem::path trace;
  SelftestOptions selftest;
  std::string data;
};

struct Subcommands {
  CLI::App* control;
  CLI::App* import;
  CLI::App* export_delays;
  CLI::App* selftest;
};

Subcommands add_subcommands(CLI::App& app, Said& said) {
  Subcommands verbs{};
  verbs.control = app.add_subcommand("control", "Send one command to a running tendon-inject with --control PATH");
  verbs.control->add_option("PATH", said.control_path, "Socket of the running program")->required();
  verbs.control->add_option("COMMAND", said.control_words, "Command, for example: up wifi-bad")->required();

  verbs.control->footer("Example\n  tendon-inject control /tmp/inject.sock up wifi-bad");

  verbs.import = app.add_subcommand("import", "Convert a measurement to a trace for --replay");
  verbs.import
      ->add_option("FORMAT", said.import.format,
                   "ping, irtt (its JSON), csv (delays in ms), mahimahi (log of mm-link), or pcap (capture by tcpdump)")
      ->required()
      ->check(usage::one_of({"ping", "irtt", "csv", "mahimahi", "pcap"}));
  verbs.import->add_option("FILE", said.import.from, "File with the measurement; pcap: capture at the client")
      ->required();
  verbs.import->add_option("SERVER", said.import.server, "pcap: capture at the server, for one-way delays of UDP");
  verbs.import->add_option("--port", said.import.taps.port, "pcap: UDP port of the server")
      ->type_name("PORT")
      ->check(between(1, 65535));
  verbs.import
      ->add_option("--server-port", said.import.taps.server_port,
                   "pcap: this port in the capture at the server, if a proxy or a NAT translates it")
      ->type_name("PORT")
      ->check(between(1, 65535));
  verbs.import
      ->add_option("--clock-offset-ms", said.clock_offset_ms,
                   "pcap: clock at the server minus clock at the client, ms. Default: 0, for synchronized clocks")
      ->type_name("MS")
      ->check(between(-1e11, 1e11));
  verbs.import->add_option("--out", said.import.to, "Output file")->type_name("TRACE")->required();
  verbs.import
      ->add_option("--share", said.share,
                   "Direction of the delays: halves (half of a round trip for each direction), up, down, both, or "
                   "measured (irtt with synchronized clocks). Default: halves for ping and irtt, otherwise both")
      ->check(usage::one_of({"halves", "up", "down", "both", "measured"}));
  verbs.import
      ->add_option("--interval-ms", said.interval_ms, "Interval of the measurements, ms, if the file has no times")
      ->type_name("MS")
      ->check(between(1e-6, 1e9))
      ->capture_default_str();

  verbs.import->footer(
      "A csv has one row for each datagram, and a first line with the names of the columns; others are ignored:\n"
      "  t_ms      time of sending; must not decrease. Without this column, the interval is --interval-ms\n"
      "  delay_ms  delay; empty: lost\n"
      "  dir       up or down, instead of --share\n"
      "Without names of columns, it has one column with the delays in ms, and a blank line is a lost datagram.\n"
      "Other units are converted (t_s, delay_us, \"delay [s]\"). The separator is a comma, semicolon or tab. With\n"
      "semicolons or tabs, numbers can have decimal commas. A profile can use the same file: delay=samples(FILE).\n\n"
      "Examples\n"
      "  tcpdump -s 0 -w client.pcap udp port 47100       at the client, and in the same way at the server\n"
      "  tendon-inject import pcap client.pcap server.pcap --port 47100 --out run.csv\n"
      "  ping -D -c 1000 -i 0.2 example.org >ping.txt\n"
      "  tendon-inject import ping ping.txt --out run.csv\n"
      "  printf 't_ms,delay_ms\\n0,20.1\\n10,\\n20,21\\n' >delays.csv\n"
      "  tendon-inject import csv delays.csv --share both --out run.csv");

  verbs.export_delays = app.add_subcommand("export", "Print the actual one-way delays of a trace as CSV");
  verbs.export_delays->add_option("TRACE", said.trace, "Recorded or imported trace")->required();

  verbs.export_delays->footer("Example\n  tendon-inject export run.csv >delays.csv");

  verbs.selftest = app.add_subcommand("selftest", "Compare the decisions of each model with its definition");
  verbs.selftest->add_option("--count", said.selftest.count, "Datagrams for each model")
      ->type_name("N")
      ->check(between(1000, 1e9))
      ->capture_default_str();
  verbs.selftest->add_option("--seed", said.seed, "Seed of the random numbers")->type_name("N");
  verbs.selftest
      ->add_option("--data", said.data, "Folder with measured histograms (*.csv), each of which is an additional model")
      ->type_name("FOLDER");
  verbs.selftest->add_flag("--json", said.json, "Print JSON on stdout, one object per line");
  verbs.selftest->footer("Example\n  tendon-inject selftest --count 100000 --json");
  return verbs;
}

ImportTask import_task(Said said) {
  ImportTask task = std::move(said.import);
  if (task.format != "pcap" &&
      (!task.server.empty() || task.taps.port + task.taps.server_port != 0 || said.clock_offset_ms != 0)) {
    throw std::invalid_argument("a second file, --port, --server-port and --clock-offset-ms are only for import pcap");
  }
  if (task.server.empty() != (task.taps.port == 0)) {
    throw std::invalid_argument("import pcap: expected two captures and --port, or one capture of pings");
  }
  if (!task.server.empty() && !said.share.empty()) {
    throw std::invalid_argument("--share: expected one capture, because two captures have both directions");
  }
  task.taps.clock_offset = from_seconds(said.clock_offset_ms / 1e3);
  const bool round_trips = task.format == "ping" || task.format == "irtt" || task.format == "pcap";
  const std::string share = said.share.empty() ? (round_trips ? "halves" : "both") : said.share;
  task.options.share = share == "halves" ? Share::kHalves
                       : share == "up"   ? Share::kUp
                       : share == "down" ? Share::kDown
                       : share == "both" ? Share::kBoth
                                         : Share::kMeasured;
  task.options.interval = from_seconds(said.interval_ms / 1e3);
  return task;
}

void add_options(CLI::App& app, Said& said) {
  app.add_option("--listen", said.listen, "Address for clients. Port 0: a free port")->type_name("HOST:PORT");
  app.add_option("--to", said.to, "Address or host name of the server")->type_name("HOST:PORT");
  app.add_flag(
      "--open-to-network", said.open_to_network,
      "Accept clients from other machines at --listen: each of them can send to the server through this proxy");
  app.add_option("--max-clients", said.max_clients, "Number of simultaneous clients; others are refused")
      ->type_name("N")
      ->check(between(1, 1000))
      ->capture_default_str();
  app.add_option("--duration-s", said.duration_s, "Stop after this time, s")->type_name("S")->check(between(1e-3, 1e9));

  const char* const network = "Network";
  app.add_option("--profile", said.network.profile,
                 "Profile of both directions: a name (see --profiles), a line like 'delay=20ms loss=2%', or a name "
                 "with changes: 'wifi-bad loss=5%'")
      ->type_name("LINE|NAME")
      ->group(network);
  app.add_option("--up", said.network.up, "Profile from client to server, if different")
      ->type_name("LINE|NAME")
      ->group(network);
  app.add_option("--down", said.network.down, "Profile from server to client, if different")
      ->type_name("LINE|NAME")
      ->group(network);
  app.add_option("--seed", said.seed, "Seed of the random numbers. Default: a new one, which is printed")
      ->type_name("N")
      ->group(network);
  app.add_option("--scenario", said.network.scenario, "TOML file with changes of the network, instead of a profile")
      ->type_name("FILE")
      ->group(network)
      ->excludes("--profile", "--up", "--down");
  app.add_flag("--scenario-help", said.scenario_help, "Print the keys of such a file and exit")->group(network);
  app.add_option("--replay", said.network.replay, "Recorded or imported trace to repeat, instead of a profile")
      ->type_name("TRACE")
      ->group(network)
      ->excludes("--profile", "--up", "--down", "--scenario");
  app.add_option("--by", said.replay_by,
                 "Treat each datagram like the recorded datagram with the same index, or at the same time")
      ->check(usage::one_of({"index", "time"}))
      ->needs("--replay")
      ->group(network);
  app.add_option("--at-end", said.at_end,
                 "After the end of the trace: repeat it, stop the run, or pass all datagrams without delay. Default: "
                 "repeat")
      ->check(usage::one_of({"repeat", "stop", "pass"}))
      ->needs("--replay")
      ->group(network);
  app.add_option("--add", said.network.add,
                 "Profile that follows the trace, with random numbers of its own (--seed): delays add, and either can "
                 "lose a datagram")
      ->type_name("LINE|NAME")
      ->needs("--replay")
      ->group(network);
  app.add_flag("--profiles", said.profiles, "Print the named profiles with their sources and exit")->group(network);

  const char* const output = "Output";
  app.add_flag("--json", said.json, "Print JSON on stdout, one object per line, each second and at the end")
      ->group(output);
  app.add_option("--record", said.record, "Record each decision, planned and actual, in a trace (CSV)")
      ->type_name("TRACE")
      ->group(output);
  app.add_option("--control", said.control, "Accept commands on this Unix socket too")
      ->type_name("PATH")
      ->group(output);

  const char* const accuracy = "Accuracy";
  app.add_option("--max-release-error-us", said.max_release_error_us,
                 "Mark the run INVALID if 1 % of the datagrams leave later than planned by this, µs. The default is "
                 "one period of a haptic device")
      ->type_name("US")
      ->check(between(0, 1e9))
      ->capture_default_str()
      ->group(accuracy);
  app.add_option("--spin-us", said.spin_us,
                 "Wait actively for this long before each release, µs, because threads wake up late; 0 needs less "
                 "processor time")
      ->type_name("US")
      ->check(between(0, 1e6))
      ->capture_default_str()
      ->group(accuracy);
  app.add_option("--realtime", said.realtime, "Priority 1…99 of SCHED_FIFO, if permitted")
      ->type_name("P")
      ->check(between(1, 99))
      ->group(accuracy);

  const char* const dry = "Dry run";
  app.add_flag("--dry-run", said.dry, "Print what would happen to packets, without sending them")->group(dry);
  app.add_option("--count", said.dry_run.count, "Total number of packets, alternately up and down")
      ->type_name("N")
      ->check(between(1, 1e12))
      ->capture_default_str()
      ->needs("--dry-run")
      ->group(dry);
  app.add_option("--rate-hz", said.dry_run.rate_hz, "Packets per second in each direction")
      ->type_name("HZ")
      ->check(between(1, 1e9))
      ->capture_default_str()
      ->needs("--dry-run")
      ->group(dry);
  app.add_option("--bytes", said.dry_run.bytes, "Bytes of payload")
      ->type_name("N")
      ->check(between(0, 65'507))
      ->capture_default_str()
      ->needs("--dry-run")
      ->group(dry);
}

LiveTask live_task(Said said) {
  if (said.listen.empty()) throw std::invalid_argument("--listen is required");
  if (said.to.empty()) throw std::invalid_argument("--to is required");
  LiveTask task{.network = std::move(said.network), .run = {}};
  LiveRun& run = task.run;
  run.listen = parse_option<Address>("--listen", said.listen);
  run.server = parse_option<ServerName>("--to", said.to);
  if (run.server.instance()) {
    throw std::invalid_argument("--to: expected HOST:PORT, got \"" + said.to +
                                "\": a proxy has no key, which is required to verify the name of a DNS-SD service");
  }
  if (!is_loopback(run.listen) && !said.open_to_network) {
    throw std::invalid_argument("cannot listen on " + said.listen +
                                ": anyone on the network could send to the server through this proxy; use a "
                                "loopback address (127.0.0.1 or [::1]), or --open-to-network");
  }
  if (said.duration_s > 0) run.duration = from_seconds(said.duration_s);
  if (said.realtime > 0) run.realtime = said.realtime;
  run.max_clients = said.max_clients;
  run.max_release_error = from_seconds(said.max_release_error_us / 1e6);
  run.spin = from_seconds(said.spin_us / 1e6);
  run.record = said.record;
  run.control = said.control;
  run.json = said.json;
  return task;
}

}  // namespace

Task parse_command_line(int argc, const char* const* argv) {
  Said said;
  CLI::App app(kAbout, "tendon-inject");
  usage::dress(app);
  app.footer(kExamples);
  app.set_version_flag("--version", version_text());
  add_options(app, said);
  app.require_subcommand(0, 1);
  const Subcommands verbs = add_subcommands(app, said);
  try {
    tendon::usage::parse(app, argc, argv);
  } catch (const CLI::CallForHelp&) {
    const auto chosen = app.get_subcommands();
    return HelpTask{chosen.empty() ? app.help() : chosen.front()->help()};
  } catch (const CLI::CallForVersion& version) {
    return HelpTask{std::string(version.what()) + "\n"};
  } catch (const CLI::ParseError& error) {
    throw std::invalid_argument(usage::problem(app, error) + " (see --help)");
  }
  if (verbs.control->parsed()) {
    std::string line;
    for (const std::string& word : said.control_words) line += (line.empty() ? "" : " ") + word;
    return ControlTask{said.control_path, line};
  }
  if (verbs.import->parsed()) return import_task(said);
  if (verbs.export_delays->parsed()) return ExportTask{said.trace};
  if (verbs.selftest->parsed()) {
    said.selftest.json = said.json;
    if (!said.data.empty()) said.selftest.data = said.data;
    if (!said.seed.empty()) said.selftest.seed = parse_seed(said.seed);
    return SelftestTask{said.selftest};
  }
  if (said.scenario_help) return HelpTask{scenario_reference()};
  if (said.profiles) return ProfilesTask{said.json};
  if (!said.seed.empty()) said.network.seed = parse_seed(said.seed);
  if (said.replay_by == "time") said.network.replay_by = TracePlayer::By::kTime;
  using AtEnd = TracePlayer::AtEnd;
  if (!said.at_end.empty()) {
    said.network.at_end = said.at_end == "stop" ? AtEnd::kStop : said.at_end == "pass" ? AtEnd::kPass : AtEnd::kRepeat;
  }
  if (said.dry) {
    said.dry_run.json = said.json;
    return DryTask{std::move(said.network), said.dry_run, said.record};
  }
  return live_task(std::move(said));
}

}  // namespace tendon::injector
