// SPDX-License-Identifier: Apache-2.0
#include "server/recording/part_recorder.h"

#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/recording/flight_file.h"
#include "tests/server/recording/recording_samples.h"
#include "tests/server/scratch_folder.h"
#include "tests/support/full_disk.h"
#include "tests/support/refusal.h"

namespace tendon::part_recorder_test {
namespace {

namespace fs = std::filesystem;
using testing::Contents;
using testing::ms;
using testing::sample_datagram;
using testing::sample_step;

PartRecorder::Config config_at(const fs::path& path) {
  PartRecorder::Config config;
  config.path = path;
  config.run = testing::sample_config();
  return config;
}

Contents read_file(const fs::path& path) {
  RecordingReader reader(path);
  return testing::read_all(reader);
}

/// Records `steps` steps, starting at tick `first`. There is one tick of the log thread per step.
void record_run(PartRecorder& recorder, std::uint64_t first, std::uint64_t steps) {
  for (std::uint64_t tick = first; tick < first + steps; ++tick) {
    recorder.record(sample_step(tick));
    recorder.tick(ms(static_cast<std::int64_t>(tick)));
  }
}

std::string whole_run(const fs::path& path, std::uint64_t steps = 10) {
  PartRecorder recorder(config_at(path));
  record_run(recorder, 0, steps);
  recorder.close(ms(static_cast<std::int64_t>(steps)));
  return recorder.status().path.filename();
}

std::set<std::string> names_in(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename());
  return names;
}

class PartRecorderTest : public ::testing::Test {
 protected:
  const testing::ScratchFolder folder;
  const std::filesystem::path path = folder.path() / "run.mcap";
};

TEST_F(PartRecorderTest, ANameThatExistsIsNumberedOn) {
  EXPECT_EQ(whole_run(path, 11), "run.mcap");
  EXPECT_EQ(whole_run(path, 12), "run-2.mcap");
  EXPECT_EQ(whole_run(path, 13), "run-3.mcap");
  EXPECT_EQ(read_file(path).steps.size(), 11U);
  EXPECT_EQ(read_file(folder.path() / "run-2.mcap").steps.size(), 12U);
  fs::remove(folder.path() / "run-2.mcap");
  EXPECT_EQ(whole_run(path), "run-4.mcap") << "the order of the numbers is that of the runs";
  std::ofstream(folder.path() / "run-9.mcap") << "anything at all";
  EXPECT_EQ(whole_run(path), "run-10.mcap");
  std::ofstream(folder.path() / "run-99.fault-1.mcap") << "no part";
  std::ofstream(folder.path() / "run-011.mcap") << "no part";
  EXPECT_EQ(whole_run(path), "run-11.mcap");
}

TEST_F(PartRecorderTest, AFileThatIsNoRecordingIsRefusedAndLeftAsItIs) {
  const auto toml = folder.path() / "scene.toml";
  std::ofstream(toml) << "[device]\nkind = \"simulated\"\n";
  const auto size = fs::file_size(toml);
  EXPECT_EQ(thrown_by<std::runtime_error>([&] { PartRecorder recorder(config_at(toml)); }),
            "cannot write recording " + toml.string() + ": the file exists and is not a recording; it was not changed");
  EXPECT_EQ(fs::file_size(toml), size);
  EXPECT_EQ(names_in(folder.path()).size(), 1U);
}

TEST_F(PartRecorderTest, ARecordingThatAnotherServerWritesIsNumberedOn) {
  PartRecorder first(config_at(path));
  PartRecorder second(config_at(path));
  EXPECT_EQ(second.status().path.filename(), "run-2.mcap");
}

TEST_F(PartRecorderTest, EachPartIsAWholeRecordingAndNoStepIsMissing) {
  PartRecorder::Config config = config_at(path);
  config.run.more_devices = {{"left", config.run.scene}};
  config.rotate_after = std::chrono::seconds(1);
  PartRecorder recorder(config);
  record_run(recorder, 0, 3500);
  recorder.close(ms(3500));
  EXPECT_EQ(recorder.status().parts, 4U);
  EXPECT_EQ(recorder.status().steps, 3500U);
  EXPECT_TRUE(recorder.status().complete());
  std::uint64_t tick = 0;
  std::uint32_t part = 0;
  for (const char* name : {"run.mcap", "run-2.mcap", "run-3.mcap", "run-4.mcap"}) {
    const Contents contents = read_file(folder.path() / name);
    EXPECT_EQ(contents.error, "");
    EXPECT_FALSE(contents.truncated) << name;
    ASSERT_EQ(contents.scenes.size(), 1U) << name << ": of the first device";
    EXPECT_EQ(contents.scenes[0].text, config.run.scene.text);
    EXPECT_EQ(contents.scenes[0].commit, config.run.scene.commit);
    EXPECT_EQ(contents.scenes[0].part, ++part);
    for (const StepRecord& step : contents.steps) ASSERT_EQ(step.tick, tick++);
  }
  EXPECT_EQ(tick, 3500U);
}

TEST_F(PartRecorderTest, CountsTheStepsOfADeletedFileAsMissingAndGoesOn) {
  const auto inner = folder.path() / "runs" / "run.mcap";
  fs::create_directory(inner.parent_path());
  PartRecorder recorder(config_at(inner));
  record_run(recorder, 0, 1000);
  fs::remove_all(inner.parent_path());
  record_run(recorder, 1000, 1000);
  const auto missing = recorder.status();
  EXPECT_EQ(missing.steps, 0U);
  EXPECT_EQ(missing.lost_steps, 2000U);
  EXPECT_FALSE(missing.complete());
  const auto notices = recorder.take_notices();
  ASSERT_EQ(notices.size(), 1U) << "not one each second";
  EXPECT_TRUE(notices[0].warning);
  EXPECT_NE(notices[0].text.find(inner.string() + ": it was deleted in the meantime"), std::string::npos)
      << notices[0].text;

  fs::create_directory(inner.parent_path());
  record_run(recorder, 2000, 2000);
  recorder.close(ms(4000));
  const auto status = recorder.status();
  EXPECT_EQ(status.steps + status.lost_steps, 4000U);
  EXPECT_GE(status.steps, 900U);
  EXPECT_FALSE(status.complete());
  EXPECT_EQ(status.error, "");
  const Contents again = read_file(inner);
  EXPECT_EQ(again.steps.size(), status.steps);
  ASSERT_EQ(again.losses.size(), 1U);
  EXPECT_EQ(again.losses[0].steps, status.lost_steps);
}

TEST_F(PartRecorderTest, AFileThatIsDeletedAsItClosesIsMissing) {
  PartRecorder recorder(config_at(path));
  record_run(recorder, 0, 100);
  fs::remove(path);
  recorder.close(ms(100));
  EXPECT_EQ(recorder.status().lost_steps, 100U);
  EXPECT_FALSE(recorder.status().complete());
}

/// There are ten steps per second, with a fault from `first_fault` to `last_fault` (s).
void record_seconds(PartRecorder& recorder, int from, int until, int first_fault = -1, int last_fault = -1) {
  for (int tick = 10 * from; tick < 10 * until; ++tick) {
    StepRecord step = sample_step(static_cast<std::uint64_t>(100 * tick));
    if (tick >= 10 * first_fault && tick < 10 * last_fault) step.reasons |= Reason::kFault;
    recorder.record(step);
    recorder.tick(ms(100 * tick));
  }
}

PartRecorder::Config config_of_faults(const fs::path& path) {
  PartRecorder::Config config = config_at(path);
  config.keep = Keep::kFaults;
  return config;
}

TEST_F(PartRecorderTest, OfFaultsKeepsTheMinuteOfEachAndTheOneBefore) {
  PartRecorder recorder(config_of_faults(path));
  record_seconds(recorder, 0, 900, 330, 700);
  recorder.close(ms(900'000));
  EXPECT_EQ(names_in(folder.path()), (std::set<std::string>{"run-5.mcap", "run-6.mcap"}))
      << "a fault that stays has begun once";
  const Contents before = read_file(folder.path() / "run-5.mcap");
  EXPECT_LE(before.steps.front().tick, 330'000U - 60'000U);
  const Contents with = read_file(folder.path() / "run-6.mcap");
  EXPECT_EQ(with.steps.front().tick - before.steps.back().tick, 100U) << "nothing is missing between them";
  EXPECT_FALSE(with.steps.front().reasons.has(Reason::kFault));
  EXPECT_TRUE(with.steps.back().reasons.has(Reason::kFault));
  EXPECT_EQ(recorder.status().parts, 15U);
  EXPECT_EQ(recorder.status().parts_not_kept, 13U);
  EXPECT_TRUE(recorder.status().complete()) << "what is not kept is not missing";
}

TEST_F(PartRecorderTest, OfFaultsKeepsEnoughBeforeOneThatComesFirstInAPart) {
  PartRecorder::Config config = config_of_faults(path);
  config.rotate_after = std::chrono::seconds(20);
  PartRecorder recorder(config);
  record_seconds(recorder, 0, 400, 200, 201);
  recorder.close(ms(400'000));
  const auto names = names_in(folder.path());
  EXPECT_EQ(names, (std::set<std::string>{"run-7.mcap", "run-8.mcap", "run-9.mcap", "run-10.mcap", "run-11.mcap"}))
      << "the fault is the last step of run-10, and what came of it is in run-11";
  EXPECT_LE(read_file(folder.path() / "run-7.mcap").steps.front().tick, 140'000U);
}

TEST_F(PartRecorderTest, OfFaultsOneInSoManyStaysWithoutAFault) {
  PartRecorder::Config config = config_of_faults(path);
  config.one_in = 4;
  PartRecorder recorder(config);
  record_seconds(recorder, 0, 600);
  recorder.close(ms(600'000));
  EXPECT_EQ(names_in(folder.path()), (std::set<std::string>{"run.mcap", "run-5.mcap", "run-9.mcap"}));
}

TEST_F(PartRecorderTest, OfFaultsAKilledRunLeavesItsLastMinutes) {
  {
    PartRecorder recorder(config_of_faults(path));
    record_seconds(recorder, 0, 290);
  }
  EXPECT_TRUE(fs::exists(folder.path() / "run-5.mcap"));
  EXPECT_TRUE(fs::exists(folder.path() / "run-4.mcap"));
  EXPECT_FALSE(fs::exists(folder.path() / "run-2.mcap"));
  PartRecorder next(config_of_faults(path));
  EXPECT_EQ(next.status().path.filename(), "run-6.mcap") << "the order of the numbers is that of the runs";
}

TEST_F(PartRecorderTest, APartIsNoLargerThanItMayBe) {
  PartRecorder::Config config = config_at(path);
  config.rotate_bytes = 1'000'000;
  PartRecorder recorder(config);
  record_run(recorder, 0, 8000);
  recorder.close(ms(8000));
  EXPECT_GE(recorder.status().parts, 3U);
  for (const auto& entry : fs::directory_iterator(folder.path())) EXPECT_LE(entry.file_size(), 1'000'000U);
}

TEST_F(PartRecorderTest, ABudgetDeletesItsOwnOldestPartsAndNothingElse) {
  EXPECT_EQ(whole_run(path, 3000), "run.mcap") << "without a budget: it is kept";
  {
    const auto fault = open_flight(path, "");
    StepFlight flight(8);
    for (std::uint64_t tick = 0; tick < 5; ++tick) flight.record(sample_step(tick));
    write_flight(flight, config_at(path).run, SolverPaths(), *fault);
  }
  std::ofstream(folder.path() / "run-notes.mcap") << "somebody's";
  const auto other = folder.path() / "run-7.mcap";  // not a part of run.mcap
  {
    PartRecorder::Config config = config_at(other);
    config.budget_bytes = 100'000'000;
    PartRecorder recorder(config);
    record_run(recorder, 0, 500);
    recorder.close(ms(500));
  }
  PartRecorder::Config config = config_at(path);
  config.budget_bytes = 4'000'000;
  for (int run = 0; run < 2; ++run) {
    PartRecorder recorder(config);
    for (std::uint64_t tick = 0; tick < 20'000; ++tick) {
      recorder.record(sample_step(tick));
      if (tick % 250 != 0) continue;
      recorder.tick(ms(static_cast<std::int64_t>(tick)));
      std::uint64_t bytes = 0;
      for (const auto& entry : fs::directory_iterator(folder.path())) {
        const std::string name = entry.path().filename().string();
        if (name.starts_with("run-") && name != "run-7.mcap") bytes += entry.file_size();
      }
      ASSERT_LE(bytes, config.budget_bytes);
    }
    recorder.close(ms(20'000));
    EXPECT_TRUE(recorder.status().complete()) << "what the budget deletes is not missing";
    const auto notices = recorder.take_notices();
    EXPECT_TRUE(std::ranges::any_of(notices, [](const auto& notice) {
      return notice.text.find("deleted ") != std::string::npos &&
             notice.text.find("budget of 4 MB") != std::string::npos;
    }));
  }
  EXPECT_EQ(read_file(path).steps.size(), 3000U);
  EXPECT_EQ(read_file(folder.path() / "run.fault-1.mcap").steps.size(), 5U);
  EXPECT_TRUE(fs::exists(folder.path() / "run-notes.mcap"));
  EXPECT_EQ(read_file(other).steps.size(), 500U);
  EXPECT_FALSE(fs::exists(folder.path() / "run-2.mcap"));
}

TEST_F(PartRecorderTest, GoesOnWhenThereIsRoomAgainAndSaysWhatIsMissing) {
  PartRecorder recorder(config_at(path));
  record_run(recorder, 0, 1000);
  {
    const testing::FullDisk disk(1);
    record_run(recorder, 1000, 5000);
    recorder.record(sample_datagram(ms(6000), 100, true));
    EXPECT_NE(recorder.status().error.find("File too large"), std::string::npos);
    EXPECT_EQ(names_in(folder.path()), (std::set<std::string>{"run.mcap"})) << "no empty files";
  }
  record_run(recorder, 6000, 2000);
  recorder.close(ms(8000));

  const PartRecorder::Status status = recorder.status();
  EXPECT_EQ(status.error, "");
  EXPECT_FALSE(status.complete());
  const Contents first = read_file(path);
  const Contents second = read_file(folder.path() / "run-2.mcap");
  EXPECT_TRUE(first.truncated);
  EXPECT_FALSE(second.truncated);
  EXPECT_EQ(first.steps.size() + second.steps.size(), status.steps);
  EXPECT_EQ(status.steps + status.lost_steps, 8000U);
  ASSERT_FALSE(second.steps.empty());
  EXPECT_LE(second.steps.front().tick, 7001U) << "within a second";
  ASSERT_EQ(second.losses.size(), 1U);
  EXPECT_EQ(second.losses[0].cause, LossRecord::Cause::kDisk);
  EXPECT_EQ(second.losses[0].steps, second.steps.front().tick - first.steps.back().tick - 1);
  EXPECT_EQ(second.losses[0].steps, status.lost_steps);
  EXPECT_EQ(second.losses[0].datagrams, 1U);

  std::string said;
  for (const auto& notice : recorder.take_notices()) said += notice.text + "\n";
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 2) << said;
  EXPECT_NE(said.find("recording has stopped, but the device continues: cannot write recording "), std::string::npos)
      << said;
  EXPECT_NE(said.find("recording continues in " + (folder.path() / "run-2.mcap").string() + "; " +
                      std::to_string(status.lost_steps) + " steps and 1 datagrams are missing"),
            std::string::npos)
      << said;
}

TEST_F(PartRecorderTest, OnADeviceWithoutSpaceCountsEverythingAndSaysSoOnce) {
  PartRecorder recorder(config_at("/dev/full"));
  record_run(recorder, 0, 5000);
  recorder.close(ms(5000));
  EXPECT_EQ(recorder.status().error, "cannot write recording /dev/full: No space left on device");
  EXPECT_EQ(recorder.status().lost_steps, 5000U);
  EXPECT_FALSE(recorder.status().complete());
  EXPECT_EQ(recorder.take_notices().size(), 1U);
}

TEST_F(PartRecorderTest, HoldsNoMoreMemoryAfterADayThanAfterTwoHours) {
  PartRecorder::Config config = config_at("/dev/null");
  config.rotate_after = std::chrono::hours(1);
  PartRecorder recorder(config);
  const auto held = [] {
    const auto heap = ::mallinfo2();
    return static_cast<double>(heap.uordblks + heap.hblkhd);
  };
  double after_two_hours = 0;
  for (std::int64_t quarter = 0; quarter < std::int64_t{4} * 86'400; ++quarter) {  // one flush each
    StepRecord step = sample_step(1);
    step.hand.at = ms(250 * quarter);
    recorder.record(step);
    recorder.tick(ms(250 * quarter + 249));
    if (quarter == std::int64_t{8} * 3600 - 10) after_two_hours = held();
  }
  EXPECT_GE(recorder.status().parts, 23U);
  // This is at the end of an hour. There are about 150 bytes in the index for each chunk.
  EXPECT_NEAR(held(), after_two_hours, 100e3);
}

}  // namespace
}  // namespace tendon::part_recorder_test
