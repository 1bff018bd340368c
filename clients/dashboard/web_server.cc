// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/web_server.h"

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/udp.hpp>
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
#include <list>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "clients/dashboard/server_socket.h"

namespace tendon::dash {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;

/// Datagrams are read in batches. Otherwise tendon-dash would wake up 1000 times per second on the processors of the
/// haptic loop. The measured round trip includes this delay, but is not used in computations.
constexpr Duration kGather = std::chrono::milliseconds(3);
constexpr int kMaxDrained = 64;  ///< maximum number of datagrams read from one bridge socket in a row
constexpr std::size_t kPiece = 64 * 1024;
/// The maximum number of connections that are being refused. Further connections are closed without a reply.
constexpr std::size_t kMaxRefusals = 64;
/// A refused connection is read for this time and number of bytes, because a reset would discard the reply.
constexpr Duration kLinger = std::chrono::seconds(1);
constexpr std::size_t kMaxLingered = 64 * 1024;
constexpr std::size_t kMaxLine = 64;          ///< longest message of a page: "watch 15"
constexpr std::size_t kMaxOrder = 16 * 1024;  ///< longest message of a viewer: it subscribes to all of 16 devices
/// Kernel buffer for a viewer that does not read, in addition to FoxgloveSession::kMaxBytes. Linux doubles this
/// value.
constexpr int kViewerSendBuffer = 128 * 1024;

/// All addresses of an IPv6 /64 network count as one, because a machine can easily use many of them.
std::array<std::uint8_t, 16> network_of(const Address& address) {
  auto ip = address.ip;
  if (!is_ipv4(address)) std::fill(ip.begin() + 8, ip.end(), std::uint8_t{0});
  return ip;
}

auto waiting_time(Duration d) {
  return std::chrono::duration_cast<asio::steady_timer::duration>(std::max(d, Duration::zero()));
}

Bytes bytes_of(const beast::flat_buffer& buffer) {
  return {static_cast<const std::byte*>(buffer.data().data()), buffer.data().size()};
}

class Connection;

struct Shared {
  const WebServer::Config& config;
  const Routes& routes;
  Feed& feed;
  FoxgloveFeed& foxglove;
  WebCounts& counts;
  BridgeCounts& bridge;
  WebServer::Clock clock;
  asio::io_context context{1};
  std::list<std::unique_ptr<Connection>> connections;
  const ServerSocket* link = nullptr;  ///< of the Observer
};

/// A browser connection for HTTP requests or a WebSocket.
///
/// Deleted only after it is closed and has no pending operations (`pending_`), so that handlers can use `this`.
class Connection {
 public:
  Connection(Shared& shared, tcp::socket socket)
      : shared_(shared), stream_(std::move(socket)), request_buffer_(shared.config.max_request) {
    error_code gone;
    const tcp::endpoint peer = stream_.socket().remote_endpoint(gone);
    if (!gone) network_ = network_of(address_of(peer));
    local_ = !gone && is_loopback(address_of(peer));
    // A batch of states must not wait for the acknowledgement of the previous one.
    stream_.socket().set_option(tcp::no_delay(true), gone);
  }
  ~Connection() {
    if (page_) shared_.feed.leave(*page_);
    if (viewer_) shared_.foxglove.leave(*viewer_);
    if (gate_) --shared_.bridge.pages;
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void start() { read_request(); }
  void refuse() {
    refused_ = true;
    write_reply(Routes::plain(503, "too many connections"));
  }
  bool refused() const noexcept { return refused_; }
  bool closed() const noexcept { return closed_; }
  const std::array<std::uint8_t, 16>& network() const noexcept { return network_; }
  LocalTime waits_since() const noexcept { return waits_since_; }
  bool done() const noexcept { return closed_ && pending_ == 0; }

  void close() {
    if (std::exchange(closed_, true)) return;
    error_code gone;
    tcp::socket& socket = web_socket_ ? web_socket_->next_layer().socket() : stream_.socket();
    socket.shutdown(tcp::socket::shutdown_both, gone);
    socket.close(gone);
    server_.reset();
  }

  void pump() {
    if (closed_ || !web_socket_ || !open_ || std::exchange(writing_, true)) return;
    if (page_) {
      if (auto text = shared_.feed.next(*page_)) {
        text_ = std::move(*text);
        web_socket_->text(true);
        return write_message(asio::buffer(text_));
      }
    } else if (viewer_) {
      if (auto message = shared_.foxglove.next(*viewer_)) {
        text_ = std::move(message->bytes);
        web_socket_->binary(message->binary);
        return write_message(asio::buffer(text_));
      }
    } else if (auto datagram = gate_->next()) {
      datagram_ = std::move(*datagram);
      web_socket_->binary(true);
      return write_message(asio::buffer(datagram_.data(), datagram_.size()));
    }
    writing_ = false;
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
    parser_->header_limit(static_cast<std::uint32_t>(shared_.config.max_request));
    parser_->body_limit(0);
    waits_since_ = shared_.clock();
    stream_.expires_after(waiting_time(shared_.config.request_patience));
    http::async_read(stream_, request_buffer_, *parser_,
                     with([this](error_code error, std::size_t) { take_request(error); }));
  }

  void take_request(error_code error) {
    waits_since_ = LocalTime::max();
    if (error == http::error::end_of_stream || error == beast::error::timeout ||
        error == asio::error::connection_reset) {
      return close();
    }
    ++shared_.counts.requests;
    keep_alive_ = false;
    with_body_ = true;
    if (error == http::error::header_limit || error == http::error::buffer_overflow) {
      return write_reply(Routes::plain(431, "the request is too long"));
    }
    if (error == http::error::body_limit) return write_reply(Routes::plain(413, "expected a request without content"));
    if (error) return write_reply(Routes::plain(400, "not a valid HTTP request"));
    const auto& message = parser_->get();
    const auto header = [&](http::field field) -> std::optional<std::string_view> {
      const auto found = message.find(field);
      if (found == message.end()) return std::nullopt;
      return std::string_view(found->value().data(), found->value().size());
    };
    if (message.count(http::field::host) > 1 || message.count(http::field::origin) > 1 ||
        message.count(http::field::authorization) > 1) {
      return write_reply(Routes::plain(400, "expected at most one Host, one Origin and one Authorization"));
    }
    Request request;
    request.method = {message.method_string().data(), message.method_string().size()};
    request.target = {message.target().data(), message.target().size()};
    request.host = header(http::field::host);
    request.origin = header(http::field::origin);
    request.authorization = header(http::field::authorization);
    request.range = header(http::field::range);
    request.accept_encoding = header(http::field::accept_encoding).value_or("");
    request.upgrade = websocket::is_upgrade(message);
    const auto [first, last] = message.equal_range(http::field::sec_websocket_protocol);
    for (auto one = first; one != last; ++one) request.protocols += std::string(one->value()) + ",";
    request.local = local_;
    request.proxied = header(http::field::forwarded) || header(http::field::via) ||
                      message.count("X-Forwarded-For") > 0 || message.count("X-Real-IP") > 0;
    keep_alive_ = message.keep_alive();
    with_body_ = request.method != "HEAD";
    Answer answer = shared_.routes.answer(request);
    if (auto* reply = std::get_if<Reply>(&answer)) {
      if (reply->status == 403 && request.target.starts_with("/bridge")) ++shared_.bridge.refused_origin;
      write_reply(std::move(*reply));
    } else if (std::holds_alternative<LiveSocket>(answer)) {
      if (shared_.feed.pages() >= shared_.config.max_pages) {
        return write_reply(Routes::plain(503, "too many pages are already connected"));
      }
      page_ = shared_.feed.join(shared_.clock());
      accept(Side::kPage);
    } else if (const auto* viewer = std::get_if<FoxgloveSocket>(&answer)) {
      if (shared_.foxglove.clients() >= shared_.config.max_viewers) {
        return write_reply(Routes::plain(503, "too many viewers are already connected"));
      }
      viewer_ = shared_.foxglove.join(shared_.clock());
      accept(Side::kViewer, viewer->protocol);
    } else {
      if (shared_.bridge.pages >= shared_.config.max_bridges) {
        ++shared_.bridge.refused_full;
        return write_reply(Routes::plain(503, "too many pages are already connected to the bridge"));
      }
      ++shared_.bridge.pages;
      ++shared_.bridge.opened;
      gate_.emplace(shared_.config.bridge, std::get<BridgeSocket>(answer).local, shared_.bridge, shared_.clock());
      accept(Side::kBridge);
    }
  }

  void write_reply(Reply reply) {
    if (reply.status >= 400 && reply.status != 404 && reply.status != 416) ++shared_.counts.refused;
    reply_ = std::move(reply);
    text_ = reply_.head(keep_alive_);
    sent_ = 0;
    if (with_body_) {
      if (const auto* text = std::get_if<std::string>(&reply_.body)) text_ += *text;
      if (const auto* text = std::get_if<std::string_view>(&reply_.body)) text_ += *text;
    }
    write_piece();
  }

  void write_piece() {
    stream_.expires_after(waiting_time(shared_.config.patience));
    asio::async_write(stream_, asio::buffer(text_), with([this](error_code error, std::size_t) {
                        const auto* file = std::get_if<Reply::Slice>(&reply_.body);
                        if (error) return close();
                        if (file != nullptr && with_body_ && sent_ < file->range.count) {
                          const std::uint64_t left = file->range.count - sent_;
                          text_ = file->file.read(file->range.first + sent_, std::min<std::uint64_t>(left, kPiece));
                          if (text_.empty())
                            return close();  // the file was truncated; the browser detects missing bytes
                          sent_ += text_.size();
                          return write_piece();
                        }
                        reply_.body = std::string();  // closes the file
                        if (keep_alive_) return read_request();
                        if (refused_) return linger();
                        close();
                      }));
  }

  void linger() {
    error_code gone;
    stream_.socket().shutdown(tcp::socket::shutdown_send, gone);
    stream_.expires_after(waiting_time(kLinger));
    text_.resize(kMaxLingered);
    asio::async_read(stream_, asio::buffer(text_), with([this](error_code, std::size_t) { close(); }));
  }

  enum class Side : std::uint8_t { kPage, kViewer, kBridge };

  void accept(Side side, const std::string& protocol = {}) {
    stream_.expires_never();
    if (side == Side::kViewer) {
      error_code gone;
      stream_.socket().set_option(asio::socket_base::send_buffer_size(kViewerSendBuffer), gone);
    }
    web_socket_.emplace(std::move(stream_));
    websocket::stream_base::timeout timeout{};
    timeout.handshake_timeout = waiting_time(shared_.config.patience);
    timeout.idle_timeout = waiting_time(shared_.config.patience);
    timeout.keep_alive_pings = side != Side::kBridge;
    web_socket_->set_option(timeout);
    web_socket_->read_message_max(side == Side::kPage ? kMaxLine : side == Side::kViewer ? kMaxOrder : kMaxDatagram);
    if (!protocol.empty()) {
      web_socket_->set_option(websocket::stream_base::decorator([protocol](websocket::response_type& response) {
        response.set(http::field::sec_websocket_protocol, protocol);
      }));
    }
    if (side == Side::kBridge) {
      try {
        server_ = std::make_unique<ServerSocket>(shared_.context, shared_.link->server(), shared_.clock);
      } catch (const std::runtime_error&) {
        return close();
      }
    }
    web_socket_->async_accept(parser_->get(), with([this](error_code error) {
                                if (error) return close();
                                open_ = true;
                                read_message();
                                if (gate_) read_server();
                                pump();
                              }));
  }

  void read_message() {
    message_.clear();
    web_socket_->async_read(
        message_, with([this](error_code error, std::size_t) {
          if (error) return close();
          const LocalTime now = shared_.clock();
          const Bytes bytes = bytes_of(message_);
          if (gate_) {
            if (gate_->passes(now, bytes, web_socket_->got_binary())) server_->send(bytes);
          } else {
            const std::string_view text(static_cast<const char*>(message_.data().data()), message_.data().size());
            const bool heard = !web_socket_->got_binary() && (viewer_ ? shared_.foxglove.receive(now, *viewer_, text)
                                                                      : shared_.feed.receive(now, *page_, text));
            if (!heard) return close();
            pump();
          }
          read_message();
        }));
  }

  void write_message(asio::const_buffer bytes) {
    web_socket_->async_write(bytes, with([this](error_code error, std::size_t) {
                               writing_ = false;
                               if (error) return close();
                               pump();
                             }));
  }

  void read_server() {
    server_->when_readable(with([this](error_code error) {
      if (error) return close();
      std::array<std::byte, kMaxDatagram> buffer;
      Address from;
      for (int i = 0; i < kMaxDrained; ++i) {
        const std::size_t size = server_->receive(from, buffer);
        if (size == 0) break;
        if (size <= buffer.size()) gate_->offer(Bytes(buffer).first(size));
      }
      pump();
      read_server();
    }));
  }

  Shared& shared_;
  beast::tcp_stream stream_;
  beast::flat_buffer request_buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
  std::array<std::uint8_t, 16> network_{};
  LocalTime waits_since_ = LocalTime::max();
  bool refused_ = false;
  bool local_ = false;
  bool keep_alive_ = false;
  bool with_body_ = true;
  Reply reply_;
  std::string text_;
  std::uint64_t sent_ = 0;  ///< bytes of the file

  std::optional<websocket::stream<beast::tcp_stream>> web_socket_;
  beast::flat_buffer message_;
  std::optional<Feed::PageId> page_;
  std::optional<FoxgloveFeed::ClientId> viewer_;
  std::optional<BridgeGate> gate_;
  std::unique_ptr<ServerSocket> server_;
  std::vector<std::byte> datagram_;
  bool open_ = false;
  bool writing_ = false;

  int pending_ = 0;
  bool closed_ = false;
};

}  // namespace

struct WebServer::State {
  State(const Config& own, const Routes& routes, Feed& feed, FoxgloveFeed& foxglove, WebCounts& counts,
        BridgeCounts& bridge, Clock clock)
      : config(own),
        shared{.config = config,
               .routes = routes,
               .feed = feed,
               .foxglove = foxglove,
               .counts = counts,
               .bridge = bridge,
               .clock = clock,
               .connections = {}},
        link(shared.context, config.server, clock) {
    shared.link = &link;
    const tcp::endpoint at(ip_of(config.listen), config.listen.port);
    error_code error;
    acceptor.open(at.protocol(), error);
    if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error) acceptor.bind(at, error);
    if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
    if (error) throw std::runtime_error("cannot listen on " + to_string(config.listen) + ": " + error.message());
  }

  void accept() {
    acceptor.async_accept([this](error_code error, tcp::socket socket) {
      if (error) {  // no descriptors left: retry later
        accept_again.expires_after(waiting_time(std::chrono::milliseconds(100)));
        return accept_again.async_wait([this](error_code) { accept(); });
      }
      take(std::make_unique<Connection>(shared, std::move(socket)));
      accept();
    });
  }

  void take(std::unique_ptr<Connection> connection) {
    const bool room = make_room(*connection);
    const auto refusals = static_cast<std::size_t>(
        std::ranges::count_if(shared.connections, [](const auto& one) { return one->refused(); }));
    if (!room && refusals >= kMaxRefusals) {
      ++shared.counts.refused;
      return;
    }
    shared.connections.push_back(std::move(connection));
    if (room) {
      shared.connections.back()->start();
    } else {
      shared.connections.back()->refuse();
    }
  }

  /// Returns whether there is room. May close the connection that has waited longest for a request.
  bool make_room(const Connection& newcomer) {
    std::size_t all = 0;
    std::size_t near = 0;
    Connection* idlest = nullptr;
    Connection* idlest_near = nullptr;
    const auto pick = [](Connection*& longest, Connection& one) {
      if (one.waits_since() == LocalTime::max()) return;
      if (longest == nullptr || one.waits_since() < longest->waits_since()) longest = &one;
    };
    for (const auto& one : shared.connections) {
      if (one->closed() || one->refused()) continue;
      ++all;
      pick(idlest, *one);
      if (one->network() != newcomer.network()) continue;
      ++near;
      pick(idlest_near, *one);
    }
    if (near < config.max_per_address && all < config.max_connections) return true;
    Connection* const leaves = near >= config.max_per_address ? idlest_near : idlest;
    if (leaves == nullptr) return false;
    ++shared.counts.refused;
    leaves->close();
    return true;
  }

  void wait_for_server() {
    if (std::exchange(waiting, true)) return;
    link.when_readable([this](error_code) {
      waiting = false;
      schedule_turn(kGather);
    });
  }

  void schedule_turn(Duration in) {
    turn_timer.expires_after(waiting_time(in));
    turn_timer.async_wait([this](error_code cancelled) {
      if (cancelled) return;
      const LocalTime now = shared.clock();
      const LocalTime next = turn(now);
      shared.foxglove.take(now);
      for (const auto& connection : shared.connections) connection->pump();
      schedule_turn(std::min(next - now, Duration(std::chrono::seconds(1))));
      wait_for_server();
    });
  }

  void schedule_tick() {
    tick_timer.expires_after(waiting_time(Feed::kTick));
    tick_timer.async_wait([this](error_code) {
      const LocalTime now = shared.clock();
      tick(now);
      shared.foxglove.tick(now);
      shared.feed.tick(now);
      for (const auto& connection : shared.connections) connection->pump();
      schedule_tick();
    });
  }

  Config config;
  Shared shared;
  ServerSocket link;
  tcp::acceptor acceptor{shared.context};
  asio::steady_timer turn_timer{shared.context};
  asio::steady_timer tick_timer{shared.context};
  asio::steady_timer accept_again{shared.context};
  bool waiting = false;
  std::function<LocalTime(LocalTime)> turn;
  std::function<void(LocalTime)> tick;
};

WebServer::WebServer(const Config& config, const Routes& routes, Feed& feed, FoxgloveFeed& foxglove, WebCounts& counts,
                     BridgeCounts& bridge, Clock clock)
    : state_(std::make_unique<State>(config, routes, feed, foxglove, counts, bridge, clock)) {}

WebServer::~WebServer() = default;

Address WebServer::address() const { return address_of(state_->acceptor.local_endpoint()); }

Link& WebServer::link() { return state_->link; }

void WebServer::run(Duration duration, const std::function<LocalTime(LocalTime)>& turn,
                    const std::function<void(LocalTime)>& tick) {
  asio::io_context& context = state_->shared.context;
  state_->turn = turn;
  state_->tick = tick;
  asio::signal_set signals(context, SIGINT, SIGTERM);
  signals.async_wait([&](error_code, int) { context.stop(); });
  asio::steady_timer end(context);
  if (duration > Duration::zero()) {
    end.expires_after(waiting_time(duration));
    end.async_wait([&](error_code) { context.stop(); });
  }
  state_->accept();
  state_->schedule_turn(Duration::zero());
  state_->schedule_tick();
  context.run();
  for (const auto& connection : state_->shared.connections) connection->close();
}

}  // namespace tendon::dash
