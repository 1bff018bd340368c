// SPDX-License-Identifier: Apache-2.0
// tendon-lab: experiments with recorded and simulated runs. Each verb has a file in verbs/.
#include <CLI/CLI.hpp>

#include "clients/cpp/usage.h"
#include "server/build_info.h"
#include "tests/support/run_tool.h"
#include "tests/tools/lab/verbs/verb.h"

int main(int argc, char** argv) {
  CLI::App app("Run experiments with Tendon.", "tendon-lab");
  tendon::usage::dress(app);
  app.set_version_flag("--version", tendon::version_text());
  app.require_subcommand(1);
  app.footer(
      "\n"
      "Example: compare all stability controllers in all situations, with tables and figures\n"
      "  tendon-lab compare --out comparison\n\n"
      "Use tendon-lab VERB --help for more.\n\n"
      "Exit: 0 success; 1 failed; 2 wrong usage.");
  int exit = 0;
  for (const tendon::lab::Verb& verb : tendon::lab::verbs()) verb.add(*app.add_subcommand(verb.name, verb.what), exit);

  return tendon::run_tool(app, argc, argv, [&exit] { return exit; });
}
