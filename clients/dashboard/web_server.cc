// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/web_server.h"

#include <algorithm>
#include <array>
#include <list>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "clients/cpp/web/http_server.h"
#include "clients/dashboard/server_link.h"

namespace tendon::dash {
namespace {

using Bytes = std::span<const std::byte>;

/// Datagrams are read in batches. Otherwise tendon-dash would wake up 1000 times per second on the processors of the
/// haptic loop. The measured round trip includes this delay, but is not used in computations.
constexpr Duration kGather = std::chrono::milliseconds(3);
constexpr int kMaxDrained = 64;  ///< maximum number of datagrams read from one bridge socket in a row
constexpr std::size_t kPiece = 64 * 1024;
/// The maximum number of connections that are being refused. Further connections are closed without a reply.
constexpr std::size_t kMaxRefusals = 64;
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

class Connection;

struct Shared {
  const WebServer::Config& config;
  const Routes& routes;
  Feed& feed;
  FoxgloveFeed& foxglove;
  WebCounts& counts;
  BridgeCounts& bridge;
  WebServer::Clock clock;
  web::HttpServer& server;
  const ServerLink& link;  ///< of the Observer
  std::list<std::unique_ptr<Connection>> connections{};
};

/// A browser connection for HTTP requests or a WebSocket.
class Connection : public web::HttpConnection {
 public:
  Connection(Shared& shared, web::Incoming stream)
      : HttpConnection(std::move(stream), {.max_request = shared.config.max_request,
                                           .request_patience = shared.config.request_patience,
                                           .reply_patience = shared.config.patience}),
        shared_(shared) {
    if (peer()) network_ = network_of(*peer());
  }
  ~Connection() override {
    if (page_) shared_.feed.leave(*page_);
    if (viewer_) shared_.foxglove.leave(*viewer_);
    if (gate_) --shared_.bridge.pages;
  }

  void read_request() override {
    waits_since_ = shared_.clock();
    HttpConnection::read_request();
  }
  void refuse() {
    refused_ = true;
    write_reply(Routes::plain(503, "too many connections"));
  }
  bool refused() const noexcept { return refused_; }
  const std::array<std::uint8_t, 16>& network() const noexcept { return network_; }
  LocalTime waits_since() const noexcept { return waits_since_; }

  void pump() {
    if (!open() || writing()) return;
    if (page_) {
      if (auto text = shared_.feed.next(*page_)) {
        text_ = std::move(*text);
        write(std::as_bytes(std::span(text_)), false);
      }
    } else if (viewer_) {
      if (auto message = shared_.foxglove.next(*viewer_)) {
        text_ = std::move(message->bytes);
        write(std::as_bytes(std::span(text_)), message->binary);
      }
    } else if (auto datagram = gate_->next()) {
      datagram_ = std::move(*datagram);
      write(datagram_, true);
    }
  }

 private:
  void take_request(const web::Request& request) override {
    waits_since_ = LocalTime::max();
    ++shared_.counts.requests;
    keep_alive_ = false;
    with_body_ = true;
    if (request.refused == 431) return write_reply(Routes::plain(431, "the request is too long"));
    if (request.refused == 413) return write_reply(Routes::plain(413, "expected a request without content"));
    if (request.refused != 0) return write_reply(Routes::plain(400, "not a valid HTTP request"));
    if (request.repeated) {
      return write_reply(Routes::plain(400, "expected at most one Host, one Origin and one Authorization"));
    }
    keep_alive_ = request.keep_alive;
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
      open_socket(Side::kPage);
    } else if (const auto* viewer = std::get_if<FoxgloveSocket>(&answer)) {
      if (shared_.foxglove.clients() >= shared_.config.max_viewers) {
        return write_reply(Routes::plain(503, "too many viewers are already connected"));
      }
      viewer_ = shared_.foxglove.join(shared_.clock());
      open_socket(Side::kViewer, viewer->protocol);
    } else {
      if (shared_.bridge.pages >= shared_.config.max_bridges) {
        ++shared_.bridge.refused_full;
        return write_reply(Routes::plain(503, "too many pages are already connected to the bridge"));
      }
      ++shared_.bridge.pages;
      ++shared_.bridge.opened;
      gate_.emplace(shared_.config.bridge, std::get<BridgeSocket>(answer).local, shared_.bridge, shared_.clock());
      open_socket(Side::kBridge);
    }
  }

  void write_reply(Reply answer) {
    if (answer.status >= 400 && answer.status != 404 && answer.status != 416) ++shared_.counts.refused;
    reply_ = std::move(answer);
    sent_ = 0;
    std::string first = reply_.head(keep_alive_);
    if (with_body_) {
      if (const auto* text = std::get_if<std::string>(&reply_.body)) first += *text;
      if (const auto* text = std::get_if<std::string_view>(&reply_.body)) first += *text;
    }
    reply(std::move(first), keep_alive_ ? Then::kReadRequest : refused_ ? Then::kLinger : Then::kClose);
  }

  std::string next_piece() override {
    const auto* file = std::get_if<Reply::Slice>(&reply_.body);
    if (file != nullptr && with_body_ && sent_ < file->range.count) {
      const std::uint64_t left = file->range.count - sent_;
      std::string piece = file->file.read(file->range.first + sent_, std::min<std::uint64_t>(left, kPiece));
      if (piece.empty()) close();  // the file was truncated; the browser detects missing bytes
      sent_ += piece.size();
      return piece;
    }
    reply_.body = std::string();  // closes the file
    return {};
  }

  enum class Side : std::uint8_t { kPage, kViewer, kBridge };

  void open_socket(Side side, const std::string& protocol = {}) {
    if (side == Side::kBridge) {
      try {
        server_.emplace(shared_.link.server());
      } catch (const std::runtime_error&) {
        return close();
      }
      readable_.emplace(shared_.server, server_->descriptor());
    }
    accept({.patience = shared_.config.patience,
            .silence = shared_.config.patience,
            .pings = side != Side::kBridge,
            .max_message = side == Side::kPage     ? kMaxLine
                           : side == Side::kViewer ? kMaxOrder
                                                   : kMaxDatagram,
            .protocol = protocol,
            .send_buffer_size = side == Side::kViewer ? kViewerSendBuffer : 0});
  }

  void opened() override {
    read_message();
    if (gate_) read_server();
    pump();
  }

  void take_message(Bytes bytes, bool binary) override {
    const LocalTime now = shared_.clock();
    if (gate_) {
      if (gate_->passes(now, bytes, binary)) server_->send(server_->server(), bytes);
    } else {
      const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
      const bool heard = !binary && (viewer_ ? shared_.foxglove.receive(now, *viewer_, text)
                                             : shared_.feed.receive(now, *page_, text));
      if (!heard) return close();
      pump();
    }
    read_message();
  }

  void written() override { pump(); }

  void closing() override {
    readable_.reset();
    server_.reset();
  }

  void gone() override {
    std::erase_if(shared_.connections, [this](const auto& one) { return one.get() == this; });
  }

  void read_server() {
    readable_->wait(with([this](bool readable) {
      if (!readable) return close();
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
  std::array<std::uint8_t, 16> network_{};
  LocalTime waits_since_ = LocalTime::max();
  bool refused_ = false;
  bool keep_alive_ = false;
  bool with_body_ = true;
  Reply reply_;
  std::uint64_t sent_ = 0;  ///< bytes of the file

  std::optional<Feed::PageId> page_;
  std::optional<FoxgloveFeed::ClientId> viewer_;
  std::optional<BridgeGate> gate_;
  std::optional<ServerLink> server_;
  std::optional<web::Watch> readable_;
  std::string text_;                 ///< the message that is being written
  std::vector<std::byte> datagram_;  ///< the same on the bridge
};

}  // namespace

struct WebServer::State {
  State(const Config& own, const Routes& routes, Feed& feed, FoxgloveFeed& foxglove, WebCounts& counts,
        BridgeCounts& bridge, Clock clock)
      : config(own), server(config.listen), link(config.server), shared{config, routes, feed,   foxglove, counts,
                                                                        bridge, clock,  server, link} {}

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
      shared.connections.back()->read_request();
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
    if (std::exchange(watched, link.changes()) != link.changes()) {
      readable.emplace(server, link.descriptor());
      waiting = false;
    }
    if (std::exchange(waiting, true)) return;
    readable->wait([this](bool datagram) {
      if (!datagram) return;
      waiting = false;
      schedule_turn(kGather);
    });
  }

  void schedule_turn(Duration in) {
    turn_timer = server.after(in, [this] {
      const LocalTime now = shared.clock();
      const LocalTime next = turn(now);
      shared.foxglove.take(now);
      for (const auto& connection : shared.connections) connection->pump();
      schedule_turn(std::min(next - now, Duration(std::chrono::seconds(1))));
      wait_for_server();
    });
  }

  void schedule_tick() {
    tick_timer = server.after(Feed::kTick, [this] {
      const LocalTime now = shared.clock();
      tick(now);
      shared.foxglove.tick(now);
      shared.feed.tick(now);
      for (const auto& connection : shared.connections) connection->pump();
      schedule_tick();
    });
  }

  Config config;
  web::HttpServer server;
  ServerLink link;
  Shared shared;
  web::Alarm turn_timer;
  web::Alarm tick_timer;
  std::optional<web::Watch> readable{std::in_place, server, link.descriptor()};
  std::uint64_t watched = 0;  ///< the value of link.changes() for `readable`
  bool waiting = false;
  std::function<LocalTime(LocalTime)> turn;
  std::function<void(LocalTime)> tick;
};

WebServer::WebServer(const Config& config, const Routes& routes, Feed& feed, FoxgloveFeed& foxglove, WebCounts& counts,
                     BridgeCounts& bridge, Clock clock)
    : state_(std::make_unique<State>(config, routes, feed, foxglove, counts, bridge, clock)) {}

WebServer::~WebServer() = default;

Address WebServer::address() const { return state_->server.address(); }

Link& WebServer::link() { return state_->link; }

void WebServer::run(Duration duration, const std::function<LocalTime(LocalTime)>& turn,
                    const std::function<void(LocalTime)>& tick) {
  state_->turn = turn;
  state_->tick = tick;
  state_->schedule_turn(Duration::zero());
  state_->schedule_tick();
  state_->server.run(duration, [this](web::Incoming stream) {
    state_->take(std::make_unique<Connection>(state_->shared, std::move(stream)));
  });
  for (const auto& connection : state_->shared.connections) connection->close();
}

}  // namespace tendon::dash
