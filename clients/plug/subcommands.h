// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "clients/plug/desk.h"

namespace CLI {
class App;
}

namespace tendon::plug {

/// What the chosen subcommand does once the whole command line has been read; returns the exit code. An exception is
/// said on stderr and ends the program with 1.
using Chosen = std::function<int()>;

/// The options that every bridge has: --server, --key, --device, --channel, --take-lease, --observe, --json. The
/// server knows it as "tendon-plug" with the subcommand's name.
void add_common(CLI::App& app, DeskConfig& desk);

// Each bridge adds its subcommand, in FOLDER/…_main.cc, and sets `chosen` when it is the one.
void add_chai3d(CLI::App& app, Chosen& chosen);
void add_inverse(CLI::App& app, Chosen& chosen);
void add_ros2(CLI::App& app, Chosen& chosen);
void add_vrpn(CLI::App& app, Chosen& chosen);

}  // namespace tendon::plug
