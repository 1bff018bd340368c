// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/command_line.h"

#include <CLI/CLI.hpp>
#include <charconv>
#include <stdexcept>
#include <system_error>
#include <type_traits>

#include "clients/cpp/usage.h"
#include "server/build_info.h"
#include "tests/tools/injector/profile/named_profiles.h"

namespace tendon::injector {
namespace {

constexpr const char* kAbout =
    "A bad network that can be replayed, as a UDP proxy: between any client and any server, without root.\n"
    "Prints the seed of every run: the same seed and the same traffic meet the same fates.";

constexpr const char* kExamples =
    "Examples\n"
    "  a bad Wi-Fi; clients connect to port 47101 instead of 47100\n"
    "    tendon-inject --listen 127.0.0.1:47101 --to 127.0.0.1:47100 --profile wifi-bad --seed 7\n"
    "  20 ms each way, one datagram in fifty lost, in bursts of three; the way down is slow besides\n"
    "    tendon-inject --listen 127.0.0.1:47101 --to 127.0.0.1:47100 --profile 'delay=20ms loss=burst(2%,3)' \\\n"
    "      --down 'delay=20ms rate=1Mbit/s queue=20packets'\n"
    "  record a run, and meet the same fates once more\n"
    "    tendon-inject --listen 127.0.0.1:47101 --to 127.0.0.1:47100 --profile lte-driving --record run.csv\n"
    "    tendon-inject --listen 127.0.0.1:47101 --to 127.0.0.1:47100 --replay run.csv\n"
    "  what would happen to 1000 packets, in no time\n"
    "    tendon-inject --dry-run --count 1000 --seed 7 --profile wifi-bad --json\n"
    "\n"
    "Live: type a command while it runs in a terminal, or use --control PATH and `tendon-inject control PATH "
    "COMMAND`:\n"
    "  up|down|both LINE|NAME    another network from now on; `link N up …` for client N only\n"
    "  stats                     the report as one JSON object\n"
    "  note TEXT                 into the trace\n"
    "  stop                      the end\n"
    "\n"
    "Exit: 0 done; 1 failed, or the run was INVALID: the proxy could not keep up with the network that it was asked "
    "for;\n"
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
  bool dry = false;
  DryRun dry_run;
  std::filesystem::path control_path;
  std::vector<std::string> control_words;
  ImportTask import;
  std::string share;
  double interval_ms = 1000;
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
  verbs.control = app.add_subcommand("control", "send one command to a tendon-inject that runs with --control PATH");
  verbs.control->add_option("PATH", said.control_path, "its socket")->required();
  verbs.control->add_option("COMMAND", said.control_words, "for example: up wifi-bad")->required();

  verbs.control->footer("Example\n  tendon-inject control /tmp/inject.sock up wifi-bad");

  verbs.import = app.add_subcommand("import", "make a trace for --replay of what others have measured");
  verbs.import
      ->add_option("FORMAT", said.import.format,
                   "ping, irtt (its JSON), csv (delays in ms), or mahimahi (mm-link's log)")
      ->required()
      ->check(usage::one_of({"ping", "irtt", "csv", "mahimahi"}));
  verbs.import->add_option("FILE", said.import.from, "the measurement")->required();
  verbs.import->add_option("--out", said.import.to, "the trace")->type_name("TRACE")->required();
  verbs.import
      ->add_option(
          "--share", said.share,
          "whose delay it is: halves (of a round trip, for each direction), up, down, both, or measured (irtt with "
          "clocks in step)")
      ->check(usage::one_of({"halves", "up", "down", "both", "measured"}));
  verbs.import
      ->add_option("--interval-ms", said.interval_ms, "from one measurement to the next, where the file does not say")
      ->type_name("MS")
      ->check(between(1e-6, 1e9))
      ->capture_default_str();

  verbs.import->footer(
      "A csv has one row for each datagram, and a first line with the names of its columns; others are ignored:\n"
      "  t_ms      when it was sent; must not fall. Without this column, each is --interval-ms after the one before\n"
      "  delay_ms  how long it took; empty: it was lost\n"
      "  dir       up or down, in place of --share\n"
      "Without a first line it has one column, the delays in ms, and a blank line is a lost datagram. Other units are\n"
      "converted (t_s, delay_us, \"delay [s]\"). Commas, semicolons or tabs separate; between semicolons or tabs, "
      "numbers\n"
      "may have decimal commas. A profile takes the same file: delay=samples(FILE).\n\n"
      "Examples\n"
      "  ping -D -c 1000 -i 0.2 example.org >ping.txt\n  tendon-inject import ping ping.txt --out run.csv\n"
      "  printf 't_ms,delay_ms\\n0,20.1\\n10,\\n20,21\\n' >delays.csv\n"
      "  tendon-inject import csv delays.csv --share both --out run.csv");

  verbs.export_delays = app.add_subcommand("export", "print the true one-way delays of a trace as CSV");
  verbs.export_delays->add_option("TRACE", said.trace, "a recorded or imported trace")->required();

  verbs.export_delays->footer("Example\n  tendon-inject export run.csv >delays.csv");

  verbs.selftest = app.add_subcommand("selftest", "does it do what its profiles say? every model against its law");
  verbs.selftest->add_option("--count", said.selftest.count, "datagrams for each model")
      ->type_name("N")
      ->check(between(1000, 1e9))
      ->capture_default_str();
  verbs.selftest->add_option("--seed", said.seed, "of all random draws")->type_name("N");
  verbs.selftest->add_option("--data", said.data, "a folder of measured histograms (*.csv): one more model each")
      ->type_name("FOLDER");
  verbs.selftest->add_flag("--json", said.json, "one JSON object per line");
  verbs.selftest->footer("Example\n  tendon-inject selftest --count 100000 --json");
  return verbs;
}

ImportTask import_task(Said said) {
  ImportTask task = std::move(said.import);
  const bool round_trips = task.format == "ping" || task.format == "irtt";
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
  app.add_option("--listen", said.listen, "where clients send to (port 0: any free one)")->type_name("HOST:PORT");
  app.add_option("--to", said.to, "the server, anywhere: an address or a host name")->type_name("HOST:PORT");
  app.add_flag("--open-to-network", said.open_to_network,
               "let --listen be an address that other machines can reach: whoever does can send to the server through "
               "this proxy");
  app.add_option("--max-clients", said.max_clients, "at one time; others are refused")
      ->type_name("N")
      ->check(between(1, 1000))
      ->capture_default_str();
  app.add_option("--duration-s", said.duration_s, "stop after this time")->type_name("S")->check(between(1e-3, 1e9));

  const char* const network = "The network";
  app.add_option(
         "--profile", said.network.profile,
         "both directions: a name (--profiles lists them), a line like 'delay=20ms loss=2%', or a name and what is "
         "to be different: 'wifi-bad loss=5%'")
      ->type_name("LINE|NAME")
      ->group(network);
  app.add_option("--up", said.network.up, "client to server, where it differs")->type_name("LINE|NAME")->group(network);
  app.add_option("--down", said.network.down, "server to client, where it differs")
      ->type_name("LINE|NAME")
      ->group(network);
  app.add_option("--seed", said.seed, "of all random draws; picked and printed when not given")
      ->type_name("N")
      ->group(network);
  app.add_option("--scenario", said.network.scenario, "a script (TOML) of how the network changes, instead")
      ->type_name("FILE")
      ->group(network)
      ->excludes("--profile", "--up", "--down");
  app.add_option("--replay", said.network.replay, "the fates of a recorded or imported trace instead")
      ->type_name("TRACE")
      ->group(network)
      ->excludes("--profile", "--up", "--down", "--seed", "--scenario");
  app.add_option("--by", said.replay_by,
                 "which recorded fate a datagram meets: that of the datagram of the same index, or of the same time")
      ->check(usage::one_of({"index", "time"}))
      ->needs("--replay")
      ->group(network);
  app.add_flag("--profiles", said.profiles, "list the named networks")->group(network);

  const char* const output = "What it tells";
  app.add_flag("--json", said.json, "one JSON object per line on stdout: each second and at the end")->group(output);
  app.add_option("--record", said.record, "every decision, planned and actual, as a trace (CSV)")
      ->type_name("TRACE")
      ->group(output);
  app.add_option("--control", said.control, "take commands on a Unix socket, too")->type_name("PATH")->group(output);

  const char* const honesty = "How exact it is";
  app.add_option(
         "--max-release-error-us", said.max_release_error_us,
         "INVALID when one datagram in a hundred leaves later than this after it was due; the default is a haptic "
         "period")
      ->type_name("US")
      ->check(between(0, 1e9))
      ->capture_default_str()
      ->group(honesty);
  app.add_option("--spin-us", said.spin_us,
                 "awake for this long before each release, because a sleeper wakes late; 0 saves the processor")
      ->type_name("US")
      ->check(between(0, 1e6))
      ->capture_default_str()
      ->group(honesty);
  app.add_option("--realtime", said.realtime, "priority 1…99 of SCHED_FIFO, where that is permitted")
      ->type_name("P")
      ->check(between(1, 99))
      ->group(honesty);

  const char* const dry = "Decisions alone";
  app.add_flag("--dry-run", said.dry, "print what would happen to packets, without sockets")->group(dry);
  app.add_option("--count", said.dry_run.count, "packets in all, up and down by turns")
      ->type_name("N")
      ->check(between(1, 1e12))
      ->capture_default_str()
      ->needs("--dry-run")
      ->group(dry);
  app.add_option("--rate-hz", said.dry_run.rate_hz, "packets per second of each direction")
      ->type_name("HZ")
      ->check(between(1, 1e9))
      ->capture_default_str()
      ->needs("--dry-run")
      ->group(dry);
  app.add_option("--bytes", said.dry_run.bytes, "of payload")
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
                                "\": a proxy has no key, and only a key tells whose a name of DNS-SD is");
  }
  if (!is_loopback(run.listen) && !said.open_to_network) {
    throw std::invalid_argument("cannot listen on " + said.listen +
                                ": anyone on the network could send to the server through this proxy; use a loopback "
                                "address (127.0.0.1 or [::1]), or say --open-to-network");
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
  if (said.profiles) return ProfilesTask{said.json};
  if (!said.seed.empty()) said.network.seed = parse_seed(said.seed);
  if (said.replay_by == "time") said.network.replay_by = TracePlayer::By::kTime;
  if (said.dry) {
    said.dry_run.json = said.json;
    return DryTask{std::move(said.network), said.dry_run, said.record};
  }
  return live_task(std::move(said));
}

}  // namespace tendon::injector
