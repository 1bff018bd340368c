// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/options.h"

#include <CLI/CLI.hpp>
#include <charconv>
#include <iostream>
#include <limits>
#include <sstream>
#include <utility>

#include "clients/cpp/discovery/list.h"
#include "clients/cpp/key_file.h"
#include "clients/cpp/usage.h"

namespace tendon {
namespace {

constexpr double kMaxDurationS = 1e9;  // 31 years; Duration overflows after 292

std::optional<double> to_number(const std::string& text) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc{} || stop != end) return {};
  return value;
}

/// Accepts 0 and the numbers in [least, most]. CLI::Range would accept NaN.
CLI::Validator number(double least, double most) {
  return CLI::Validator(
      [=](const std::string& text) -> std::string {
        const std::optional<double> value = to_number(text);
        if (value && (*value == 0 || (*value >= least && *value <= most))) return {};
        std::ostringstream expected;
        expected << "expected " << (least > 0 ? "0, or " : "") << least << " to " << most << ", got \"" << text << '"';
        return expected.str();
      },
      "");
}

CLI::Validator at_least(double least) {
  return CLI::Validator(
      [=](const std::string& text) -> std::string {
        const std::optional<double> value = to_number(text);
        if (value && *value >= least && *value <= std::numeric_limits<double>::max()) return {};
        std::ostringstream expected;
        expected << "expected a number of " << least << " or more, got \"" << text << '"';
        return expected.str();
      },
      "");
}

}  // namespace

struct CommandLine::Parser {
  CLI::App app;
  Options& options;

  void set_example(const std::string& argument) {
    app.footer("Example: " + options.client.name + argument + " --server " + options.server.text() +
               " --duration-s 10\nExit: 0 success; 1 failed or never connected; 2 wrong usage.");
  }
};

CommandLine::CommandLine(std::string purpose, Options& options)
    : parser_(new Parser{CLI::App(std::move(purpose), options.client.name), options}) {
  CLI::App& app = parser_->app;
  usage::dress(app);
  parser_->set_example("");
  app.set_help_flag("-h,--help", "Print this help and exit");
  app.set_version_flag("--version", TENDON_VERSION);
  app.add_option_function<std::string>(
         "--server", [&](const std::string& text) { options.server = text; },
         "Address of tendond: a host name or an IP address; unix:PATH on this machine; or dns-sd:NAME. Use dns-sd: to "
         "list all names")
      ->type_name("HOST:PORT")
      ->default_str(options.server.text())
      ->check(usage::accepted_by([](const std::string& text) { ServerName{text}; }));
  app.add_option_function<std::string>(
         "--key", [&](const std::string& file) { options.client.key = read_client_key(file).key; },
         "Key file from `tendond keygen`. Not required for a server on this machine without keys")
      ->type_name("FILE");
  app.add_option("--device", options.client.device, "Name of the device, for a server with several devices")
      ->type_name("NAME");
  app.add_option("--channel", options.client.channel, "Name of the channel of the device")->type_name("NAME");
  app.add_flag("--take-lease", options.client.take_lease, "Request the channel until this client holds it");
  app.add_option("--rate-hz", options.client.rate_hz, "Rate of the answers, Hz. 0: answer every state")
      ->capture_default_str()
      ->check(number(ForceClient::kMinRateHz, ForceClient::kMaxRateHz));
  app.add_option_function<double>(
         "--duration-s", [&](double s) { options.duration = from_seconds(s); },
         "Stop after this time, s. 0: run until Ctrl-C")
      ->default_str("0")
      ->check(number(0, kMaxDurationS));
  app.add_flag(
      "--busy", options.busy,
      "Poll instead of sleeping. Answers are sent about 10 to 50 µs earlier, but a whole processor is always used");
  app.add_option_function<std::string>(
         "--dscp", [&](const std::string&) { options.dscp = Dscp::kExpedited; },
         "Mark all datagrams with EF (46), for routers and switches that are configured to forward them first")
      ->type_name("ef")
      ->check(CLI::IsMember({"ef"}));
  app.add_flag("--json", options.json, "Print JSON on stdout, one object per line");
}

CommandLine::~CommandLine() = default;

void CommandLine::add_argument(const std::string& name, std::string& value, const std::string& meaning) {
  parser_->app.add_option(name, value, meaning)->required();
  parser_->set_example(" " + name);
}

void CommandLine::add_argument(const std::string& name, std::string& value, const std::vector<std::string>& choices,
                               const std::string& meaning) {
  parser_->app.add_option(name, value, meaning)->required()->check(usage::one_of(choices));
  parser_->set_example(" " + choices.at(0));
}

void CommandLine::add(const std::string& name, double& value, const std::string& meaning, double least) {
  parser_->app.add_option(name, value, meaning)->capture_default_str()->check(at_least(least));
}

void CommandLine::add(const std::string& name, std::string& value, const std::string& type,
                      const std::string& meaning) {
  parser_->app.add_option(name, value, meaning)->capture_default_str()->type_name(type);
}

void CommandLine::add(const std::string& name, bool& value, const std::string& meaning) {
  parser_->app.add_flag(name, value, meaning);
}

std::optional<int> CommandLine::parse(int argc, const char* const* argv) {
  try {
    usage::parse(parser_->app, argc, argv);
    return list_servers(parser_->options.server, parser_->options.json);
  } catch (const CLI::ParseError& error) {
    return usage::exit_code(parser_->app, error);
  } catch (const std::runtime_error& error) {  // unreadable key file
    std::cerr << parser_->app.get_name() << ": " << error.what() << '\n';
    return 1;
  }
}

}  // namespace tendon
