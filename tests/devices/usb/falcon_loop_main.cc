// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <iostream>

#include "tests/devices/usb/falcon_loop.h"

int main(int argc, char** argv) {
  CLI::App app(
      "falcon-loop: the haptic half of the server, AOL+ and all, on a model of a Falcon through the real libusb, at 1 "
      "kHz, and beside "
      "it a "
      "thread that only sleeps. Prints one JSON object.\n\nExample:  falcon-loop --duration-s 60\n");
  double duration_s = 60;
  app.add_option("--duration-s", duration_s, "How long")->check(CLI::Range(1.0, 86400.0))->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& problem) {
    return app.exit(problem) == 0 ? 0 : 2;
  }
  std::cout << tendon::run_falcon_loop(tendon::from_seconds(duration_s), tendon::Law::kAolPlus, {}).json() << '\n';
  return 0;
}
