// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"
#include "server/recording/byte_sink.h"
#include "server/recording/mcap_writer.h"
#include "server/recording/recording_codec.h"
#include "server/recording/records.h"

namespace tendon {

/// Records a run: the scene, every haptic step and every datagram, as one MCAP file with protobuf messages
/// (recording.proto) that Foxglove and PlotJuggler open as it is.
///
/// * A server killed at any instant leaves a readable file that lacks at most the last `flush_after` of its run.
/// * The same calls give the same bytes: no clock is read and nothing depends on an address.
/// * When the sink fails (a full disk), recording ends for good: later records are counted, nothing else happens, and
///   what was written stays readable. `status().error` says why. PartRecorder goes on in another file.
///
/// Steps come in the order of their time, and so do datagrams; how the two interleave does not matter.
///
/// Thread-safe: no; the log thread owns it. Realtime-safe: no.
class Recorder {
 public:
  /// A device besides the first.
  struct Device {
    std::string name;  ///< its records are in channels /NAME/scene and /NAME/haptic/step
    SceneRecord scene;
    bool ports = false;  ///< it has a coupling
  };
  struct Config {
    SceneRecord scene;
    bool ports = false;  ///< the first device has a coupling
    std::vector<Device> more_devices{};
    LocalTime started{};  ///< time of the scene's message
    /// The most recorded time that a kill can cost. Each flush costs one write(2) and some 300 bytes of chunk and
    /// index.
    Duration flush_after = std::chrono::milliseconds(250);
    /// Bytes of messages at which a chunk closes earlier. A reader seeks by chunks and holds a few in memory.
    std::size_t flush_size = std::size_t{256} * 1024;
  };
  struct Status {
    std::uint64_t bytes = 0;           ///< in the file
    std::uint64_t steps = 0;           ///< in the file, or in the open chunk
    std::uint64_t datagrams = 0;       ///< likewise
    std::uint64_t lost_steps = 0;      ///< not in the file: reported by `lost`, or given up by a failed sink
    std::uint64_t lost_datagrams = 0;  ///< likewise
    std::string error;                 ///< why recording has ended early; empty while it goes on
  };

  /// Writes the scene at once. `sink` must outlive the recorder; its failure shows in `status()`.
  Recorder(const Config& config, ByteSink& sink);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// `device` by number: 0 is the first, and those of `more_devices` follow. `force_way`: the name of its force_way.
  void record(const StepRecord& step, std::size_t device = 0, std::string_view force_way = {});
  /// Of a device with `ports`; before the step with the same tick.
  void record(const PortRecord& port, std::size_t device = 0);
  void record(const DatagramRecord& datagram);
  /// Notes that records were dropped before they came here, so that a reader knows of the gap.
  void lost(const LossRecord& loss);

  /// Flushes records that are older than `flush_after`, even when no new ones come. Call it after each batch of
  /// records.
  void tick(LocalTime now);

  /// Ends the file with an index. Without it the file is readable, but counts as truncated, and opens slower.
  /// Records that come later are lost, and counted.
  void close();

  Status status() const;
  /// Parts of `status()`, without its cost.
  bool failed() const noexcept { return failed_; }
  std::uint64_t bytes() const noexcept { return writer_.bytes_written(); }
  /// In the index, which is kept in memory until `close`: some 150 bytes each.
  std::size_t chunks() const noexcept { return writer_.chunks(); }

 private:
  struct Counts {
    std::uint64_t steps = 0;
    std::uint64_t datagrams = 0;
  };

  void write(std::uint16_t channel, LocalTime at, const std::string& message);
  bool recording() const noexcept { return !failed_ && !closed_; }
  void settle(bool kept);

  Config config_;
  ByteSink& sink_;
  McapWriter writer_;
  std::uint16_t scene_channel_;
  std::vector<std::uint16_t> step_channels_;  ///< by device
  std::vector<std::uint16_t> port_channels_;  ///< by device; 0: it has no coupling
  std::uint16_t datagram_channel_;
  std::uint16_t loss_channel_;
  std::optional<LocalTime> chunk_opened_;
  Counts kept_;     ///< taken by the sink
  Counts pending_;  ///< in the open chunk
  Counts lost_;
  bool failed_ = false;
  bool closed_ = false;
};

}  // namespace tendon
