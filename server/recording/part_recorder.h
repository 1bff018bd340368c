// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
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

/// Records a run into as many files as needed (part_files.h), each a complete recording that begins with the scenes. A
/// new part begins
///
/// * when the part has reached `rotate_bytes`, or is `rotate_after` old;
/// * when its index has 65 536 chunks, some 10 MB: the memory of a run does not grow with its length;
/// * if the previous part could not be written because the disk was full or the file was deleted. The new part starts
///   as soon as this is possible. It starts with a Lost record that contains the number of missing steps.
///
/// With a budget the oldest parts are deleted before a new one begins, so that all of them together stay within it.
///
/// With Keep::kFaults a part takes a minute at the most, and stays only when a fault began in it, in the minute after
/// it or in the 10 s before it, or when its number says so. It is deleted as soon as neither can be: the last ones when
/// the run ends without a fault. A run that is killed leaves those that were not decided yet.
///
/// Records come in the order of Recorder. Thread-safe: no; the log thread owns it. Realtime-safe: no.
class PartRecorder {
 public:
  struct Config {
    std::filesystem::path path;
    Recorder::Config run;
    std::uint64_t rotate_bytes = 4'000'000'000;
    Duration rotate_after = std::chrono::hours(4);
    /// Bytes of all parts with this name, including those of earlier runs; 0: nothing is deleted. With a budget a part
    /// has at most a quarter of it.
    std::uint64_t budget_bytes = 0;
    Keep keep = Keep::kAll;
    /// With Keep::kFaults, part 1 of this run, 1 + one_in, 1 + 2 one_in … stay, too; 0: no part stays for its number.
    std::uint64_t one_in = 0;
    /// The time between two looks for free space while recording has stopped.
    Duration retry_after = std::chrono::seconds(1);
  };
  struct Status {
    std::filesystem::path path;  ///< of the newest part
    std::uint64_t parts = 0;
    std::uint64_t parts_not_kept = 0;         ///< of these; deleted by Config::keep
    std::uint64_t bytes = 0;                  ///< in all parts of this run
    std::uint64_t steps = 0;                  ///< likewise, or in the open chunk
    std::uint64_t datagrams = 0;              ///< likewise
    std::uint64_t lost_steps = 0;             ///< not recorded: the disk was full, or the log thread could not follow
    std::uint64_t lost_datagrams = 0;         ///< likewise
    std::uint64_t strangers_left_out = 0;     ///< on purpose, see DatagramSieve
    std::uint64_t datagrams_over_budget = 0;  ///< likewise
    std::string error;                        ///< why nothing is recorded now; empty while it is

    /// True when nothing is missing except records left out on purpose.
    bool complete() const noexcept { return lost_steps == 0 && lost_datagrams == 0 && error.empty(); }
  };
  /// An event that the operator should read in the log.
  struct Notice {
    bool warning = false;
    std::string text;
  };

  /// Opens the first part. Throws std::runtime_error, see open_next_part. A disk that is full shows in `status()`.
  explicit PartRecorder(const Config& config);
  PartRecorder(const PartRecorder&) = delete;
  PartRecorder& operator=(const PartRecorder&) = delete;

  /// As those of Recorder.
  void record(const StepRecord& step, std::size_t device = 0, std::string_view force_way = {});
  void record(const PortRecord& port, std::size_t device = 0);
  void record(const DatagramRecord& datagram);
  void lost(const LossRecord& loss);
  void tick(LocalTime now);
  void close(LocalTime now);

  Status status() const;
  /// The events since the last call.
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
  std::optional<Recorder> recorder_;  ///< of the open part; empty while recording has stopped, and after `close`
  LocalTime part_began_{};
  /// A closed part that stays when a fault comes soon enough.
  struct Undecided {
    std::filesystem::path path;
    LocalTime ended;
  };
  std::vector<Undecided> undecided_;
  std::vector<bool> faulty_;        ///< by device, in its newest step
  std::optional<LocalTime> fault_;  ///< when the newest began
  bool stays_ = false;              ///< the open part
  Counts told_;                     ///< losses that the open part was told of
  Counts missing_;                  ///< since recording stopped
  LocalTime try_again_{};
  Status closed_;  ///< of the parts before, and all losses that were told
  std::vector<Notice> notices_;
};

}  // namespace tendon
