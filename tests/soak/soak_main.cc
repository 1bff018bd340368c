// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <iomanip>
#include <iostream>

#include "clients/cpp/usage.h"
#include "server/build_info.h"
#include "tests/soak/soak.h"

int main(int argc, char** argv) {
  CLI::App app(
      "Run a server in real time under stress: killed engines, guests that connect and disconnect, clock steps, a full "
      "disk\n"
      "and busy processors. Check that memory, files and threads do not grow, and that the guarantees hold. See\n"
      "tests/soak/README.md.\n\n"
      "Example:  tendon-soak --duration-s 60 --reconnects 10000 --folder /tmp/soak\n",
      "tendon-soak");
  tendon::usage::dress(app);
  app.set_version_flag("--version", tendon::version_text());
  tendon::soak::Config config{.folder = "soak"};
  double duration_s = 3600;
  bool json = false;
  app.add_option("--duration-s", duration_s, "Duration, s")->check(CLI::Range(1.0, 1e6))->capture_default_str();
  app.add_option("--reconnects", config.reconnects, "Number of guest sessions that end after one state")
      ->capture_default_str();
  app.add_option("--seed", config.seed, "Seed of the times of events")->capture_default_str();
  app.add_option("--folder", config.folder, "Folder for logs and scene; empty or new")->capture_default_str();
  app.add_flag("--json", json, "Print one JSON object on stdout");
  app.footer("\nExit: 0 success; 1 failed, or a violation; 2 wrong usage.");
  try {
    tendon::usage::parse(app, argc, argv);
  } catch (const CLI::ParseError& problem) {
    return tendon::usage::exit_code(app, problem);
  }
  try {
    config.duration = tendon::from_seconds(duration_s);
    config.folder = std::filesystem::absolute(config.folder);
    const bool terminal = isatty(STDERR_FILENO) == 1;
    const auto report = run(config, [terminal](double share) {
      if (terminal) std::cerr << "\r" << std::fixed << std::setprecision(1) << share * 100 << " % " << std::flush;
    });
    if (terminal) std::cerr << '\r';
    std::cout << (json ? to_json(config, report) + '\n' : to_text(report)) << std::flush;
    return report.broken.empty() ? 0 : 1;
  } catch (const std::exception& problem) {
    std::cerr << problem.what() << '\n';
    return 1;
  }
}
