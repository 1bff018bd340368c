// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/proxy/driver.h"

#include <sched.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <bitset>
#include <cerrno>
#include <ctime>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "tests/tools/injector/proxy/real_time.h"

namespace tendon::injector {
namespace {

// Data of an epoll event. Smaller values are a ClientIndex.
constexpr std::uint64_t kListener = std::uint64_t{1} << 32;
constexpr std::uint64_t kTimer = kListener + 1;
constexpr std::uint64_t kBell = kListener + 2;

/// Copying the histograms takes some 10 µs, and a display needs only a few updates per second.
constexpr Duration kPublishPeriod = std::chrono::milliseconds(200);
constexpr Duration kPublishRoom = std::chrono::microseconds(100);

/// Time without an answer before the next address is tried. A client repeats its Hello every 100 ms.
constexpr Duration kServerPatience = std::chrono::milliseconds(500);

bool by_the_same_socket(const TraceRecord& a, const TraceRecord& b) {
  if (a.direction != b.direction) return false;
  return a.direction == Direction::kDown || (a.link == b.link && a.rebinds == b.rebinds);
}

/// 100 probes per second give a p99 within a few seconds and add a tenth of the wake-ups of a haptic loop.
constexpr Duration kProbePeriod = std::chrono::milliseconds(10);

int checked(int result, const char* what) {
  if (result < 0) throw std::system_error(errno, std::generic_category(), what);
  return result;
}

}  // namespace

Driver::Driver(const Config& config, TraceRecorder* recorder)
    : config_(config),
      proxy_(config.proxy),
      recorder_(recorder),
      listener_(UdpBatch::listening(config.listen)),
      epoll_(checked(::epoll_create1(EPOLL_CLOEXEC), "epoll_create1")),
      // Uses a timerfd, because timeouts of poll and epoll are extended by 0.1 % of their length.
      timer_(checked(::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC), "timerfd_create")),
      bell_(checked(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC), "eventfd")) {
  // Throws here rather than at the first client.
  for (const Address& server : config.servers) UdpBatch::connected(server);
  watch(listener_.fd(), kListener, EPOLLIN);
  watch(timer_, kTimer, EPOLLIN | EPOLLET);
  watch(bell_, kBell, EPOLLIN);
}

Driver::~Driver() {
  for (const int fd : {epoll_, timer_, bell_}) ::close(fd);
}

void Driver::watch(int fd, std::uint64_t source, std::uint32_t events) const {
  epoll_event event{};
  event.events = events;
  event.data.u64 = source;
  checked(::epoll_ctl(epoll_, EPOLL_CTL_ADD, fd, &event), "epoll_ctl");
}

void Driver::stop() noexcept {
  stop_ = true;
  const int before = errno;
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(bell_, &one, sizeof one);
  errno = before;
}

void Driver::change(Proxy::PreparedChange change) {
  {
    const std::lock_guard lock(mutex_);
    changes_.push_back(std::move(change));
  }
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(bell_, &one, sizeof one);
}

Status Driver::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

void Driver::run() {
  if (config_.realtime) {
    const sched_param priority{.sched_priority = *config_.realtime};
    checked(::sched_setscheduler(0, SCHED_FIFO, &priority), "SCHED_FIFO");
  }
  start_ = monotonic_now();
  next_publish_ = start_ + kPublishPeriod;
  next_probe_ = start_ + kProbePeriod;
  if (config_.duration) end_ = start_ + *config_.duration;
  for (LocalTime now = start_; !stop_ && now < end_; now = monotonic_now()) {
    now = send_due(now);
    if (proxy_.ended() && proxy_.in_flight() == 0) break;
    while (const auto client = proxy_.next_evicted(now)) {
      if (const auto gone = upstreams_.find(*client); gone != upstreams_.end()) {
        closed_overflowed_ += gone->second.socket.overflowed();
        upstreams_.erase(gone);
      }
    }
    if (recorder_ != nullptr) recorder_->put(proxy_.records());
    if (now >= next_publish_ && publish(now)) next_publish_ = now + kPublishPeriod;
    seek_server(now);
    wait(now);
  }
  if (recorder_ != nullptr) recorder_->put(proxy_.records());
  Status last = measure(monotonic_now());
  const std::lock_guard lock(mutex_);
  status_ = std::move(last);
}

void Driver::wait(LocalTime now) {
  const std::optional<LocalTime> due = proxy_.next_wake();
  if (!probe_ && now >= next_probe_) probe_ = now + last_sleep_;
  LocalTime at = std::min(next_publish_, end_);
  Wake why = Wake::kOther;
  if (probe_ && *probe_ <= at) {
    at = *probe_;
    why = Wake::kProbe;
  }
  if (due && *due - config_.spin <= at) {
    at = *due - config_.spin;
    why = Wake::kRelease;
  }

  int timeout_ms = 0;
  if (at > now) {
    timeout_ms = -1;
    const auto since = at.time_since_epoch();
    const auto whole = std::chrono::floor<std::chrono::seconds>(since);
    const itimerspec timer{.it_interval = {}, .it_value = {whole.count(), (since - whole).count()}};
    checked(::timerfd_settime(timer_, TFD_TIMER_ABSTIME, &timer, nullptr), "timerfd_settime");
    if (why == Wake::kRelease) last_sleep_ = at - now;
  }
  std::array<epoll_event, 16> events;
  const int ready = ::epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), timeout_ms);
  if (ready < 0 && errno != EINTR) checked(ready, "epoll_wait");

  bool timer_rang = false;
  for (const epoll_event& event : std::span(events).first(static_cast<std::size_t>(std::max(ready, 0)))) {
    timer_rang = timer_rang || event.data.u64 == kTimer;
  }
  if (timer_rang && why != Wake::kOther) now = monotonic_now();
  if (timer_rang && why == Wake::kProbe) timer_floor_.observe(now - at);
  if (probe_ && now >= *probe_) {  // taken, or obsolete because the thread was busy at that time
    probe_.reset();
    next_probe_ = now + kProbePeriod;
  }
  if (timer_rang && why == Wake::kRelease) send_due(now);
  for (const epoll_event& event : std::span(events).first(static_cast<std::size_t>(std::max(ready, 0)))) {
    if (event.data.u64 == kBell) {
      take_changes(monotonic_now());
    } else if (event.data.u64 != kTimer) {
      receive(event.data.u64);
    }
  }
}

void Driver::receive(std::uint64_t source) {
  if (source == kListener) {
    for (const UdpBatch::Arrival& arrival : listener_.receive(inbox_)) take_from_client(arrival);
  } else {
    const auto client = static_cast<ClientIndex>(source);
    const auto upstream = upstreams_.find(client);
    if (upstream == upstreams_.end()) return;
    for (const UdpBatch::Arrival& arrival : upstream->second.socket.receive(inbox_)) {
      proxy_.receive_from_server(client, arrival.datagram, arrival.at);
    }
  }
  // Releases due datagrams between the sockets, so that they do not wait until all are read.
  send_due(monotonic_now());
}

void Driver::take_from_client(const UdpBatch::Arrival& arrival) {
  const bool is_new = proxy_.is_new(arrival.from);
  std::optional<UdpBatch> socket = is_new ? new_socket() : std::nullopt;
  const auto client = proxy_.receive_from_client(arrival.from, arrival.datagram, arrival.at, !is_new || socket);
  if (!client) return;
  if (socket) {
    watch(socket->fd(), *client, EPOLLIN);
    upstreams_.emplace(*client, Upstream{.socket = *std::move(socket)});
  }
  upstreams_.at(*client).asked_at = arrival.asked_at;
}

/// Returns nothing if the system refuses, for example because there are too many open files.
std::optional<UdpBatch> Driver::new_socket() {
  try {
    return UdpBatch::connected(config_.servers[server_]);
  } catch (const std::runtime_error& error) {
    if (no_socket_.empty()) no_socket_ = error.what();
    return std::nullopt;
  }
}

void Driver::replace_socket(ClientIndex client, Upstream& upstream, UdpBatch socket) {
  closed_overflowed_ += upstream.socket.overflowed();
  upstream.socket = std::move(socket);
  watch(upstream.socket.fd(), client, EPOLLIN);
}

void Driver::seek_server(LocalTime now) {
  if (config_.servers.size() == 1 || proxy_.measurements(Direction::kDown).counters.received > 0) return;
  const ProxyCounters& up = proxy_.measurements(Direction::kUp).counters;
  const std::uint64_t asked = up.forwarded + up.unsent;
  if (asked == asked_before_) next_server_ = now + kServerPatience;  // starts with the first datagram
  if (now < next_server_) return;
  server_ = (server_ + 1) % config_.servers.size();
  asked_before_ = asked;
  next_server_ = now + kServerPatience;
  for (auto& [client, upstream] : upstreams_) {
    if (auto socket = new_socket()) replace_socket(client, upstream, *std::move(socket));
  }
}

LocalTime Driver::send_due(LocalTime now) {
  for (;;) {
    due_.clear();
    while (due_.size() < kUdpBatch) {
      auto next = proxy_.next_due(now);
      if (!next) break;
      due_.push_back(*next);
    }
    if (due_.empty()) return now;
    // One system call sends all datagrams that share the socket of the first unsent one.
    std::bitset<kUdpBatch> sent;
    for (std::size_t first = 0; first < due_.size(); ++first) {
      if (!sent.test(first)) sent |= send_with(first, sent);
    }
    now = monotonic_now();
  }
}

std::bitset<kUdpBatch> Driver::send_with(std::size_t first, const std::bitset<kUdpBatch>& sent) {
  UdpBatch& socket = socket_for(due_[first]);
  std::array<UdpBatch::Outgoing, kUdpBatch> batch;
  std::array<std::size_t, kUdpBatch> places;
  std::size_t count = 0;
  std::bitset<kUdpBatch> now_sent;
  for (std::size_t i = first; i < due_.size(); ++i) {
    if (sent.test(i) || !by_the_same_socket(due_[i].record, due_[first].record)) continue;
    batch[count] = {due_[i].to, due_[i].datagram, asked_at(due_[i])};
    places[count++] = i;
    now_sent.set(i);
  }
  const LocalTime begin = monotonic_now();
  const std::bitset<kUdpBatch> refused = socket.send(std::span(batch).first(count));
  const Duration took = monotonic_now() - begin;
  for (std::size_t k = 0; k < count; ++k) {
    const Proxy::Departure& departure = due_[places[k]];
    // The kernel processes the datagrams of a call one by one, so their departures are spread evenly over its duration.
    const LocalTime left = begin + took * static_cast<std::int64_t>(k) / static_cast<std::int64_t>(count);
    refused.test(k) ? proxy_.not_sent(departure) : proxy_.left(departure, left);
  }
  return now_sent;
}

UdpBatch& Driver::socket_for(const Proxy::Departure& departure) {
  if (departure.record.direction == Direction::kDown) return listener_;
  Upstream& upstream = upstreams_.at(departure.record.link);
  if (departure.record.rebinds > upstream.rebinds) {
    if (auto socket = new_socket()) {
      replace_socket(departure.record.link, upstream, *std::move(socket));
      upstream.rebinds = departure.record.rebinds;
    } else {
      ++late_rebinds_;
    }
  }
  return upstream.socket;
}

/// Returns zeros if the listener is bound to a single address.
Address Driver::asked_at(const Proxy::Departure& departure) const {
  if (departure.record.direction == Direction::kUp) return {};
  return upstreams_.at(departure.record.link).asked_at;
}

void Driver::take_changes(LocalTime now) {
  std::uint64_t rings = 0;
  [[maybe_unused]] const auto got = ::read(bell_, &rings, sizeof rings);
  std::vector<Proxy::PreparedChange> changes;
  {
    const std::lock_guard lock(mutex_);
    changes.swap(changes_);
  }
  for (const Proxy::PreparedChange& change : changes) proxy_.change(change, now);
}

Status Driver::measure(LocalTime now) const {
  Status status;
  status.elapsed = now - start_;
  for (const Direction direction : {Direction::kUp, Direction::kDown}) {
    status.directions[static_cast<std::size_t>(direction)] = proxy_.measurements(direction);
  }
  status.clients = proxy_.clients();
  status.in_flight = proxy_.in_flight();
  status.timer_floor = timer_floor_;
  status.overflowed = closed_overflowed_ + listener_.overflowed();
  for (const auto& [client, upstream] : upstreams_) status.overflowed += upstream.socket.overflowed();
  if (recorder_ != nullptr) status.unrecorded = recorder_->lost();
  status.scenario_steps = config_.proxy.timeline.size();
  status.scenario_done = proxy_.steps_done();
  status.last_change = proxy_.last_change();
  status.server = config_.servers[server_];
  status.no_socket = no_socket_;
  status.late_rebinds = late_rebinds_;
  return status;
}

bool Driver::publish(LocalTime now) {
  const std::optional<LocalTime> due = proxy_.next_wake();
  if (due && *due - now < kPublishRoom && now - next_publish_ < kPublishPeriod) return false;
  proxy_.follow_timeline(now);
  Status status = measure(now);
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) return false;
  status_ = std::move(status);
  return true;
}

}  // namespace tendon::injector
