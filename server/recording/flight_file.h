// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "server/recording/byte_sink.h"
#include "server/recording/recorder.h"
#include "server/recording/records.h"
#include "server/recording/step_flight.h"

namespace tendon {

/// Returns the path for the steps before a fault. For a recording `run.mcap`, this is `run.fault-1.mcap`. Without a
/// recording, or if it is a device or a pipe, this is `tendon.fault-1.mcap` in the working directory. With a `device`,
/// which must be empty if there is only one, this is for example `run.left.fault-1.mcap`.
std::filesystem::path flight_path(const std::optional<std::filesystem::path>& recording, const std::string& device,
                                  int number);

/// Uses the first unused number, to keep earlier files. Throws std::runtime_error on failure. Log thread only.
std::unique_ptr<FileSink> open_flight(const std::optional<std::filesystem::path>& recording, const std::string& device);

/// Writes a new recording. `flight` must be frozen. Throws std::runtime_error if the sink fails. Log thread only.
void write_flight(const StepFlight& flight, const Recorder::Config& config, const SolverPaths& ways, ByteSink& sink);

}  // namespace tendon
