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

/// Writes a trace file in a thread of its own, so that no datagram waits for the disk.
class TraceRecorder {
 public:
  /// Records that wait for the disk at most, half a minute of 10 000 a second; more are lost and counted.
  static constexpr std::size_t kMaxWaiting = 300'000;

  /// Creates or replaces `file`. Throws std::runtime_error when it cannot be written.
  TraceRecorder(const std::filesystem::path& file, const TraceHeader& header);
  /// As finish() does, except that nobody is told of an error.
  ~TraceRecorder();
  TraceRecorder(const TraceRecorder&) = delete;
  TraceRecorder& operator=(const TraceRecorder&) = delete;

  /// Takes over `records`, and leaves them empty; leaves them as they are when the writer is just fetching the last
  /// ones and there is still room, so that the caller tries again with its next ones. By one thread, which never waits
  /// here.
  void put(std::vector<TraceRecord>& records);
  /// A comment in the trace, after what was put before it. Thread-safe.
  void note(std::string text);
  /// Lost by put(). Thread-safe.
  std::uint64_t lost() const noexcept { return lost_; }

  /// Writes what is left and ends the thread. Throws std::runtime_error when not all could be written.
  void finish();

 private:
  void write_until_the_end();

  std::filesystem::path file_;
  std::ofstream stream_;
  TraceWriter writer_;
  std::atomic<std::uint64_t> lost_ = 0;
  std::atomic<bool> end_ = false;
  std::mutex mutex_;  // of what follows
  std::vector<TraceRecord> waiting_;
  std::vector<std::string> notes_;
  std::thread thread_;
};

}  // namespace tendon::injector
