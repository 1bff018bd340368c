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

/// Where the steps before a device's `number`-th fault go: `run.fault-1.mcap` beside a recording `run.mcap`, and
/// `tendon.fault-1.mcap` in the working directory where there is none, or none that has a place of its own (/dev/null,
/// a pipe). `device` is its name, `run.left.fault-1.mcap`, or empty when it is the only one.
std::filesystem::path flight_path(const std::optional<std::filesystem::path>& recording, const std::string& device,
                                  int number);

/// A new file for a fault: the first of these paths, from number 1 on, at which there is none yet. The faults of all
/// runs of a name thus stay. Throws std::runtime_error with path and reason. Log thread only.
std::unique_ptr<FileSink> open_flight(const std::optional<std::filesystem::path>& recording, const std::string& device);

/// Writes the steps that led to a fault as a recording of its own.
///
/// `flight` must be frozen, and is left so. Throws std::runtime_error with the sink's reason when not all of them could
/// be written. Log thread only.
void write_flight(const StepFlight& flight, const Recorder::Config& config, const Ways& ways, ByteSink& sink);

}  // namespace tendon
