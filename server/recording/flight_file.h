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

/// Returns the path for the steps before a fault. For a recording `run.mcap`, this is `run.fault-1.mcap`. If there is
/// no recording, or if it is a device or a pipe, this is `tendon.fault-1.mcap` in the working directory. If `device` is
/// not empty, it is included, for example `run.left.fault-1.mcap`. It must be empty if there is only one device.
std::filesystem::path flight_path(const std::optional<std::filesystem::path>& recording, const std::string& device,
                                  int number);

/// Creates the file with the first number that does not exist yet, so the files of earlier runs are kept. Throws
/// std::runtime_error if the file cannot be created. Log thread only.
std::unique_ptr<FileSink> open_flight(const std::optional<std::filesystem::path>& recording, const std::string& device);

/// Writes the steps before a fault to a new recording. `flight` must be frozen. Throws std::runtime_error if an error
/// occurs in the sink. Log thread only.
void write_flight(const StepFlight& flight, const Recorder::Config& config, const SolverPaths& ways, ByteSink& sink);

}  // namespace tendon
