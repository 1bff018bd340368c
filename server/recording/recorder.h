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

/// Records scene, steps and datagrams in an MCAP file, as protobuf (recording.proto), for Foxglove and PlotJuggler.
///
/// * If the server is killed, the file is still readable, but the last `flush_after` may be missing.
/// * The output is deterministic. It does not depend on a clock or on addresses in memory.
/// * If the sink fails, for example because the disk is full, no more data is written. Later records are counted, the
///   existing data is readable, and `status().error` is the reason. PartRecorder continues with another file.
///
/// Steps must be passed in chronological order, and so must datagrams, but not relative to each other.
/// Thread-safe: no, only used by the log thread. Realtime-safe: no.
class Recorder {
 public:
  struct Device {
    std::string name;  ///< used in the topics /NAME/scene and /NAME/haptic/step
    SceneRecord scene;
    bool ports = false;   ///< it has a coupling
    bool fields = false;  ///< engines may use fields
  };
  struct Config {
    SceneRecord scene;
    bool ports = false;   ///< the first device has a coupling
    bool fields = false;  ///< engines may use fields with the first device
    std::vector<Device> more_devices{};
    LocalTime started{};  ///< log time of the scene
    /// The most that is lost if the process is killed. Each flush requires a write(2) and about 300 bytes in the file.
    Duration flush_after = std::chrono::milliseconds(250);
    /// Bytes of messages at which a chunk is closed. A reader seeks to chunks and keeps some of them in memory.
    std::size_t flush_size = std::size_t{256} * 1024;
  };
  struct Status {
    std::uint64_t bytes = 0;           ///< in the file
    std::uint64_t steps = 0;           ///< including the current chunk
    std::uint64_t datagrams = 0;       ///< including the current chunk
    std::uint64_t lost_steps = 0;      ///< reported by `lost`, or not accepted by the sink
    std::uint64_t lost_datagrams = 0;  ///< for the same reasons
    std::string error;                 ///< the reason why recording has failed, or empty
  };

  /// Writes the scene immediately, and reports failures by `status()`. `sink` must outlive the recorder.
  Recorder(const Config& config, ByteSink& sink);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// `device` is 0 for the first device, followed by `more_devices`. `force_way` is the name of Step::force_way.
  void record(const StepRecord& step, std::size_t device = 0, std::string_view force_way = {});
  /// The device must have `ports`. Must be called before recording the step with the same tick.
  void record(const PortRecord& port, std::size_t device = 0);
  /// The device must have `fields`. As for a port, and after the FieldData of a field to use.
  void record(const FieldInput& input, std::size_t device = 0);
  void record(const FieldData& data, std::size_t device = 0);
  void record(const DatagramRecord& datagram);
  void lost(const LossRecord& loss);  ///< previous records were dropped by the caller

  /// Flushes records that are older than `flush_after`. Should be called after each batch of records.
  void tick(LocalTime now);

  /// Adds the index, without which the file counts as truncated and opens slowly. Later records are counted as lost.
  void close();

  Status status() const;
  bool failed() const noexcept { return failed_; }  ///< faster than `status()`
  std::uint64_t bytes() const noexcept { return writer_.bytes_written(); }
  /// The chunks in the index, which requires about 150 bytes of memory per chunk until `close` is called.
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
  std::vector<std::uint16_t> port_channels_;  ///< by device; 0 if it has no coupling
  struct FieldChannels {
    std::uint16_t input = 0;
    std::uint16_t data = 0;
  };
  std::vector<FieldChannels> field_channels_;  ///< by device; 0 without fields
  std::uint16_t datagram_channel_;
  std::uint16_t loss_channel_;
  std::optional<LocalTime> chunk_opened_;
  Counts kept_;     ///< accepted by the sink
  Counts pending_;  ///< in the current chunk
  Counts lost_;
  bool failed_ = false;
  bool closed_ = false;
};

}  // namespace tendon
