// SPDX-License-Identifier: Apache-2.0
#include "server/recording/part_recorder.h"

#include <algorithm>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "server/recording/part_files.h"

namespace tendon {
namespace {

constexpr std::size_t kMostChunks = 65'536;
constexpr Duration kBeforeAFault = std::chrono::seconds(60);
constexpr Duration kAfterAFault = std::chrono::seconds(10);

/// A part can exceed its limit by one chunk and its index, so some of the budget is reserved for these.
std::uint64_t part_of_budget(std::uint64_t budget) { return budget / 4 - budget / 32; }

std::string count_of(std::uint64_t steps, std::uint64_t datagrams) {
  return std::to_string(steps) + " steps and " + std::to_string(datagrams) + " datagrams";
}

}  // namespace

PartRecorder::PartRecorder(const Config& config) : config_(config) {
  if (config_.budget_bytes > 0) {
    config_.rotate_bytes = std::min(config_.rotate_bytes, part_of_budget(config_.budget_bytes));
    config_.run.scene.budget_bytes = config_.budget_bytes;
    config_.run.scene.first_part = config_.path.filename().string();
  }
  if (config_.keep == Keep::kFaults) config_.rotate_after = std::min(config_.rotate_after, kBeforeAFault);
  faulty_.resize(1 + config_.run.more_devices.size());
  closed_.path = config_.path;
  open_part(config_.run.started);
}

void PartRecorder::record(const StepRecord& step, std::size_t device, std::string_view force_way) {
  see_faults(step, device);
  if (!recorder_) {
    ++missing_.steps;
    return;
  }
  recorder_->record(step, device, force_way);
  look_after(step.hand.at);
}

/// Does not start a new part, because the step with the same tick must be in the same part.
void PartRecorder::record(const PortRecord& port, std::size_t device) {
  if (recorder_) recorder_->record(port, device);
}

void PartRecorder::record(const FieldInput& input, std::size_t device) {
  if (recorder_) recorder_->record(input, device);
}

void PartRecorder::record(const FieldData& data, std::size_t device) {
  if (recorder_) recorder_->record(data, device);
  FieldData& newest = fields_[{device, data.channel}];
  std::vector<std::byte> weights = std::move(newest.weights);
  const bool as_before = data.weights.empty() && newest.manifest == data.manifest;
  newest = data;
  if (as_before) newest.weights = std::move(weights);
}

void PartRecorder::record(const DatagramRecord& datagram) {
  if (!recorder_) {
    ++missing_.datagrams;
    return;
  }
  recorder_->record(datagram);
  look_after(datagram.at);
}

void PartRecorder::lost(const LossRecord& loss) {
  if (loss.cause == LossRecord::Cause::kByteBudget) {
    closed_.datagrams_over_budget += loss.datagrams;
  } else {
    closed_.lost_steps += loss.steps;
    closed_.lost_datagrams += loss.datagrams;
  }
  closed_.unauthenticated_left_out += loss.unauthenticated;
  if (!recorder_) return;
  told_.steps += loss.steps;
  told_.datagrams += loss.datagrams;
  recorder_->lost(loss);
  look_after(loss.at);
}

void PartRecorder::tick(LocalTime now) {
  if (!recorder_) return go_on(now);
  recorder_->tick(now);
  look_after(now);
}

void PartRecorder::close(LocalTime now) {
  if (!recorder_) return;
  recorder_->close();
  if (recorder_->failed()) return stop(now, recorder_->status().error);
  finish_part(now);
  decide(LocalTime::max());  // there can be no more faults
}

PartRecorder::Status PartRecorder::status() const {
  Status all = closed_;
  all.lost_steps += missing_.steps;
  all.lost_datagrams += missing_.datagrams;
  if (recorder_) {
    const Recorder::Status open = recorder_->status();
    all.bytes += open.bytes;
    all.steps += open.steps;
    all.datagrams += open.datagrams;
  }
  return all;
}

std::vector<PartRecorder::Notice> PartRecorder::take_notices() { return std::exchange(notices_, {}); }

bool PartRecorder::open_part(LocalTime now) {
  if (config_.budget_bytes > 0) {
    for (const auto& gone : delete_oldest_parts(config_.path, config_.budget_bytes - config_.budget_bytes / 4)) {
      notices_.push_back({false, "deleted " + gone.string() + ", the oldest recording, because of the budget of " +
                                     std::to_string(config_.budget_bytes / 1'000'000) + " MB"});
    }
  }
  sink_ = open_next_part(config_.path);
  Recorder::Config part = config_.run;
  part.scene.part = static_cast<std::uint32_t>(closed_.parts + 1);
  part.started = now;
  part_began_ = now;
  stays_ = (config_.one_in > 0 && closed_.parts % config_.one_in == 0) || (fault_ && now < *fault_ + kAfterAFault);
  told_ = {};
  recorder_.emplace(part, *sink_);
  if (recorder_->failed()) {
    stop(now, recorder_->status().error);
    return false;
  }
  for (auto& [place, data] : fields_) {
    data.at = now;
    recorder_->record(data, place[0]);
  }
  ++closed_.parts;
  closed_.path = sink_->path();
  return true;
}

void PartRecorder::look_after(LocalTime now) {
  if (recorder_->failed()) return stop(now, recorder_->status().error);
  const bool due = recorder_->bytes() + config_.run.flush_size >= config_.rotate_bytes ||
                   now - part_began_ >= config_.rotate_after || recorder_->chunks() >= kMostChunks;
  if (!due) return;
  recorder_->close();
  if (recorder_->failed()) return stop(now, recorder_->status().error);
  finish_part(now);
  try {
    if (open_part(now)) notices_.push_back({false, "recording continues in " + closed_.path.string()});
  } catch (const std::runtime_error& refused) {
    stop(now, refused.what());
  }
}

void PartRecorder::finish_part(LocalTime now) {
  const Recorder::Status part = recorder_->status();
  missing_.steps += part.lost_steps - told_.steps;
  missing_.datagrams += part.lost_datagrams - told_.datagrams;
  if (sink_->gone()) {
    missing_.steps += part.steps;
    missing_.datagrams += part.datagrams;
  } else {
    closed_.bytes += part.bytes;
    closed_.steps += part.steps;
    closed_.datagrams += part.datagrams;
  }
  recorder_.reset();
  // If even the scene could not be written, the file is removed.
  const bool empty = sink_->is_file() && sink_->size() == 0;
  std::error_code ignored;
  if (empty) std::filesystem::remove(sink_->path(), ignored);
  if (config_.keep == Keep::kFaults && sink_->is_file() && !empty && !stays_) {
    undecided_.push_back({sink_->path(), now});
  }
  sink_.reset();
  decide(now);
}

void PartRecorder::see_faults(const StepRecord& step, std::size_t device) {
  const bool faulty = step.reasons.has(Reason::kFault);
  const bool begins = faulty && !faulty_[device];
  faulty_[device] = faulty;
  if (!begins) return;
  fault_ = step.hand.at;
  stays_ = true;
  decide(step.hand.at);
  undecided_.clear();
}

/// Deletes the parts that cannot be affected by a fault after `now`.
void PartRecorder::decide(LocalTime now) {
  const auto over = [now](const Undecided& part) { return part.ended < now - kBeforeAFault; };
  for (const Undecided& part : undecided_) {
    std::error_code refused;
    if (over(part) && std::filesystem::remove(part.path, refused)) ++closed_.parts_not_kept;
  }
  std::erase_if(undecided_, over);
}

void PartRecorder::stop(LocalTime now, std::string why) {
  if (recorder_) finish_part(now);
  try_again_ = now + config_.retry_after;
  if (closed_.error.empty()) {
    notices_.push_back({true, "recording has stopped, but the device continues: " + why +
                                  "; recording continues as soon as a file can be written"});
  }
  closed_.error = std::move(why);
}

void PartRecorder::go_on(LocalTime now) {
  if (closed_.error.empty() || now < try_again_) return;
  try_again_ = now + config_.retry_after;
  if (!has_room(config_.path)) return;
  try {
    if (!open_part(now)) return;
  } catch (const std::runtime_error& refused) {
    return stop(now, refused.what());
  }
  closed_.error.clear();
  const Counts missing = std::exchange(missing_, {});
  notices_.push_back({true, "recording continues in " + closed_.path.string() + "; " +
                                count_of(missing.steps, missing.datagrams) + " are missing"});
  lost({.at = now, .steps = missing.steps, .datagrams = missing.datagrams, .cause = LossRecord::Cause::kDisk});
}

}  // namespace tendon
