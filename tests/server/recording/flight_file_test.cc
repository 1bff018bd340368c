// SPDX-License-Identifier: Apache-2.0
#include "server/recording/flight_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "tests/server/recording/recording_samples.h"
#include "tests/server/scratch_folder.h"
#include "tests/support/refusal.h"

namespace tendon::flight_file_test {
namespace {

using testing::ScratchFolder;

TEST(FlightPath, IsBesideTheRecordingAlsoWhenThatHasBeenMovedAway) {
  const ScratchFolder folder;
  const auto recording = folder.path() / "run.2.mcap";
  EXPECT_EQ(flight_path(recording, "", 1), folder.path() / "run.2.fault-1.mcap");
  std::ofstream(recording) << "steps";
  EXPECT_EQ(flight_path(recording, "", 1), folder.path() / "run.2.fault-1.mcap");
  EXPECT_EQ(flight_path(recording, "left", 12), folder.path() / "run.2.left.fault-12.mcap");
}

TEST(FlightPath, IsInTheWorkingDirectoryWithoutARecordingFile) {
  const ScratchFolder folder;
  const auto pipe = folder.path() / "pipe.mcap";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const auto link = folder.path() / "link.mcap";
  std::filesystem::create_symlink("/dev/null", link);
  EXPECT_EQ(flight_path("/dev/null", "", 1), "tendon.fault-1.mcap");
  EXPECT_EQ(flight_path(pipe, "", 2), "tendon.fault-2.mcap");
  EXPECT_EQ(flight_path(link, "", 3), "tendon.fault-3.mcap");
  EXPECT_EQ(flight_path({}, "left", 4), "tendon.left.fault-4.mcap");
}

TEST(FlightFile, OfAnEarlierRunStays) {
  const ScratchFolder folder;
  const auto recording = folder.path() / "run.mcap";
  for (int fault = 1; fault <= 3; ++fault) {
    const auto sink = open_flight(recording, "");
    EXPECT_EQ(sink->path(), flight_path(recording, "", fault));
    write_flight(StepFlight(2), testing::sample_config(), SolverPaths(), *sink);
  }
  EXPECT_EQ(open_flight(recording, "left")->path(), flight_path(recording, "left", 1));
}

TEST(FlightFile, ThatDoesNotTakeItAllIsAnErrorWithTheReason) {
  StepFlight flight(128);
  SolverPaths ways;
  ways.number_of("linear");
  for (std::uint64_t tick = 0; tick < 100; ++tick) {
    StepRecord step = testing::sample_step(tick);
    step.force_way = ways.number_of("near");
    flight.record(step);
  }
  flight.freeze();
  FileSink full("/dev/full");
  EXPECT_EQ(thrown_by<std::runtime_error>([&] { write_flight(flight, testing::sample_config(), SolverPaths(), full); }),
            "cannot write recording /dev/full: No space left on device");
  MemorySink memory;
  write_flight(flight, testing::sample_config(), ways, memory);
  RecordingReader reader(testing::stream(memory.bytes()), "a.mcap");
  const testing::Contents contents = testing::read_all(reader);
  ASSERT_EQ(contents.steps.size(), 100U);
  for (const StepRecord& step : contents.steps) EXPECT_EQ(reader.ways().name_of(step.force_way), "near");
}

}  // namespace
}  // namespace tendon::flight_file_test
