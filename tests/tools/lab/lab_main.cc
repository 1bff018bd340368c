// SPDX-License-Identifier: Apache-2.0
// tendon-lab: experiments with recorded and simulated runs. Each verb is a file in verbs/.
#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <stdexcept>

#include "server/build_info.h"
#include "server/scene/scene.h"
#include "tests/tools/lab/verbs/verb.h"

int main(int argc, char** argv) {
  constexpr int kFailed = 1;
  constexpr int kWrongUsage = 2;

  CLI::App app("Experiments with Tendon.", "tendon-lab");
  app.set_version_flag("--version", tendon::version_text());
  app.require_subcommand(1);
  app.footer(
      "\nExample: every stability controller in every situation, as tables and pictures\n"
      "  tendon-lab compare --out comparison\n"
      "\ntendon-lab VERB --help tells more.\n\nExit: 0 done; 1 failed; 2 wrong usage.");
  int exit = 0;
  for (const tendon::lab::Verb& verb : tendon::lab::verbs()) verb.add(*app.add_subcommand(verb.name, verb.what), exit);

  const auto complain = [](const std::exception& error, int code) {
    std::cerr << "tendon-lab: " << error.what() << (code == kWrongUsage ? " (see --help)\n" : "\n");
    return code;
  };
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    return complain(error, kWrongUsage);
  } catch (const std::invalid_argument& error) {
    return complain(error, kWrongUsage);
  } catch (const tendon::SceneError& error) {
    return complain(error, kWrongUsage);
  } catch (const std::exception& error) {
    return complain(error, kFailed);
  }
  return exit;
}
