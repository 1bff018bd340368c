// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <stdexcept>

#include "server/scene/scene.h"

namespace tendon {

/// How each tool ends: 0 done; 1 something failed; 2 wrong usage.
///
/// Parses the command line and calls `body`, which returns the exit code. A complaint is one line on stderr that begins
/// with the tool's name. A value or a scene that cannot be is wrong usage.
template <class Body>
int run_tool(CLI::App& app, int argc, char** argv, const Body& body) {
  constexpr int kFailed = 1;
  constexpr int kWrongUsage = 2;
  const auto complain = [&app](const std::exception& error, int code) {
    std::cerr << app.get_name() << ": " << error.what() << (code == kWrongUsage ? " (see --help)\n" : "\n");
    return code;
  };
  try {
    app.parse(argc, argv);
    return body();
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    return complain(error, kWrongUsage);
  } catch (const std::invalid_argument& error) {
    return complain(error, kWrongUsage);
  } catch (const SceneError& error) {
    return complain(error, kWrongUsage);
  } catch (const std::exception& error) {
    return complain(error, kFailed);
  }
}

}  // namespace tendon
