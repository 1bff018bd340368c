// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"
#include "server/recording/byte_sink.h"
#include "server/recording/keep.h"
#include "server/recording/recorder.h"

namespace tendon {

/// Records a run in one or more complete recordings (part_files.h). A new part is started in these cases:
/// * The current part has reached `rotate_bytes` or `rotate_after`.
/// * The index has 65 536 chunks, which require about 10 MB. This limits the memory for long runs.
/// * The previous part could not be written because the disk was full or the file was deleted. The new part is started
///   as soon as possible. It begins with a Lost record.
///
/// If there is a budget, the oldest parts are deleted before a new one is started.
///
/// With Keep::kFaults, the duration of a part is at most one minute. If a fault starts in a part, within 60 s after its
/// end, or within 10 s before its start, the part is kept. Other parts are deleted as soon as possible, except for
/// those that are kept because of their number (Config::one_in). If the process is killed, undecided parts are kept.
///
/// A part begins with the newest field of each channel, so that it can be replayed if previous parts were deleted.
///
/// The records must be passed in the same order as to Recorder.
/// Thread-safe: no, only used by the log thread. Realtime-safe: no.
class PartRecorder {
 public:
  struct Config {
    std::filesystem::path path;
    Recorder::Config run;
    std::uint64_t rotate_bytes = 4'000'000'000;
    Duration rotate_after = std::chrono::hours(4);
    /// Maximum total size of all parts, also of previous runs; 0: unlimited. A part can use a quarter of it.
    std::uint64_t budget_bytes = 0;
    Keep keep = Keep::kAll;
    /// With Keep::kFaults, the parts 1, 1 + one_in, 1 + 2 one_in, and so on, are also kept; 0: none.
    std::uint64_t one_in = 0;
    Duration retry_after = std::chrono::seconds(1);  ///< for checking the free space while recording is stopped
  };
  struct Status {
    std::filesystem::path path;
    std::uint64_t parts = 0;
    std::uint64_t parts_not_kept = 0;  ///< deleted because of Config::keep
    std::uint64_t bytes = 0;
    std::uint64_t steps = 0;  ///< including the current chunk
    std::uint64_t datagrams = 0;
    std::uint64_t lost_steps = 0;  ///< because of a full disk or a slow log thread
    std::uint64_t lost_datagrams = 0;
    std::uint64_t unauthenticated_left_out = 0;
    std::uint64_t datagrams_over_budget = 0;
    std::string error;  ///< the reason why recording is stopped, or empty

    /// True if no records are missing, except for those that DatagramFilter has left out.
    bool complete() const noexcept { return lost_steps == 0 && lost_datagrams == 0 && error.empty(); }
  };
  struct Notice {
    bool warning = false;
    std::string text;
  };

  /// Opens the first part. Throws the errors of open_next_part(). If the disk is full, this is reported by `status()`.
  explicit PartRecorder(const Config& config);
  PartRecorder(const PartRecorder&) = delete;
  PartRecorder& operator=(const PartRecorder&) = delete;

  void record(const StepRecord& step, std::size_t device = 0, std::string_view force_way = {});
  void record(const PortRecord& port, std::size_t device = 0);
  void record(const FieldInput& input, std::size_t device = 0);
  void record(const FieldData& data, std::size_t device = 0);
  void record(const DatagramRecord& datagram);
  void lost(const LossRecord& loss);
  void tick(LocalTime now);
  void close(LocalTime now);

  Status status() const;
  std::vector<Notice> take_notices();

 private:
  struct Counts {
    std::uint64_t steps = 0;
    std::uint64_t datagrams = 0;
  };

  bool open_part(LocalTime now);
  void look_after(LocalTime now);
  void finish_part(LocalTime now);
  void see_faults(const StepRecord& step, std::size_t device);
  void decide(LocalTime now);
  void stop(LocalTime now, std::string why);
  void go_on(LocalTime now);

  Config config_;
  std::unique_ptr<FileSink> sink_;
  std::optional<Recorder> recorder_;  ///< empty while recording is stopped, and after `close`
  LocalTime part_began_{};
  struct Undecided {
    std::filesystem::path path;
    LocalTime ended;
  };
  std::vector<Undecided> undecided_;
  std::map<std::array<std::size_t, 2>, FieldData> fields_;  ///< the newest one of each device and channel
  std::vector<bool> faulty_;
  std::optional<LocalTime> fault_;  ///< start of the newest fault
  bool stays_ = false;              ///< the current part must be kept
  Counts told_;
  Counts missing_;  ///< since recording was stopped
  LocalTime try_again_{};
  Status closed_;  ///< previous parts, and all recorded losses
  std::vector<Notice> notices_;
};

}  // namespace tendon
