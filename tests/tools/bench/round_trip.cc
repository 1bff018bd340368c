// SPDX-License-Identifier: Apache-2.0
//
// Round trip from a state posted by the server to the decoded force that answers it, over the loopback and through a
// client like `virtual_wall` in another process. The baseline is a ping-pong of bare datagrams of the same sizes
// between the same processes with the same kinds of sockets and the same waiting. Both alternate in blocks, so that
// other load affects both. Sealed suites have a second baseline, in which libsodium also seals and opens each datagram.
// A Unix socket has a baseline over Unix sockets, and alternates with the one over UDP.
#include <netinet/in.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "clients/cpp/force_client.h"
#include "clients/cpp/udp_transport.h"
#include "protocol/busy_link.h"
#include "protocol/secrets/seal.h"
#include "protocol/secrets/suites.h"
#include "protocol/wire/header.h"
#include "server/machine/clock.h"
#include "server/machine/udp_link.h"
#include "server/network_loop.h"
#include "tests/tools/bench/bench.h"
#include "tests/tools/bench/measure.h"
#include "tests/tools/bench/other_process.h"
#include "tests/tools/bench/peers/echo_client.h"
#include "tests/tools/bench/round_trip.h"

namespace tendon::bench {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr Duration kGiveUp = std::chrono::seconds(10);

struct Options {
  int blocks = 40;
  int exchanges = 500;  ///< per kind and block
  int warm_up = 50;     ///< excluded exchanges at the start of each block (caches, processor frequency)
  int priority = 0;     ///< SCHED_FIFO, both processes
  Duration reply_delay{};
};

enum class Wait : std::uint8_t { kBusy, kBlocking };
enum class Way : std::uint8_t { kUdp, kUnix };

struct Orders {
  enum Job : int { kRest, kEcho, kSealedEcho, kUdpEcho, kTendon, kQuit };
  std::atomic<int> job{kRest};
  std::atomic<int> at_work{kRest};  ///< job in progress
  std::atomic<int> echo_bytes{0};   ///< size of its reply
};

struct Name {
  sockaddr_storage bytes{};
  socklen_t size = sizeof bytes;

  sockaddr* get() noexcept { return reinterpret_cast<sockaddr*>(&bytes); }
  const sockaddr* get() const noexcept { return reinterpret_cast<const sockaddr*>(&bytes); }
};

/// Two nonblocking sockets: the server's is unconnected, as a real server's; the client's is connected to it.
class BarePair {
 public:
  explicit BarePair(Way way) : server_(named(way)), client_(named(way)), client_name_(name_of(client_)) {
    const Name server = name_of(server_);
    if (::connect(client_, server.get(), server.size) != 0) fail("cannot connect a bare socket");
  }
  ~BarePair() {
    ::close(server_);
    ::close(client_);
  }
  BarePair(const BarePair&) = delete;
  BarePair& operator=(const BarePair&) = delete;

  int server() const noexcept { return server_; }
  int client() const noexcept { return client_; }
  const Name& client_name() const noexcept { return client_name_; }

 private:
  static int named(Way way) {
    Name any;
    if (way == Way::kUdp) {
      auto& loopback = reinterpret_cast<sockaddr_in&>(any.bytes);
      loopback.sin_family = AF_INET;
      loopback.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      any.size = sizeof loopback;
    } else {
      any.bytes.ss_family = AF_UNIX;
      any.size = sizeof(sa_family_t);
    }
    const int fd = ::socket(any.bytes.ss_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (fd < 0 || ::bind(fd, any.get(), any.size) != 0) fail("cannot open a bare socket");
    return fd;
  }
  static Name name_of(int fd) {
    Name name;
    if (::getsockname(fd, name.get(), &name.size) != 0) fail("getsockname");
    return name;
  }

  int server_;
  int client_;
  Name client_name_;
};

/// An end of the baseline's ping-pong. With a `suite`, libsodium seals and opens all but the first 16 bytes.
class BareSocket {
 public:
  /// `peer`: the address that a server's socket answers; null for a client's connected socket.
  BareSocket(int fd, const Name* peer, Wait wait, std::optional<Suite> suite) : fd_(fd), wait_(wait), to_(peer) {
    if (suite) key_.emplace(*suite, Key{});
  }

  void send(std::size_t size) {
    if (key_) {
      const auto body = std::span(buffer_).subspan(kHeaderSize, size - kHeaderSize);
      key_->seal(0, std::span(buffer_).first(kHeaderSize), body.first(body.size() - crypto::kTagSize), body);
    }
    const sockaddr* const to = to_ != nullptr ? to_->get() : nullptr;
    if (::sendto(fd_, buffer_.data(), size, 0, to, to_ != nullptr ? to_->size : 0) < 0) fail("send");
  }
  bool receive() {
    if (wait_ == Wait::kBlocking) {
      pollfd readable{fd_, POLLIN, 0};
      const timespec time{0, 1'000'000};
      ::ppoll(&readable, 1, &time, nullptr);
    }
    from_.size = sizeof from_.bytes;
    const ssize_t size = ::recvfrom(fd_, buffer_.data(), buffer_.size(), 0, to_ != nullptr ? from_.get() : nullptr,
                                    to_ != nullptr ? &from_.size : nullptr);
    if (size <= 0 || !key_) return size > 0;
    const auto body = std::span(buffer_).subspan(kHeaderSize, static_cast<std::size_t>(size) - kHeaderSize);
    return key_->open(0, std::span(buffer_).first(kHeaderSize), body, body.first(body.size() - crypto::kTagSize));
  }

 private:
  int fd_;
  Wait wait_;
  std::optional<SealingKey> key_;
  const Name* to_;
  Name from_;
  std::array<std::byte, kMaxDatagram> buffer_{};
};

/// The server's link. Polls the mailbox between system calls, as the haptic thread on its own core does.
class WatchedLink : public Link {
 public:
  WatchedLink(Link& link, Mailboxes& mail) : link_(link), mail_(mail) {}

  void send(const Address& to, std::span<const std::byte> datagram) override { link_.send(to, datagram); }
  std::size_t receive(Address& from, std::span<std::byte> buffer) override {
    look();
    return link_.receive(from, buffer);
  }
  LocalTime present(LocalTime now) const override { return link_.present(now); }
  LocalTime arrived(LocalTime now) const override { return link_.arrived(now); }
  LocalTime reached(LocalTime now) const override { return link_.reached(now); }
  void look() {
    const RemoteForce* const force = mail_.forces.front().take();
    if (force == nullptr) return;
    answered_tick = force->answers_tick;
    seen = clock::now();
  }

  std::uint64_t answered_tick = 0;  ///< the tick of the newest force in the mailbox
  LocalTime seen{};                 ///< when that force arrived

 private:
  Link& link_;
  Mailboxes& mail_;
};

void serve(Orders& orders, const ServerName& server, int echo, int udp_echo, Wait wait, const std::optional<Key>& key,
           std::optional<Suite> suite, Duration reply_delay) {
  EchoSetup setup;
  setup.reply_delay = reply_delay;
  UdpTransport transport(server);
  BusyLink busy(transport);
  ForceClient::Config config;
  config.name = "wall";
  config.key = key;
  config.seed = 7;
  ForceClient client(
      wait == Wait::kBusy ? static_cast<Link&>(busy) : transport, transport.server(), config,
      [&setup](const DeviceState& hand) -> Touch {
        setup.delay_reply();
        return Vec3(-2000 * std::max(0.0, hand.position.x()), 0, 0);
      },
      clock::now());
  BareSocket bare(echo, nullptr, wait, std::nullopt);
  BareSocket sealed(echo, nullptr, wait, suite);
  BareSocket udp(udp_echo, nullptr, wait, std::nullopt);
  LocalTime now = clock::now();
  for (;;) {
    const int job = orders.job.load(std::memory_order_acquire);
    orders.at_work.store(job, std::memory_order_release);
    if (job == Orders::kQuit) return;
    if (job == Orders::kEcho || job == Orders::kSealedEcho || job == Orders::kUdpEcho) {
      BareSocket& socket = job == Orders::kEcho ? bare : job == Orders::kSealedEcho ? sealed : udp;
      if (socket.receive()) socket.send(static_cast<std::size_t>(orders.echo_bytes.load(std::memory_order_relaxed)));
    } else if (job == Orders::kTendon) {
      const LocalTime next = client.turn(now);
      now = clock::now();
      const LocalTime look_at_orders = std::min(next, now + milliseconds(1));
      if (wait == Wait::kBlocking) {
        if (now < next) transport.wait(look_at_orders - now);
        now = clock::now();
      } else {
        while (now < look_at_orders && !busy.look(now)) {
        }
      }
    } else {
      std::this_thread::sleep_for(microseconds(50));
    }
    if (job != Orders::kTendon) now = clock::now();
  }
}

struct Result {
  std::vector<double> bare;    ///< µs, one per exchange
  std::vector<double> sealed;  ///< like `bare`, but sealed by libsodium; only used with a suite
  std::vector<double> udp;     ///< like `bare`, but over UDP; only used for Unix sockets
  std::vector<double> tendon;
  std::size_t state_bytes = 0;
  std::size_t force_bytes = 0;
};

double us(Duration d) { return 1e6 * seconds(d); }

class RoundTrip {
 public:
  /// Without a `suite` datagrams are not encrypted; a Unix socket never has one.
  RoundTrip(const Options& options, Wait wait, Way way, std::optional<Suite> suite)
      : options_(options), wait_(wait), way_(way), suite_(suite), key_(Ratchet(3).next()) {
    NetworkLoop::Config config;
    config.devices = {{.about = {.name = "bench", .model = "bench", .max_force = 10, .loop_hz = 1000, .channels = {{}}},
                       .mail = &mail_}};
    if (suite) {
      config.keys = {{.name = "wall", .role = Role::kController, .key = key_}};
      config.suites = {*suite};
    }
    network_.emplace(config, watched_, clock::now());
    void* const shared = ::mmap(nullptr, sizeof(Orders), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED) fail("mmap");
    orders_ = new (shared) Orders;
    const ServerName server = file_ ? ServerName("unix:" + file_->string()) : ServerName(link_.local_address());
    child_ = ::fork();
    if (child_ < 0) fail("fork");
    if (child_ == 0) {
      end_with_parent();
      try {
        const AtPriority high(options.priority);
        serve(*orders_, server, bare_.client(), udp_.client(), wait, suite ? std::optional(key_) : std::nullopt, suite,
              options.reply_delay);
        ::_exit(0);
      } catch (const std::exception& error) {
        std::fprintf(stderr, "tendon-lab bench: client: %s\n", error.what());
        ::_exit(1);
      }
    }
  }
  ~RoundTrip() {
    orders_->job = Orders::kQuit;
    ::waitpid(child_, nullptr, 0);
    ::munmap(orders_, sizeof(Orders));
  }
  RoundTrip(const RoundTrip&) = delete;
  RoundTrip& operator=(const RoundTrip&) = delete;

  Result run() {
    order(Orders::kTendon);
    exchange();  // completes the handshake
    for (int i = 0; i < options_.warm_up; ++i) exchange();
    Result result;
    for (int block = 0; block < options_.blocks; ++block) {
      orders_->echo_bytes = static_cast<int>(force_bytes_);
      ping_pong(Orders::kEcho, result.bare);
      if (suite_) ping_pong(Orders::kSealedEcho, result.sealed);
      if (way_ == Way::kUnix) ping_pong(Orders::kUdpEcho, result.udp);
      order(Orders::kTendon);
      for (int i = -options_.warm_up; i < options_.exchanges; ++i) {
        const Duration took = exchange();
        if (i >= 0) result.tendon.push_back(us(took));
      }
    }
    result.state_bytes = state_bytes_;
    result.force_bytes = force_bytes_;
    return result;
  }

  /// For tendon_echo_client. The first call also connects.
  void request_reply() {
    if (orders_->at_work.load(std::memory_order_acquire) != Orders::kTendon) order(Orders::kTendon);
    exchange();
  }

 private:
  static void check(LocalTime began) {
    if (clock::now() - began > kGiveUp) throw std::runtime_error("the client process does not answer");
  }

  void ping_pong(Orders::Job job, std::vector<double>& times) {
    const BarePair& pair = job == Orders::kUdpEcho ? udp_ : bare_;
    BareSocket socket(pair.server(), &pair.client_name(), wait_, job == Orders::kSealedEcho ? suite_ : std::nullopt);
    order(job);
    for (int i = -options_.warm_up; i < options_.exchanges; ++i) {
      const LocalTime began = clock::now();
      socket.send(state_bytes_);
      while (!socket.receive()) check(began);
      if (i >= 0) times.push_back(us(clock::now() - began));
    }
  }

  void order(Orders::Job job) {
    orders_->job.store(job, std::memory_order_release);
    const LocalTime began = clock::now();
    while (orders_->at_work.load(std::memory_order_acquire) != job) {
      check(began);
      std::this_thread::sleep_for(microseconds(20));
    }
  }

  /// Posts a state and runs the network loop until the answering force is in the mailbox. Returns the elapsed time.
  Duration exchange() {
    DeviceState state;
    state.tick = ++tick_;
    state.position = Vec3(0.0123, -0.0456, 0.0789);
    state.velocity = Vec3(0.1, -0.2, 0.3);
    state.force_applied = Vec3(-1.5, 2.5, 0.25);
    state.energy = 0.0123;
    state.permitted_force = 3.4;
    state.force_sequence = tick_;
    state.force_age = milliseconds(7);
    state.mode = Mode::kActive;
    const LocalTime began = clock::now();
    state.sampled = PeerTime(began.time_since_epoch());
    mail_.state.put(state);
    network_->turn(began);
    for (LocalTime put = began;;) {
      LocalTime now = clock::now();
      if (wait_ == Wait::kBlocking) {
        link_.wait(milliseconds(1));
        now = clock::now();
      } else {
        for (const LocalTime end = now + milliseconds(1); now < end && !busy_.look(now);) {
        }
      }
      network_->turn(now);
      watched_.look();
      if (watched_.answered_tick == tick_) {
        see_sizes();
        return watched_.seen - began;
      }
      check(began);
      if (now - put > milliseconds(200)) {
        put = now;
        state.tick = ++tick_;
        mail_.state.put(state);
      }
    }
  }

  void see_sizes() {
    while (const DatagramRecord* record = mail_.datagrams.front()) {
      (record->direction == DatagramRecord::Direction::kOut ? state_bytes_ : force_bytes_) = record->size;
      mail_.datagrams.pop();
    }
  }

  Options options_;
  Wait wait_;
  Way way_;
  std::optional<Suite> suite_;
  Key key_;
  std::optional<std::filesystem::path> file_ =
      way_ == Way::kUnix ? std::optional(std::filesystem::temp_directory_path() /
                                         ("tendon-bench-" + std::to_string(::getpid()) + ".sock"))
                         : std::nullopt;
  Mailboxes mail_{{.steps = 16, .flight = 16, .datagrams = 1024}};
  UdpLink link_{parse_address("127.0.0.1:0"), Reach::kThisMachine, file_};
  BusyLink busy_{link_};
  WatchedLink watched_{wait_ == Wait::kBusy ? static_cast<Link&>(busy_) : link_, mail_};
  std::optional<NetworkLoop> network_;
  BarePair bare_{way_};
  BarePair udp_{Way::kUdp};
  Orders* orders_ = nullptr;
  pid_t child_ = 0;
  std::uint64_t tick_ = 0;
  std::size_t state_bytes_ = 0;
  std::size_t force_bytes_ = 0;
};

class TendonClient : public EchoClient {
 public:
  TendonClient(const Options& options, std::optional<Suite> suite)
      : round_trip_(options, Wait::kBlocking, Way::kUdp, suite) {}
  bool request_reply() override {
    round_trip_.request_reply();
    return true;
  }

 private:
  RoundTrip round_trip_;
};

}  // namespace

std::unique_ptr<EchoClient> tendon_echo_client(std::optional<Suite> suite, Duration reply_delay, int priority) {
  return std::make_unique<TendonClient>(Options{.priority = priority, .reply_delay = reply_delay}, suite);
}

void measure_round_trip(Run& run) {
  Options options;
  if (run.options.quick) options = {.blocks = 1, .exchanges = 20, .warm_up = 1};
  options.priority = run.options.priority;
  struct Kind {
    Wait wait;
    Way way;
    std::optional<Suite> suite;
    double goal;
    const char* words;
  };
  std::vector<Kind> kinds;
  for (const Wait wait : {Wait::kBusy, Wait::kBlocking}) {
    const bool busy = wait == Wait::kBusy;
    kinds.push_back(
        {wait, Way::kUdp, std::nullopt, busy ? 1.10 : 1.05, busy ? "≤ 1.10 × the floor" : "≤ 1.05 × the floor"});
    kinds.push_back({wait, Way::kUnix, std::nullopt, 0, ""});
    for (const Suite suite : {Suite::kNoise, Suite::kAesGcm}) {
      if (!contains(suites_of_this_machine(), suite)) continue;
      kinds.push_back({wait, Way::kUdp, suite, busy ? 1.25 : 1.08, busy ? "≤ 1.25 × the floor" : "≤ 1.08 × the floor"});
    }
  }
  for (const auto& [wait, way, suite, goal, words] : kinds) {
    RoundTrip round_trip(options, wait, way, suite);  // must fork before the priority is changed
    const AtPriority high(options.priority);
    const Result r = round_trip.run();
    const double ratio = quantile(r.tendon, 0.5) / quantile(r.bare, 0.5);
    Row row{.section = {},
            .what = std::string("state → force, ") + (wait == Wait::kBusy ? "busy-polling" : "blocking") +
                    (way == Way::kUnix ? ", Unix socket" : "") + (suite ? ", sealed by " + names_of({*suite}) : ""),
            .unit = "µs",
            .n = r.tendon.size(),
            .p50 = quantile(r.tendon, 0.5),
            .p99 = quantile(r.tendon, 0.99),
            .floor =
                "a bare ping-pong of " + std::to_string(r.state_bytes) + "/" + std::to_string(r.force_bytes) + " bytes",
            .floor_p50 = quantile(r.bare, 0.5),
            .floor_p99 = quantile(r.bare, 0.99),
            .ratio = ratio,
            .target = way == Way::kUdp ? std::optional(Row::Target{words, ratio <= goal}) : std::nullopt,
            .note = {}};
    if (way == Way::kUnix) {
      char note[120];
      const double udp = quantile(r.udp, 0.5);
      std::snprintf(note, sizeof note, "a bare ping-pong over UDP: %.1f; to that %.2f", udp, row.p50 / udp);
      row.note = note;
    }
    if (suite) {
      char note[120];
      const double bare = quantile(r.sealed, 0.5);
      std::snprintf(note, sizeof note, "a ping-pong that libsodium seals and opens: %.1f; to that %.2f", bare,
                    row.p50 / bare);
      row.note = note;
    }
    run.add(row);
  }
}

}  // namespace tendon::bench
