// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <iostream>
#include <string>

#include "tests/tools/bench/bench.h"
#include "tests/tools/lab/verbs/verb.h"

namespace tendon::lab::bench_verb {
namespace {

void add(CLI::App& verb, int& /*exit*/) {
  static bench::BenchOptions options;
  static std::uint32_t reply_delay_us = 0;
  const std::string names = names_of(bench::sections());
  verb.add_option("--only", options.only, names + "; can be repeated")->type_name("NAME")->allow_extra_args(false);
  verb.add_option("--fifo", options.priority,
                  "Real-time priority of the measured code, for a busy machine; it uses both cores exclusively")
      ->type_name("PRIORITY")
      ->check(CLI::Range(1, 60));
  verb.add_option("--seed", options.seed, "Seed of worlds, keys and networks")->capture_default_str();
  verb.add_option("--write", options.write, "Also write the table as a Markdown file")->type_name("FILE.md");
  verb.add_option("--csv", options.csv, "Also write the table as CSV")->type_name("FILE.csv");
  verb.add_option("--reply-delay-us", reply_delay_us,
                  "Delay each reply of the section peers, as a check: each of its rows must show the delay")
      ->type_name("US");
  verb.add_option("--plot", options.plot,
                  "Draw the cost of devices (section 512), as STEM.svg and STEM.png (requires gnuplot)")
      ->type_name("STEM");
  verb.add_flag("--quick", options.quick, "Run only for seconds, as a test; the figures are meaningless");
  verb.add_flag("--json", options.json,
                "Print JSON on stdout, one object per line of the table, and one for the machine");
  verb.footer(
      "\nExample: all of it, some minutes, with its page\n"
      "  tendon-lab bench --fifo 50 --write bench.md\n"
      "one part\n  tendon-lab bench --only steps --json\n"
      "cost against devices\n  tendon-lab bench --only 512 --fifo 50 --plot devices\n"
      "\nTimes are those of this machine, now. Exit: 0 measured, whatever the figures; 1 it could not be; 2 wrong "
      "usage.");
  verb.callback([&verb] {
    options.command = command_of(verb);
    options.reply_delay = std::chrono::microseconds(reply_delay_us);
    options.progress = isatty(STDERR_FILENO) != 0;
    std::signal(SIGPIPE, SIG_IGN);  // returns an error instead of a signal, so that child processes can be stopped
    bench::bench(options, std::cout);
  });
}

const Verb kVerb("bench", "Measure times and memory, each compared with the minimum of this machine", add);

}  // namespace
}  // namespace tendon::lab::bench_verb
