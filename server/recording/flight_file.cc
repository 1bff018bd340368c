// SPDX-License-Identifier: Apache-2.0
#include "server/recording/flight_file.h"

#include <stdexcept>
#include <system_error>

namespace tendon {

std::filesystem::path flight_path(const std::optional<std::filesystem::path>& recording, const std::string& device,
                                  int number) {
  std::filesystem::path path = "tendon.mcap";
  if (recording) {
    // If the file is not found, it was a regular file that has been moved.
    std::error_code unknown;
    const auto kind = std::filesystem::status(*recording, unknown).type();
    if (kind == std::filesystem::file_type::regular || kind == std::filesystem::file_type::not_found) path = *recording;
  }
  path.replace_extension((device.empty() ? "" : "." + device) + ".fault-" + std::to_string(number) + ".mcap");
  return path;
}

std::unique_ptr<FileSink> open_flight(const std::optional<std::filesystem::path>& recording,
                                      const std::string& device) {
  for (int number = 1;; ++number) {
    if (auto sink = FileSink::open_new(flight_path(recording, device, number))) return sink;
  }
}

void write_flight(const StepFlight& flight, const Recorder::Config& config, const SolverPaths& ways, ByteSink& sink) {
  Recorder recorder(config, sink);
  for (std::size_t i = 0; i < flight.size(); ++i) {
    const StepRecord& step = flight[i];
    recorder.record(step, 0, ways.name_of(step.force_way));
  }
  recorder.close();
  if (const std::string error = recorder.status().error; !error.empty()) throw std::runtime_error(error);
}

}  // namespace tendon
