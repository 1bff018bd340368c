// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <string>

#include "tests/support/swept_work.h"

namespace tendon {

/// Adds `--units` and `--from` for SweptWork. `units` is for the help: "0 to 17: the rows of the table".
inline void add_part_options(CLI::App& verb, Part& part, const std::string& units) {
  part.progress = isatty(STDERR_FILENO) != 0;
  CLI::Option* const these =
      verb.add_option_function<std::string>(
              "--units", [&part](const std::string& text) { part.units = parse_units(text); },
              "Run only these units, as a shard of a sweep, and print JSON (see tendon-sweep). Units: " + units)
          ->type_name("FIRST:COUNT");
  verb.add_option_function<std::string>(
          "--from", [&part](const std::string& file) { part.from = file; },
          "Run nothing, but print the result of the shards of a sweep (see tendon-sweep merge)")
      ->type_name("FILE")
      ->excludes(these);
}

}  // namespace tendon
