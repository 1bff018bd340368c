// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/inverse/inverse_server.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <csignal>
#include <deque>
#include <list>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "clients/cpp/web/origin.h"

namespace tendon::bridge {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kMostInOneTurn = 256;
constexpr int kMostHostTurns = 4;
constexpr Duration kLongestSleep = std::chrono::milliseconds(100);  ///< maximum sleep, to notice timeouts
/// A WebSocket that is silent for this time gets a ping, and is closed if it does not answer.
constexpr Duration kSilence = std::chrono::seconds(30);
/// The maximum number of connections without a complete request. Further connections are closed immediately.
constexpr std::size_t kMostWaiting = 16;
constexpr std::uint32_t kLongestRequest = 16 * 1024;
/// After a plain HTTP response, the connection is read up to these limits, because a reset would discard the response.
constexpr Duration kLinger = std::chrono::seconds(1);
constexpr std::size_t kMostLingered = 64 * 1024;

asio::ip::address ip_of(const Address& address) {
  const asio::ip::address_v6 v6(address.ip);
  if (v6.is_v4_mapped()) return asio::ip::make_address_v4(asio::ip::v4_mapped, v6);
  return v6;
}

Address address_of(const tcp::endpoint& endpoint) {
  const asio::ip::address ip = endpoint.address();
  const auto v6 = ip.is_v4() ? asio::ip::make_address_v6(asio::ip::v4_mapped, ip.to_v4()) : ip.to_v6();
  return {v6.to_bytes(), endpoint.port()};
}

auto waiting_time(Duration d) {
  return std::chrono::duration_cast<asio::steady_timer::duration>(std::max(d, Duration::zero()));
}

/// A socket of the BridgeHost, watched through a duplicated descriptor: the BridgeHost may close its own at any time.
struct WatchedSocket {
  std::uint64_t number = 0;  ///< 1, 2, 3 …; lets handlers of a closed socket detect that it was replaced
  ino_t id = 0;              ///< inode; unlike descriptor numbers, it is not reused immediately
  std::optional<asio::posix::stream_descriptor> own{};
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
  asio::io_context& context;
  std::vector<InverseDevice> devices{};
  InverseCounts counts{};
  std::list<std::unique_ptr<InverseConnection>> connections{};
  std::size_t clients = 0;  ///< connections with a session
  BridgedDevice::Program newest = 0;
  bool full_said = false;
  std::size_t read = 0;              ///< messages waiting for the turn
  std::function<void()> read_one{};  ///< called after a message was read
};

/// One connection. It is only deleted when it is closed and has no pending operations, so handlers can use `this`.
class InverseConnection {
 public:
  InverseConnection(InverseShared& shared, tcp::socket socket) : shared_(shared), stream_(std::move(socket)) {
    error_code gone;
    const tcp::endpoint peer = stream_.socket().remote_endpoint(gone);
    if (!gone) peer_ = to_string(address_of(peer));
    // Replies must not wait for acknowledgements, and the kernel must not buffer more than we do.
    stream_.socket().set_option(tcp::no_delay(true), gone);
    stream_.socket().set_option(asio::socket_base::send_buffer_size(static_cast<int>(shared_.config.max_unread)), gone);
  }
  ~InverseConnection() { close(); }
  InverseConnection(const InverseConnection&) = delete;
  InverseConnection& operator=(const InverseConnection&) = delete;

  void start() { read_request(); }
  bool done() const noexcept { return closed_ && pending_ == 0; }
  bool has_session() const noexcept { return session_.has_value(); }
  InverseSession* session() noexcept { return session_ ? &*session_ : nullptr; }

  void close() {
    if (std::exchange(closed_, true)) return;
    error_code gone;
    tcp::socket& socket = web_socket_ ? web_socket_->next_layer().socket() : stream_.socket();
    socket.shutdown(tcp::socket::shutdown_both, gone);
    socket.close(gone);
    shared_.read -= inbox_.size();
    inbox_.clear();
    if (!session_) return;
    session_.reset();
    --shared_.clients;
    shared_.full_said = false;
    shared_.host.say("client " + std::to_string(program_) + " left" + (why_.empty() ? "" : ": " + why_));
  }

  bool answer(LocalTime now) {
    if (closed_ || inbox_.empty()) return false;
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
    if (closed_ || !open_) return;
    write_message();
    if (unread_ <= shared_.config.max_unread) {
      stuck_since_.reset();
      return read_message();
    }
    if (!stuck_since_) stuck_since_ = now;
    if (now - *stuck_since_ < shared_.config.patience) return;
    why_ = "no reply was read for " + std::to_string(shared_.config.patience / std::chrono::seconds(1)) + " s";
    close();
  }

 private:
  template <class Handler>
  auto with(Handler handler) {
    ++pending_;
    return [this, handler = std::move(handler)](auto... results) mutable {
      --pending_;
      if (!closed_) handler(results...);
      if (!done()) return;
      auto& all = shared_.connections;
      all.erase(std::ranges::find(all, this, [](const auto& one) { return one.get(); }));
    };
  }

  void read_request() {
    parser_.emplace();
    parser_->header_limit(kLongestRequest);
    parser_->body_limit(0);
    stream_.expires_after(waiting_time(shared_.config.request_patience));
    http::async_read(stream_, request_buffer_, *parser_,
                     with([this](error_code error, std::size_t) { take_request(error); }));
  }

  void take_request(error_code error) {
    if (error == http::error::end_of_stream || error == beast::error::timeout ||
        error == asio::error::connection_reset) {
      return close();
    }
    if (error) return refuse("400 Bad Request", "expected a WebSocket request");
    const auto& message = parser_->get();
    if (!websocket::is_upgrade(message)) {
      return refuse(
          "404 Not Found",
          "This address only serves a WebSocket with JSON for tendon-bridge inverse: use ws:// instead of http://");
    }
    const auto origin = message.find(http::field::origin);
    if (origin != message.end() &&
        (message.count(http::field::origin) > 1 ||
         !web::may_come_from({origin->value().data(), origin->value().size()}, shared_.config.origins))) {
      return refuse("403 Forbidden", "pages from this origin are not accepted; see --origin of tendon-bridge inverse");
    }
    if (shared_.clients >= shared_.config.max_clients) {
      const std::string words = std::to_string(shared_.clients) + " clients are already connected";
      if (!std::exchange(shared_.full_said, true))
        shared_.host.say("another client from " + peer_ + " was refused: " + words);
      return refuse("503 Service Unavailable", words);
    }
    accept();
  }

  void refuse(std::string_view status, std::string_view words) {
    text_ = "HTTP/1.1 " + std::string(status) +
            "\r\nContent-Type: text/plain; charset=utf-8\r\nX-Content-Type-Options: nosniff\r\nConnection: close\r\n"
            "Content-Length: " +
            std::to_string(words.size() + 1) + "\r\n\r\n" + std::string(words) + "\n";
    stream_.expires_after(waiting_time(shared_.config.request_patience));
    asio::async_write(stream_, asio::buffer(text_), with([this](error_code error, std::size_t) {
                        if (error) return close();
                        error_code gone;
                        stream_.socket().shutdown(tcp::socket::shutdown_send, gone);
                        stream_.expires_after(waiting_time(kLinger));
                        text_.resize(kMostLingered);
                        asio::async_read(stream_, asio::buffer(text_),
                                         with([this](error_code, std::size_t) { close(); }));
                      }));
  }

  void accept() {
    program_ = ++shared_.newest;
    session_.emplace(program_, shared_.devices, shared_.counts, shared_.clock());
    ++shared_.clients;
    shared_.host.say("client " + std::to_string(program_) + " connected from " + peer_);
    stream_.expires_never();
    web_socket_.emplace(std::move(stream_));
    websocket::stream_base::timeout timeout{};
    timeout.handshake_timeout = waiting_time(shared_.config.request_patience);
    timeout.idle_timeout = waiting_time(kSilence);
    timeout.keep_alive_pings = true;
    web_socket_->set_option(timeout);
    web_socket_->read_message_max(kLongestMessage);
    web_socket_->text(true);
    web_socket_->async_accept(parser_->get(), with([this](error_code error) {
                                if (error) return close();
                                open_ = true;
                                const LocalTime now = shared_.clock();
                                outbox_.push_back(session_->greeting(now));
                                unread_ += outbox_.back().size();
                                pump(now);
                              }));
  }

  void read_message() {
    if (reading_ || inbox_.size() >= InverseServer::kMostMessages) return;
    reading_ = true;
    web_socket_->async_read(message_, with([this](error_code error, std::size_t) {
                              reading_ = false;
                              if (error) {
                                if (error == websocket::error::message_too_big)
                                  why_ = "a message was longer than 64 kB";
                                return close();
                              }
                              inbox_.emplace_back(static_cast<const char*>(message_.data().data()), message_.size());
                              message_.clear();
                              ++shared_.read;
                              if (shared_.read < kMostInOneTurn) read_message();
                              shared_.read_one();
                            }));
  }

  void write_message() {
    if (writing_ || outbox_.empty()) return;
    writing_ = true;
    web_socket_->async_write(asio::buffer(outbox_.front()), with([this](error_code error, std::size_t) {
                               writing_ = false;
                               if (error) return close();
                               unread_ -= outbox_.front().size();
                               outbox_.pop_front();
                               pump(shared_.clock());
                             }));
  }

  InverseShared& shared_;
  beast::tcp_stream stream_;
  std::string peer_;
  beast::flat_buffer request_buffer_{kLongestRequest};
  std::optional<http::request_parser<http::empty_body>> parser_;
  std::string text_;

  BridgedDevice::Program program_ = 0;
  std::optional<InverseSession> session_;
  std::optional<websocket::stream<beast::tcp_stream>> web_socket_;
  beast::flat_buffer message_;
  std::vector<std::string> inbox_;  ///< read, to be answered in the next turn
  std::deque<std::string> outbox_;  ///< the first reply is being written
  std::size_t unread_ = 0;          ///< bytes in outbox_
  std::optional<LocalTime> stuck_since_;
  std::string why_;
  bool open_ = false;
  bool reading_ = false;
  bool writing_ = false;

  int pending_ = 0;
  bool closed_ = false;
};

}  // namespace

struct InverseServer::State {
  State(Config own, BridgeHost& host, Clock clock)
      : config(std::move(own)), shared{.config = config, .host = host, .clock = clock, .context = context} {
    const tcp::endpoint at(ip_of(config.listen), config.listen.port);
    error_code error;
    acceptor.open(at.protocol(), error);
    if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error) acceptor.bind(at, error);
    if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
    if (error) throw std::runtime_error("cannot listen on " + to_string(config.listen) + ": " + error.message());
    std::vector<std::pair<std::string, BridgedDevice*>> all_bridged;
    for (std::size_t i = 0; i < host.size(); ++i) all_bridged.emplace_back(host.name(i), &host.device(i));
    shared.devices = inverse_devices(all_bridged);
    owners.resize(host.size());
    shared.read_one = [this] { schedule_answers(); };
  }

  void accept() {
    acceptor.async_accept([this](error_code error, tcp::socket socket) {
      if (error) {  // no descriptors left: retry later
        accept_again.expires_after(waiting_time(kLongestSleep));
        return accept_again.async_wait([this](error_code) { accept(); });
      }
      if (shared.connections.size() < shared.clients + kMostWaiting) {
        shared.connections.push_back(std::make_unique<InverseConnection>(shared, std::move(socket)));
        shared.connections.back()->start();
      }
      accept();
    });
  }

  void schedule_answers() {
    if (std::exchange(answers_due, true)) return;
    read_before = shared.read;
    asio::post(context, [this] {
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
    timer.expires_after(waiting_time(at - now));
    timer.async_wait([this](error_code cancelled) {
      if (cancelled) return;
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
        socket.own.emplace(context, ::dup(descriptors[i]));
        socket.waits = false;
      }
      if (std::exchange(socket.waits, true)) continue;
      socket.own->async_wait(asio::posix::stream_descriptor::wait_read,
                             [this, &socket, number = socket.number](error_code error) {
                               if (error || socket.number != number) return;
                               socket.waits = false;
                               turn();
                             });
    }
  }

  Config config;
  asio::io_context context{1};
  InverseShared shared;
  tcp::acceptor acceptor{context};
  asio::steady_timer timer{context};
  asio::steady_timer accept_again{context};
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

Address InverseServer::address() const { return address_of(state_->acceptor.local_endpoint()); }

const InverseCounts& InverseServer::counts() const noexcept { return state_->shared.counts; }

void InverseServer::run(Duration duration) {
  asio::io_context& context = state_->context;
  asio::signal_set signals(context, SIGINT, SIGTERM);
  signals.async_wait([&](error_code, int) { context.stop(); });
  asio::steady_timer end(context);
  if (duration > Duration::zero()) {
    end.expires_after(waiting_time(duration));
    end.async_wait([&](error_code) { context.stop(); });
  }
  state_->accept();
  state_->turn();
  context.run();
  for (const auto& connection : state_->shared.connections) connection->close();
}

}  // namespace tendon::bridge
