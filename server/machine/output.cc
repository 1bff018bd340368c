// SPDX-License-Identifier: Apache-2.0
#include "server/machine/output.h"

#include <poll.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdint>
#include <deque>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <streambuf>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

namespace tendon {
namespace {

constexpr std::size_t kWrite = 4096;  ///< PIPE_BUF on Linux: poll(2) guarantees a write without blocking
constexpr int kLook_ms = 20;          ///< the polling period if no stream is writable

class Queue {
 public:
  explicit Queue(std::array<int, 2> files) : files_(files) {}

  void add(std::size_t stream, std::string_view text) {
    const std::scoped_lock lock(mutex_);
    add_line(stream, text);
    changed_.notify_all();
  }

  void write() {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] { return ended_ || !waiting_.empty(); });
      if (ended_) return;
      const std::array<bool, 2> has = {has_text(0), has_text(1)};
      lock.unlock();
      const std::array<bool, 2> ready = look(has);
      lock.lock();
      const auto next = std::ranges::find_if(waiting_, [&](const Chunk& chunk) { return ready[chunk.stream]; });
      if (next == waiting_.end()) continue;
      const std::size_t stream = next->stream;
      next->begun = true;  // must not be changed by `push`
      const std::string part = next->text.substr(0, kWrite);
      lock.unlock();
      const ssize_t written = ::write(files_[stream], part.data(), part.size());
      const int error = written < 0 ? errno : 0;
      lock.lock();
      if (error == EINTR || error == EAGAIN) continue;
      remove(stream, written < 0 ? std::nullopt : std::optional(static_cast<std::size_t>(written)));
      changed_.notify_all();
    }
  }

  bool finish(std::chrono::duration<double> patience) {
    std::unique_lock lock(mutex_);
    for (const std::size_t stream : {0U, 1U}) report_dropped(stream);
    changed_.notify_all();
    while (!waiting_.empty()) {
      const std::uint64_t before = writes_;
      if (!changed_.wait_for(lock, patience, [&] { return waiting_.empty() || writes_ != before; })) return false;
    }
    return true;
  }

  void end() {
    const std::scoped_lock lock(mutex_);
    ended_ = true;
    changed_.notify_all();
  }

 private:
  struct Chunk {
    std::size_t stream;
    std::string text;
    bool begun = false;
  };

  bool has_text(std::size_t stream) const {
    return std::ranges::any_of(waiting_, [&](const Chunk& chunk) { return chunk.stream == stream; });
  }

  std::array<bool, 2> look(const std::array<bool, 2>& has) const {
    std::array<pollfd, 2> polled{};
    for (const std::size_t stream : {0U, 1U}) polled[stream] = {has[stream] ? files_[stream] : -1, POLLOUT, 0};
    ::poll(polled.data(), polled.size(), kLook_ms);
    return {polled[0].revents != 0, polled[1].revents != 0};  // including errors
  }

  void add_line(std::size_t stream, std::string_view text) {
    Stream& s = streams_[stream];
    if (s.bytes + text.size() > (s.dropped > 0 ? UnblockedOutput::kQueueBytes / 2 : UnblockedOutput::kQueueBytes)) {
      ++s.dropped;
      s.json = text.starts_with('{');
      return;
    }
    report_dropped(stream);
    push(stream, text);
  }

  void report_dropped(std::size_t stream) {
    Stream& s = streams_[stream];
    const std::uint64_t lines = std::exchange(s.dropped, 0);
    if (lines == 0) return;
    const std::string number = std::to_string(lines);
    push(stream, s.json       ? R"({"event":"dropped","lines":)" + number + "}\n"
                 : lines == 1 ? "1 line was dropped because it was not read\n"
                              : number + " lines were dropped because they were not read\n");
  }

  void push(std::size_t stream, std::string_view text) {
    if (waiting_.empty() || waiting_.back().stream != stream || waiting_.back().begun ||
        waiting_.back().text.size() + text.size() > kWrite) {
      waiting_.push_back({stream, {}});
    }
    waiting_.back().text += text;
    streams_[stream].bytes += text.size();
  }

  /// If the output cannot be written, for example on a full disk, the chunk is dropped.
  void remove(std::size_t stream, std::optional<std::size_t> written) {
    const auto first = std::ranges::find_if(waiting_, [&](const Chunk& chunk) { return chunk.stream == stream; });
    const std::size_t bytes = written.value_or(first->text.size());
    first->text.erase(0, bytes);
    streams_[stream].bytes -= bytes;
    if (first->text.empty()) waiting_.erase(first);
    ++writes_;
  }

  struct Stream {
    std::size_t bytes = 0;
    std::uint64_t dropped = 0;
    bool json = false;
  };

  std::array<int, 2> files_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Chunk> waiting_;
  std::array<Stream, 2> streams_;
  std::uint64_t writes_ = 0;
  bool ended_ = false;
};

class Lines : public std::streambuf {
 public:
  Lines(Queue& queue, std::size_t stream) : queue_(queue), stream_(stream) {}

 protected:
  int_type overflow(int_type character) override {
    if (traits_type::eq_int_type(character, traits_type::eof())) return traits_type::not_eof(character);
    const char c = traits_type::to_char_type(character);
    return xsputn(&c, 1) == 1 ? character : traits_type::eof();
  }
  std::streamsize xsputn(const char* text, std::streamsize size) override {
    const std::scoped_lock lock(mutex_);
    partial_.append(text, static_cast<std::size_t>(size));
    const std::size_t end = partial_.rfind('\n');
    if (end != std::string::npos) take(end + 1);
    return size;
  }
  int sync() override {
    const std::scoped_lock lock(mutex_);
    take(partial_.size());
    return 0;
  }

 private:
  void take(std::size_t size) {
    std::string_view text(partial_.data(), size);
    while (!text.empty()) {
      const std::size_t line = std::min(text.find('\n'), text.size() - 1) + 1;
      queue_.add(stream_, text.substr(0, line));
      text.remove_prefix(line);
    }
    partial_.erase(0, size);
  }

  Queue& queue_;
  std::size_t stream_;
  std::mutex mutex_;
  std::string partial_;
};

std::atomic<bool> exists{false};

}  // namespace

class UnblockedOutput::Redirection {
 public:
  Redirection() {
    // The other threads handle signals. SIGPIPE must not be blocked, because it is sent to the thread that writes.
    sigset_t all;
    sigset_t before;
    sigfillset(&all);
    sigdelset(&all, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &all, &before);
    try {
      // The queue is shared because a blocked write can outlive this object.
      thread_ = std::thread([queue = queue_] {
        pthread_setname_np(pthread_self(), "output");
        queue->write();
      });
    } catch (const std::system_error& error) {
      pthread_sigmask(SIG_SETMASK, &before, nullptr);
      throw std::runtime_error("cannot start the thread output: " + error.code().message());
    }
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    // By default, std::cerr is flushed after each operator<<, and it is tied to std::cout.
    std::cerr.unsetf(std::ios::unitbuf);
    tied_ = std::cerr.tie(nullptr);
    out_before_ = std::cout.rdbuf(&out_);
    err_before_ = std::cerr.rdbuf(&err_);
  }
  ~Redirection() {
    std::cout.flush().rdbuf(out_before_);
    std::cerr.flush().rdbuf(err_before_);
    std::cerr.tie(tied_);
    std::cerr.setf(std::ios::unitbuf);
    const bool written = flush();
    queue_->end();
    written ? thread_.join() : thread_.detach();
  }
  bool flush() { return queue_->finish(std::chrono::duration<double>(kPatience_s)); }
  Redirection(const Redirection&) = delete;
  Redirection& operator=(const Redirection&) = delete;

 private:
  std::shared_ptr<Queue> queue_ = std::make_shared<Queue>(std::array{STDOUT_FILENO, STDERR_FILENO});
  Lines out_{*queue_, 0};
  Lines err_{*queue_, 1};
  std::streambuf* out_before_ = nullptr;
  std::streambuf* err_before_ = nullptr;
  std::ostream* tied_ = nullptr;
  std::thread thread_;
};

UnblockedOutput::UnblockedOutput() {
  if (exists.exchange(true)) return;
  try {
    redirection_ = std::make_unique<Redirection>();
  } catch (...) {
    exists = false;
    throw;
  }
}

void UnblockedOutput::flush() {
  if (redirection_) redirection_->flush();
}

UnblockedOutput::~UnblockedOutput() {
  if (!redirection_) return;
  redirection_.reset();
  exists = false;
}

}  // namespace tendon
