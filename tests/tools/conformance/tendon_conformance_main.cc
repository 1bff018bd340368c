// SPDX-License-Identifier: Apache-2.0
// tendon-conformance: checks a peer against WIRE.md and SESSION.md, or a worker against stream.h of clients/cpp/worker.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "clients/cpp/key_file.h"
#include "clients/cpp/usage.h"
#include "protocol/secrets/suites.h"
#include "server/build_info.h"
#include "tests/tools/conformance/client_checks.h"
#include "tests/tools/conformance/server_checks.h"
#include "tests/tools/conformance/udp_wire.h"
#include "tests/tools/conformance/worker_checks.h"
#include "tests/tools/conformance/worker_wire.h"

namespace tendon::conformance {
namespace {

struct Line {
  std::string server;
  std::string listen = "127.0.0.1:0";
  std::string key;
  std::string log;
  std::vector<std::string> command;
  bool long_checks = false;
  bool follower = false;
  bool json = false;
  int suite = 1;
};

const char* name_of(Side side) {
  switch (side) {
    case Side::kServer:
      return "server";
    case Side::kClient:
      return "client";
    case Side::kWorker:
      return "worker";
    case Side::kBoth:
      break;
  }
  return "both";
}

int list(bool json) {
  for (const Check& check : checks()) {
    if (json) {
      std::printf("{\"check\":\"%s\",\"side\":\"%s\",\"rule\":\"%s\",\"sentence\":\"%s\"}\n", check.name.data(),
                  name_of(check.side), anchor(check).c_str(), check.sentence.data());
    } else {
      std::printf("%-22s %-7s %s\n%31s%s\n", check.name.data(), name_of(check.side), anchor(check).c_str(), "",
                  check.sentence.data());
    }
  }
  return 0;
}

int tell(const Report& report, bool json) {
  for (const Verdict& verdict : report.verdicts()) {
    std::printf("%s\n", (json ? json_of(verdict) : text_of(verdict)).c_str());
  }
  const auto count = [&](Outcome outcome) { return report.count(outcome); };
  std::fprintf(stderr, "%zu passed, %zu failed, %zu not applicable, %zu not reached\n", count(Outcome::kPassed),
               count(Outcome::kFailed), count(Outcome::kNotApplicable), count(Outcome::kUnreached));
  return report.passed() ? 0 : 1;
}

Options options_of(const Line& line) {
  Options options{.long_checks = line.long_checks};
  if (!line.key.empty()) options.key = read_client_key(line.key).key;
  options.aes = line.suite == 2;
  if (options.aes) expect_speakable(all_suites());
  return options;
}

int judge_server(const Line& line) {
  Options options = options_of(line);
  options.follower = line.follower;
  const Address address = parse_address(line.server);
  options.loopback = is_loopback(address);
  UdpWire wire = UdpWire::to_server(address);
  Report report(Side::kServer);
  conformance::judge_server(wire, options, report);
  return tell(report, line.json);
}

int judge_client(Line line) {
  const Options options = options_of(line);
  UdpWire wire = UdpWire::for_client(parse_address(line.listen));
  const std::string address = to_string(wire.local_address());
  bool told = false;
  for (std::string& word : line.command) {
    for (auto at = word.find("{}"); at != std::string::npos; at = word.find("{}", at + address.size())) {
      word.replace(at, 2, address);
      told = true;
    }
  }
  if (!told) line.command.push_back(address);
  GuestProgram guest(line.command, line.log);
  Report report(Side::kClient);
  conformance::judge_client(wire, guest, options, report);
  return tell(report, line.json);
}

int judge_worker(const Line& line) {
  WorkerProgram worker(line.command, line.log, parse_address(line.listen));
  Report report(Side::kWorker);
  conformance::judge_worker(worker, report);
  return tell(report, line.json);
}

int run(int argc, char** argv) {
  CLI::App app(
      "Test a client or a server over UDP for conformance with WIRE.md and SESSION.md, or a worker for conformance "
      "with\nclients/cpp/worker/stream.h.",
      "tendon-conformance");
  usage::dress(app);
  app.footer(
      "Examples: tendon-conformance server 127.0.0.1:47100\n"
      "          tendon-conformance client --key wall.key -- python3 my_client.py --server {} --key wall.key\n"
      "          tendon-conformance worker -- mpirun -n 2 ./my_worker\n"
      "Exit: 0 success, all applicable checks passed; 1 a check failed or was not reached; 2 wrong usage.");
  app.set_version_flag("--version", version_text());
  Line line;
  bool list_only = false;
  app.add_flag("--list", list_only, "Print each check, with its section and sentence of the specification, and exit");
  app.add_flag("--json", line.json, "Print JSON on stdout, one object per check");
  app.require_subcommand(0, 1);
  const auto common = [&](CLI::App* command) {
    auto* const key =
        command->add_option("--key", line.key, "Key file of a controller. Default: suite 0, without encryption")
            ->type_name("FILE");
    command->add_option("--suite", line.suite, "Cipher suite of Data with a key; 2: offer and require suite 2")
        ->check(usage::one_of({"1", "2"}))
        ->needs(key)
        ->capture_default_str();
    command->add_flag("--long", line.long_checks, "Also run the check of key changes, which takes 610 s");
    command->add_flag("--json", line.json, "Print JSON on stdout, one object per check");
  };
  CLI::App* const server = app.add_subcommand("server", "Test a server, as its clients");
  server->add_option("ADDRESS", line.server, "Address of the server, which must not have another controller")
      ->required();
  server->add_flag("--follower", line.follower,
                   "Device 0 is the follower of a coupling with the parameters in README.md");
  common(server);
  CLI::App* const client = app.add_subcommand(
      "client", "Test a client, as its server. The client is started several times, and stopped with SIGTERM");
  client->add_option("--listen", line.listen, "Address for the client. Port 0: a free port")->capture_default_str();
  client->add_option("--log", line.log, "File for the output of the client")->type_name("FILE");
  client
      ->add_option("COMMAND", line.command,
                   "Command of the client; {} is replaced by the address, which otherwise is appended")
      ->required();
  common(client);
  CLI::App* const worker =
      app.add_subcommand("worker",
                         "Test a worker, as its proxy. The worker is started twice: with a Unix socket, then with "
                         "TCP.\nExample: tendon-conformance worker -- mpirun -n 2 ./my_worker");
  worker->add_option("--listen", line.listen, "TCP address for the worker. Port 0: a free port")->capture_default_str();
  worker->add_option("--log", line.log, "File for the output of the worker")->type_name("FILE");
  worker
      ->add_option("COMMAND", line.command,
                   "Command of the worker, which receives the address and the secret in its environment")
      ->required();
  worker->add_flag("--json", line.json, "Print JSON on stdout, one object per check");
  try {
    usage::parse(app, argc, argv);
  } catch (const CLI::ParseError& error) {
    return usage::exit_code(app, error);
  }
  if (list_only) return list(line.json);
  if (*server) return judge_server(line);
  if (*client) return judge_client(line);
  if (*worker) return judge_worker(line);
  std::fprintf(stderr, "%s", app.help().c_str());
  return 2;
}

}  // namespace
}  // namespace tendon::conformance

int main(int argc, char** argv) {
  try {
    return tendon::conformance::run(argc, argv);
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "tendon-conformance: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tendon-conformance: %s\n", error.what());
    return 1;
  }
}
