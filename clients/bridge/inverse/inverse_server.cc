// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/inverse/inverse_server.h"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <deque>
#include <list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "clients/cpp/web/http_server.h"
#include "clients/cpp/web/origin.h"

namespace tendon::bridge {
namespace {

constexpr std::size_t kMostInOneTurn = 256;
constexpr int kMostHostTurns = 4;
constexpr Duration kLongestSleep = std::chrono::milliseconds(100);  ///< maximum sleep, to notice timeouts
/// A WebSocket that is silent for this time gets a ping, and is closed if it does not answer.
constexpr Duration kSilence = std::chrono::seconds(30);
/// The maximum number of connections without a complete request. Further connections are closed immediately.
constexpr std::size_t kMostWaiting = 16;

/// A socket of the BridgeHost.
struct WatchedSocket {
  std::uint64_t number = 0;  ///< 1, 2, 3 …; lets handlers of a closed socket detect that it was replaced
  ino_t id = 0;              ///< inode; unlike descriptor numbers, it is not reused immediately
  std::optional<web::Watch> own{};
  bool waits = false;
};

ino_t socket_id(int descriptor) {
  struct stat what {};
  return ::fstat(descriptor, &what) == 0 ? what.st_ino : 0;
}

class InverseConnection;

struct InverseShared {
  const InverseServer::Config& config;
  BridgeHost& host;
  InverseServer::Clock clock;
  std::vector<InverseDevice> devices{};
  InverseCounts counts{};
  std::list<std::unique_ptr<InverseConnection>> connections{};
  std::size_t clients = 0;  ///< connections with a session
  BridgedDevice::Program newest = 0;
  bool full_said = false;
  std::size_t read = 0;              ///< messages waiting for the turn
  std::function<void()> read_one{};  ///< called after a message was read
};

class InverseConnection : public web::HttpConnection {
 public:
  InverseConnection(InverseShared& shared, web::Incoming stream)
      : HttpConnection(std::move(stream), {.request_patience = shared.config.request_patience,
                                           .reply_patience = shared.config.request_patience}),
        shared_(shared) {}
  ~InverseConnection() override { close(); }

  bool has_session() const noexcept { return session_.has_value(); }
  InverseSession* session() noexcept { return session_ ? &*session_ : nullptr; }

  bool answer(LocalTime now) {
    if (closed() || inbox_.empty()) return false;
    for (std::string& reply : session_->answer(now, inbox_)) {
      unread_ += reply.size();
      outbox_.push_back(std::move(reply));
    }
    shared_.read -= inbox_.size();
    inbox_.clear();
    return true;
  }

  /// Writes replies, and continues reading unless too many replies are unread.
  void pump(LocalTime now) {
    if (!open()) return;
    if (!writing() && !outbox_.empty()) write(std::as_bytes(std::span(outbox_.front())), false);
    if (unread_ <= shared_.config.max_unread) {
      stuck_since_.reset();
      return read_next();
    }
    if (!stuck_since_) stuck_since_ = now;
    if (now - *stuck_since_ < shared_.config.patience) return;
    why_ = "no reply was read for " + std::to_string(shared_.config.patience / std::chrono::seconds(1)) + " s";
    close();
  }

 private:
  void take_request(const web::Request& request) override {
    if (request.refused != 0) return refuse("400 Bad Request", "expected a WebSocket request");
    if (!request.upgrade) {
      return refuse(
          "404 Not Found",
          "This address only serves a WebSocket with JSON for tendon-bridge inverse: use ws:// instead of http://");
    }
    if (request.origin && (request.repeated || !web::may_come_from(*request.origin, shared_.config.origins))) {
      return refuse("403 Forbidden", "pages from this origin are not accepted; see --origin of tendon-bridge inverse");
    }
    const std::string from = peer() ? to_string(*peer()) : std::string();
    if (shared_.clients >= shared_.config.max_clients) {
      const std::string words = std::to_string(shared_.clients) + " clients are already connected";
      if (!std::exchange(shared_.full_said, true))
        shared_.host.say("another client from " + from + " was refused: " + words);
      return refuse("503 Service Unavailable", words);
    }
    program_ = ++shared_.newest;
    session_.emplace(program_, shared_.devices, shared_.counts, shared_.clock());
    ++shared_.clients;
    shared_.host.say("client " + std::to_string(program_) + " connected from " + from);
    // The kernel must not buffer more replies than we do.
    accept({.patience = shared_.config.request_patience,
            .silence = kSilence,
            .max_message = kLongestMessage,
            .send_buffer_size = static_cast<int>(shared_.config.max_unread)});
  }

  void refuse(std::string_view status, std::string_view words) {
    reply("HTTP/1.1 " + std::string(status) +
              "\r\nContent-Type: text/plain; charset=utf-8\r\nX-Content-Type-Options: nosniff\r\nConnection: close\r\n"
              "Content-Length: " +
              std::to_string(words.size() + 1) + "\r\n\r\n" + std::string(words) + "\n",
          Then::kLinger);
  }

  void opened() override {
    const LocalTime now = shared_.clock();
    outbox_.push_back(session_->greeting(now));
    unread_ += outbox_.back().size();
    pump(now);
  }

  void read_next() {
    if (inbox_.size() < InverseServer::kMostMessages) read_message();
  }

  void take_message(std::span<const std::byte> message, bool) override {
    inbox_.emplace_back(reinterpret_cast<const char*>(message.data()), message.size());
    ++shared_.read;
    if (shared_.read < kMostInOneTurn) read_next();
    shared_.read_one();
  }

  void written() override {
    unread_ -= outbox_.front().size();
    outbox_.pop_front();
    pump(shared_.clock());
  }

  void closing() override {
    shared_.read -= inbox_.size();
    inbox_.clear();
    if (!session_) return;
    if (too_long()) why_ = "a message was longer than 64 kB";
    session_.reset();
    --shared_.clients;
    shared_.full_said = false;
    shared_.host.say("client " + std::to_string(program_) + " left" + (why_.empty() ? "" : ": " + why_));
  }

  void gone() override {
    std::erase_if(shared_.connections, [this](const auto& one) { return one.get() == this; });
  }

  InverseShared& shared_;
  BridgedDevice::Program program_ = 0;
  std::optional<InverseSession> session_;
  std::vector<std::string> inbox_;  ///< read, to be answered in the next turn
  std::deque<std::string> outbox_;  ///< the first reply is being written
  std::size_t unread_ = 0;          ///< bytes in outbox_
  std::optional<LocalTime> stuck_since_;
  std::string why_;
};

}  // namespace

struct InverseServer::State {
  State(Config own, BridgeHost& host, Clock clock)
      : config(std::move(own)), server(config.listen), shared{.config = config, .host = host, .clock = clock} {
    std::vector<std::pair<std::string, BridgedDevice*>> all_bridged;
    for (std::size_t i = 0; i < host.size(); ++i) all_bridged.emplace_back(host.name(i), &host.device(i));
    shared.devices = inverse_devices(all_bridged);
    owners.resize(host.size());
    shared.read_one = [this] { schedule_answers(); };
  }

  void take(web::Incoming stream) {
    if (shared.connections.size() >= shared.clients + kMostWaiting) return;
    shared.connections.push_back(std::make_unique<InverseConnection>(shared, std::move(stream)));
    shared.connections.back()->read_request();
  }

  void schedule_answers() {
    if (std::exchange(answers_due, true)) return;
    read_before = shared.read;
    server.post([this] {
      answers_due = false;
      if (shared.read > read_before && shared.read < kMostInOneTurn) return schedule_answers();
      turn();
    });
  }

  /// Calls the BridgeHost until no work is due. A force computed in one turn is sent in the next.
  LocalTime turn_host() {
    const InverseCounts& counts = shared.counts;
    const std::array<BridgeHost::Count, 6> all = {{{"clients", shared.clients},
                                                   {"messages", counts.messages},
                                                   {"skipped", counts.skipped},
                                                   {"unread", counts.unread},
                                                   {"refused", counts.refused},
                                                   {"ignored", counts.ignored}}};
    const auto until_nothing_is_due = [&] {
      LocalTime next{};
      for (int i = 0; i < kMostHostTurns; ++i) {
        const LocalTime now = shared.clock();
        if (i > 0 && next > now) break;
        next = shared.host.turn(now, all);
      }
      return next;
    };
    const LocalTime next = until_nothing_is_due();
    const LocalTime now = shared.clock();
    bool pushed = false;
    for (const auto& connection : shared.connections) {
      if (connection->has_session()) pushed |= connection->session()->see(now);
    }
    return pushed ? until_nothing_is_due() : next;
  }

  void turn() {
    LocalTime next = turn_host();
    const LocalTime now = shared.clock();
    bool answered = false;
    for (const auto& connection : shared.connections) answered |= connection->answer(now);
    if (answered) next = turn_host();
    for (const auto& connection : shared.connections) {
      connection->pump(now);
      if (connection->has_session()) next = std::min(next, connection->session()->due());
    }
    std::erase_if(shared.connections, [](const auto& one) { return one->done(); });
    say_owners();
    watch();
    wake_at(std::min(next, now + kLongestSleep), now);
  }

  /// A timer that is set too early does no harm: its turn sets the next one.
  void wake_at(LocalTime at, LocalTime now) {
    if (wakes_at && *wakes_at <= at) return;
    wakes_at = at;
    timer = server.after(at - now, [this] {
      wakes_at.reset();
      turn();
    });
  }

  void say_owners() {
    for (std::size_t i = 0; i < owners.size(); ++i) {
      const BridgedDevice::Program owner = shared.host.device(i).owner();
      if (std::exchange(owners[i], owner) == owner) continue;
      shared.host.say(shared.host.name(i) + ": " +
                      (owner == 0 ? "no client requests a force any more"
                                  : "client " + std::to_string(owner) + " controls the force"));
    }
  }

  /// The sockets of the BridgeHost may change after a name lookup. This only happens while a device has no session.
  void watch() {
    bool lost = false;
    for (std::size_t i = 0; i < shared.host.size(); ++i) lost = lost || shared.host.device(i).lost();
    const bool may_differ = std::exchange(was_lost, lost) || lost;
    const std::vector<int> descriptors = shared.host.descriptors();
    watched.resize(descriptors.size());
    for (std::size_t i = 0; i < descriptors.size(); ++i) {
      WatchedSocket& socket = watched[i];
      if (const ino_t id = may_differ ? socket_id(descriptors[i]) : socket.id; socket.id != id) {
        socket.number = ++newest_socket;
        socket.id = id;
        socket.own.emplace(server, descriptors[i]);
        socket.waits = false;
      }
      if (std::exchange(socket.waits, true)) continue;
      socket.own->wait([this, &socket, number = socket.number](bool readable) {
        if (!readable || socket.number != number) return;
        socket.waits = false;
        turn();
      });
    }
  }

  Config config;
  web::HttpServer server;
  InverseShared shared;
  web::Alarm timer;
  std::deque<WatchedSocket> watched;
  std::uint64_t newest_socket = 0;
  bool was_lost = true;
  std::optional<LocalTime> wakes_at;
  std::vector<BridgedDevice::Program> owners;
  bool answers_due = false;
  std::size_t read_before = 0;
};

InverseServer::InverseServer(Config config, BridgeHost& host, Clock clock)
    : state_(std::make_unique<State>(std::move(config), host, clock)) {}

InverseServer::~InverseServer() = default;

Address InverseServer::address() const { return state_->server.address(); }

const InverseCounts& InverseServer::counts() const noexcept { return state_->shared.counts; }

void InverseServer::run(Duration duration) {
  state_->turn();
  state_->server.run(duration, [this](web::Incoming stream) { state_->take(std::move(stream)); });
  for (const auto& connection : state_->shared.connections) connection->close();
}

}  // namespace tendon::bridge
