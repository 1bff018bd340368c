// SPDX-License-Identifier: Apache-2.0
// A server records a hand that touches uploaded fields. tendon-replay --field renders them again to the last bit.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include "server/recording/recorder.h"
#include "server/recording/recording_reader.h"
#include "tests/server/clients/field_server.h"
#include "tests/server/scratch_folder.h"
#include "tests/tools/lab/recordings/field_summary.h"
#include "tests/tools/lab/recordings/report.h"
#include "tests/tools/replay/replay.h"

namespace tendon::replay::field_recording_test {
namespace {

using std::chrono::milliseconds;

const std::string kScene =
    "[device.hand.motion]\nkind = \"sine\"\namplitude_mm = 12\nfrequency_hz = 1\n[limiter]\nkind = \"aol+\"\n"
    "[field]\npush_j = 0.01\npush_w = 0.1\n";

FieldShape ball(double x) { return shape_of(sphere_at(Vec3(x, 0, 0), 0.02), Vec3(-0.01, -0.032, -0.032), 4, 2e-3); }

class FieldRecording : public FieldServer {
 protected:
  std::vector<std::filesystem::path> parts() const {
    return {folder_.path() / "run.mcap", folder_.path() / "run-2.mcap", folder_.path() / "run-3.mcap"};
  }

  /// Records about 6 s in three parts, with two shapes, other materials, poses, truths, and an engine that dies.
  void live() {
    Scene scene = scene_of(kScene);
    scene.recording = Scene::Recording{.path = parts().front()};
    scene.recording->rotate_after = 2.2;
    start({scene});
    way_ = milliseconds(20);
    loss_ = 0.02;
    jitter_ms_ = 10;
    Engine one = engine("127.0.0.1:4000");
    ASSERT_TRUE(upload(one, ball(0.028)));
    const FieldDepthTable table{.step = 1e-3, .size = 2, .force = {0.1, 1 / 3.0}};
    ASSERT_EQ(answer_to(one->use(newest(one), 1, {{.stiffness = 500}}, 0, {table}), one).code, Code::kOk);
    int turns = 0;
    const auto act = [&] {
      if (!one->state || !one->state->field || ++turns % 16 != 0) return;
      one->move({.time = PeerTime(one->state->sampled.time_since_epoch()) + milliseconds(40),
                 .position = {0.002 * std::sin(0.01 * turns), 0, 0},
                 .orientation = Quat{}});
      one->tell({-0.3, 0, 0}, one->state->field->generation);
    };
    run(milliseconds(800), {&one}, act);
    ASSERT_EQ(answer_to(one->use(newest(one), 2, {{.stiffness = 300, .friction = 0.3}}), one).code, Code::kOk);
    run(milliseconds(800), {&one}, act);
    ASSERT_TRUE(upload(one, ball(0.027)));
    ASSERT_EQ(answer_to(one->use(newest(one), 3), one).code, Code::kOk);
    run(milliseconds(1000), {&one}, act);
    run(milliseconds(2600), {});  // the session of the engine times out
    assembly_->log().close(now_, 0);
  }

  const testing::ScratchFolder folder_;
};

TEST_F(FieldRecording, IsRenderedAgainToTheLastBitOverThreeParts) {
  live();
  std::uint64_t uses = 0;
  std::uint64_t poses = 0;
  std::uint64_t truths = 0;
  std::uint64_t releases = 0;
  std::uint64_t touched = 0;
  std::vector<std::size_t> data;
  for (const auto& part : parts()) {
    RecordingReader reader(part);
    data.push_back(0);
    while (const auto record = reader.next()) {
      if (const auto* const input = std::get_if<FieldInput>(&*record)) {
        uses += input->kind == FieldInput::Kind::kUse ? 1 : 0;
        poses += input->kind == FieldInput::Kind::kPose ? 1 : 0;
        truths += input->kind == FieldInput::Kind::kTruth ? 1 : 0;
        releases += input->kind == FieldInput::Kind::kRelease ? 1 : 0;
      }
      if (std::holds_alternative<FieldData>(*record)) ++data.back();
      if (const auto* const step = std::get_if<StepRecord>(&*record)) {
        touched += step->field && step->field->depth > 0 ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(uses, 3U);
  EXPECT_GT(poses, 50U);
  EXPECT_GT(truths, 50U);
  EXPECT_GE(releases, 1U);
  EXPECT_GT(touched, 500U);
  for (const std::size_t count : data) EXPECT_GE(count, 1U) << "each part has the newest field";

  std::ostringstream out;
  const Options options{.recording = parts()[0], .more_parts = {parts()[1], parts()[2]}, .fields = true};
  EXPECT_TRUE(replay(options, out)) << out.str();
  EXPECT_NE(out.str().find(" steps are identical"), std::string::npos) << out.str();
}

lab::FieldSummary summary_of(const std::filesystem::path& part) {
  lab::FieldObserver observer;
  RecordingReader reader(part);
  while (const auto record = reader.next()) {
    if (const auto* const step = std::get_if<StepRecord>(&*record)) observer.observe(*step);
  }
  return observer.summary().value_or(lab::FieldSummary{});
}

TEST_F(FieldRecording, IsSummarizedByTheReport) {
  live();
  std::uint64_t with_field = 0;
  std::uint64_t touched = 0;
  RecordingReader reader(parts()[0]);
  while (const auto record = reader.next()) {
    const auto* const step = std::get_if<StepRecord>(&*record);
    if (step == nullptr || !step->field) continue;
    ++with_field;
    touched += step->field->depth > 0 ? 1 : 0;
  }
  const lab::FieldSummary fields = summary_of(parts()[0]);
  EXPECT_EQ(fields.steps, with_field);
  EXPECT_EQ(fields.contact_steps, touched);
  EXPECT_EQ(fields.used, 2U) << "the third use is in the second part";
  EXPECT_EQ(fields.swaps, 1U);
  EXPECT_GT(fields.swap_slew.value_or(0), 1) << "the hand touches the field within 200 ms after the swap";
  EXPECT_LT(fields.swap_slew.value_or(0), 200);
  EXPECT_GT(fields.largest_stored, 1e-4);
  EXPECT_GE(fields.least_account, 0);
  EXPECT_EQ(summary_of(parts()[1]).swaps, 1U);

  std::ostringstream table;
  lab::report({.recordings = {parts()[0]}}, table);
  EXPECT_NE(table.str().find("\nFields\n  fields used "), std::string::npos) << table.str();
}

TEST_F(FieldRecording, AnotherPoseOrBrickIsNoticed) {
  live();
  for (const bool brick : {true, false}) {
    const auto changed = folder_.path() / (brick ? "brick.mcap" : "pose.mcap");
    {
      RecordingReader reader(parts()[0]);
      FileSink sink(changed);
      std::optional<Recorder> recorder;
      bool done = false;
      while (auto record = reader.next()) {
        if (auto* const scene = std::get_if<SceneRecord>(&*record)) {
          recorder.emplace(Recorder::Config{.scene = *scene, .fields = true}, sink);
        } else if (auto* const data = std::get_if<FieldData>(&*record)) {
          if (brick) {
            for (std::size_t i = 0; i < data->weights.size(); i += 2) data->weights[i] ^= std::byte{1};
          }
          recorder->record(*data);
        } else if (auto* const input = std::get_if<FieldInput>(&*record)) {
          if (!brick && input->kind == FieldInput::Kind::kPose && !std::exchange(done, true)) {
            input->pose.pose.position.x() += 1e-6;
          }
          recorder->record(*input);
        } else if (auto* const step = std::get_if<StepRecord>(&*record)) {
          recorder->record(*step);
        }
      }
      recorder->close();
    }
    std::ostringstream out;
    EXPECT_FALSE(replay({.recording = changed, .fields = true}, out));
    EXPECT_NE(out.str().find("field."), std::string::npos) << out.str();
    std::ostringstream without;
    EXPECT_TRUE(replay({.recording = changed}, without)) << without.str();
  }
}

}  // namespace
}  // namespace tendon::replay::field_recording_test
