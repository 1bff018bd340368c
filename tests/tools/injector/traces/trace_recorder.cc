// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/traces/trace_recorder.h"

#include <cerrno>
#include <chrono>
#include <iterator>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "tests/support/files.h"

namespace tendon::injector {
namespace {

/// Delay of a record before it is written. Polling avoids a system call in the thread that calls put().
constexpr auto kPeriod = std::chrono::milliseconds(50);

std::ofstream open(const std::filesystem::path& file) {
  expect_replaceable(file, {kTraceBegins});
  errno = 0;
  std::ofstream stream(file, std::ios::binary | std::ios::trunc);
  if (!stream) {
    throw std::runtime_error("cannot write " + file.string() + ": " + std::generic_category().message(errno));
  }
  return stream;
}

}  // namespace

TraceRecorder::TraceRecorder(const std::filesystem::path& file, const TraceHeader& header)
    : file_(file), stream_(open(file)), writer_(stream_, header), thread_([this] { write_until_the_end(); }) {}

TraceRecorder::~TraceRecorder() {
  end_ = true;
  if (thread_.joinable()) thread_.join();
}

void TraceRecorder::put(std::vector<TraceRecord>& records) {
  if (records.empty()) return;
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) {
    if (records.size() < kMaxWaiting) return;
    lost_ += records.size();
  } else if (waiting_.empty()) {
    waiting_.swap(records);
  } else if (waiting_.size() + records.size() > kMaxWaiting) {
    lost_ += records.size();
  } else {
    waiting_.insert(waiting_.end(), std::make_move_iterator(records.begin()), std::make_move_iterator(records.end()));
  }
  records.clear();
}

void TraceRecorder::note(std::string text) {
  const std::lock_guard lock(mutex_);
  notes_.push_back(std::move(text));
}

void TraceRecorder::write_until_the_end() {
  std::vector<TraceRecord> records;
  std::vector<std::string> notes;
  for (bool last = false; !last;) {
    last = end_;
    {
      const std::lock_guard lock(mutex_);
      records.swap(waiting_);
      notes.swap(notes_);
    }
    for (const TraceRecord& record : records) writer_.write(record);
    for (const std::string& note : notes) writer_.note(note);
    records.clear();
    notes.clear();
    if (!last) std::this_thread::sleep_for(kPeriod);
  }
  stream_.flush();
}

void TraceRecorder::finish() {
  end_ = true;
  thread_.join();
  if (!stream_) throw std::runtime_error("cannot write " + file_.string() + ": is the disk full?");
  if (lost_ > 0) {
    throw std::runtime_error(file_.string() + " is incomplete: the disk was too slow for " + std::to_string(lost_) +
                             " datagrams");
  }
}

}  // namespace tendon::injector
