// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/tools/injector/traces/trace.h"

namespace tendon::injector {

/// Writes a trace file in its own thread, so that no datagram waits for the disk.
class TraceRecorder {
 public:
  /// Maximum number of queued records, half a minute at 10 000 per second; more are lost and counted.
  static constexpr std::size_t kMaxWaiting = 300'000;

  /// Throws std::runtime_error if `file` cannot be written.
  TraceRecorder(const std::filesystem::path& file, const TraceHeader& header);
  ~TraceRecorder();
  TraceRecorder(const TraceRecorder&) = delete;
  TraceRecorder& operator=(const TraceRecorder&) = delete;

  /// Takes the content of `records`, but leaves it for the next call while the writer is fetching the queue and there
  /// is room. Must be called from one thread only. Never blocks.
  void put(std::vector<TraceRecord>& records);
  /// Adds a comment after the records put so far. Thread-safe.
  void note(std::string text);
  /// Number of records lost by put(). Thread-safe.
  std::uint64_t lost() const noexcept { return lost_; }

  /// Ends the thread. Throws std::runtime_error if something could not be written.
  void finish();

 private:
  void write_until_the_end();

  std::filesystem::path file_;
  std::ofstream stream_;
  TraceWriter writer_;
  std::atomic<std::uint64_t> lost_ = 0;
  std::atomic<bool> end_ = false;
  std::mutex mutex_;  // protects the members below
  std::vector<TraceRecord> waiting_;
  std::vector<std::string> notes_;
  std::thread thread_;
};

}  // namespace tendon::injector
