// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <exception>
#include <filesystem>
#include <iostream>
#include <new>
#include <stdexcept>

#include "clients/cpp/usage.h"
#include "server/scene/scene.h"

namespace tendon {

/// Calls `body`, which returns the exit code. Errors are one line on stderr with the name of the tool. Exit codes: 0
/// success; 1 failure, for example a file that cannot be read; 2 for wrong usage, including invalid values and scenes.
template <class Body>
int run_tool(CLI::App& app, int argc, char** argv, const Body& body) {
  constexpr int kFailed = 1;
  constexpr int kWrongUsage = 2;
  const auto complain = [&app](const std::exception& error, int code) {
    std::cerr << app.get_name() << ": " << error.what() << (code == kWrongUsage ? " (see --help)\n" : "\n");
    return code;
  };
  try {
    usage::parse(app, argc, argv);
    return body();
  } catch (const CLI::ParseError& error) {
    return usage::exit_code(app, error);
  } catch (const std::invalid_argument& error) {
    return complain(error, kWrongUsage);
  } catch (const SceneFileError& error) {
    return complain(error, kFailed);
  } catch (const SceneError& error) {
    return complain(error, kWrongUsage);
  } catch (const std::filesystem::filesystem_error& error) {
    return complain(std::runtime_error("cannot use " + error.path1().string() + ": " + error.code().message()),
                    kFailed);
  } catch (const std::bad_alloc&) {
    return complain(std::runtime_error("out of memory; check the limit in `ulimit -v`"), kFailed);
  } catch (const std::exception& error) {
    return complain(error, kFailed);
  }
}

}  // namespace tendon
