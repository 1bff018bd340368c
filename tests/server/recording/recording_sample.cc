// SPDX-License-Identifier: Apache-2.0
// recording_sample FOLDER: records two seconds for third-party readers. FOLDER/whole.mcap is complete, and
// FOLDER/killed.mcap was killed during a write.

#include <exception>
#include <filesystem>
#include <iostream>
#include <span>

#include "server/recording/byte_sink.h"
#include "server/recording/recorder.h"
#include "tests/server/recording/recording_samples.h"

int main(int argc, char** argv) {
  using namespace tendon;
  if (argc != 2) {
    std::cerr << "usage: recording_sample FOLDER\n";
    return 2;
  }
  try {
    const std::filesystem::path folder = argv[1];
    std::filesystem::create_directories(folder);
    Recorder::Config config = tendon::testing::sample_config();
    config.scene.unix_offset = std::chrono::seconds(1'700'000'000);
    MemorySink sink;
    Recorder recorder(config, sink);
    tendon::testing::record_samples(recorder, 2000);
    recorder.lost({.at = tendon::testing::ms(2000), .steps = 3, .datagrams = 1});
    recorder.close();

    const std::span<const std::byte> bytes = sink.bytes();
    for (const char* name : {"whole.mcap", "killed.mcap"}) std::filesystem::remove(folder / name);
    FileSink whole(folder / "whole.mcap");
    FileSink killed(folder / "killed.mcap");
    if (!whole.append(bytes) || !killed.append(bytes.first(bytes.size() / 2))) {
      std::cerr << whole.error() << killed.error() << '\n';
      return 1;
    }
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
