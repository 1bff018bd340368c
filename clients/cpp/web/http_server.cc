// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/web/http_server.h"

#include <unistd.h>

#include <algorithm>
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
#include <chrono>
#include <csignal>
#include <stdexcept>
#include <utility>

namespace tendon::web {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

constexpr Duration kLinger = std::chrono::seconds(1);
constexpr std::size_t kMaxLingered = 64 * 1024;
constexpr Duration kRetryAccept = std::chrono::milliseconds(100);

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

asio::steady_timer::duration waiting_time(Duration d) {
  return std::chrono::duration_cast<asio::steady_timer::duration>(std::max(d, Duration::zero()));
}

}  // namespace

struct Stream {
  explicit Stream(tcp::socket socket) : plain(std::move(socket)) {}
  tcp::socket& socket() { return web_socket ? web_socket->next_layer().socket() : plain.socket(); }

  beast::tcp_stream plain;  ///< moved into the WebSocket when it is accepted
  beast::flat_buffer request_buffer;
  std::optional<http::request_parser<http::empty_body>> parser;
  std::optional<websocket::stream<beast::tcp_stream>> web_socket;
  beast::flat_buffer message;
};

struct Timer {
  asio::steady_timer timer;
};

void Release::operator()(Stream* stream) const { delete stream; }
void Release::operator()(Timer* timer) const { delete timer; }

struct HttpServer::State {
  void accept() {
    acceptor.async_accept([this](error_code error, tcp::socket socket) {
      if (error) {
        accept_again.expires_after(waiting_time(kRetryAccept));
        return accept_again.async_wait([this](error_code) { accept(); });
      }
      accepted(Incoming(new Stream(std::move(socket))));
      accept();
    });
  }

  asio::io_context context{1};
  tcp::acceptor acceptor{context};
  asio::steady_timer accept_again{context};
  std::function<void(Incoming)> accepted;
};

HttpServer::HttpServer(const Address& listen) : state_(std::make_unique<State>()) {
  const tcp::endpoint at(ip_of(listen), listen.port);
  tcp::acceptor& acceptor = state_->acceptor;
  error_code error;
  acceptor.open(at.protocol(), error);
  if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor.bind(at, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error) throw std::runtime_error("cannot listen on " + to_string(listen) + ": " + error.message());
}

HttpServer::~HttpServer() = default;

Address HttpServer::address() const { return address_of(state_->acceptor.local_endpoint()); }

void HttpServer::post(std::function<void()> call) { asio::post(state_->context, std::move(call)); }

Alarm HttpServer::after(Duration in, std::function<void()> call) {
  Alarm alarm(new Timer{asio::steady_timer(state_->context, waiting_time(in))});
  alarm->timer.async_wait([call = std::move(call)](error_code cancelled) {
    if (!cancelled) call();
  });
  return alarm;
}

void HttpServer::run(Duration duration, std::function<void(Incoming)> accepted) {
  asio::io_context& context = state_->context;
  asio::signal_set signals(context, SIGINT, SIGTERM);
  signals.async_wait([&](error_code, int) { context.stop(); });
  asio::steady_timer end(context);
  if (duration > Duration::zero()) {
    end.expires_after(waiting_time(duration));
    end.async_wait([&](error_code) { context.stop(); });
  }
  state_->accepted = std::move(accepted);
  state_->accept();
  context.run();
}

struct Watch::State {
  asio::posix::stream_descriptor own;
};

Watch::Watch(HttpServer& server, int descriptor) : state_(new State{{server.state_->context, ::dup(descriptor)}}) {}

Watch::~Watch() = default;

void Watch::wait(std::function<void(bool)> call) {
  state_->own.async_wait(asio::posix::stream_descriptor::wait_read,
                         [call = std::move(call)](error_code error) { call(!error); });
}

namespace {

Request request_of(const Stream& stream, error_code error, const std::optional<Address>& peer) {
  Request request;
  if (error) {
    const bool long_header = error == http::error::header_limit || error == http::error::buffer_overflow;
    request.refused = long_header ? 431 : error == http::error::body_limit ? 413 : 400;
    return request;
  }
  const auto& message = stream.parser->get();
  const auto header = [&](http::field field) -> std::optional<std::string_view> {
    const auto found = message.find(field);
    if (found == message.end()) return std::nullopt;
    return std::string_view(found->value().data(), found->value().size());
  };
  request.method = {message.method_string().data(), message.method_string().size()};
  request.target = {message.target().data(), message.target().size()};
  request.host = header(http::field::host);
  request.origin = header(http::field::origin);
  request.authorization = header(http::field::authorization);
  request.range = header(http::field::range);
  request.accept_encoding = header(http::field::accept_encoding).value_or("");
  request.repeated = message.count(http::field::host) > 1 || message.count(http::field::origin) > 1 ||
                     message.count(http::field::authorization) > 1;
  request.keep_alive = message.keep_alive();
  request.upgrade = websocket::is_upgrade(message);
  const auto [first, last] = message.equal_range(http::field::sec_websocket_protocol);
  for (auto one = first; one != last; ++one) request.protocols += std::string(one->value()) + ",";
  request.local = peer && is_loopback(*peer);
  request.proxied = header(http::field::forwarded) || header(http::field::via) ||
                    message.count("X-Forwarded-For") > 0 || message.count("X-Real-IP") > 0;
  return request;
}

}  // namespace

HttpConnection::HttpConnection(Incoming stream, const Limits& limits) : stream_(std::move(stream)), limits_(limits) {
  error_code gone;
  const tcp::endpoint peer = stream_->socket().remote_endpoint(gone);
  if (!gone) peer_ = address_of(peer);
  // A message must not wait for the acknowledgement of the previous one.
  stream_->socket().set_option(tcp::no_delay(true), gone);
  stream_->request_buffer.max_size(limits.max_request);
}

HttpConnection::~HttpConnection() = default;

void HttpConnection::close() {
  if (std::exchange(closed_, true)) return;
  error_code gone;
  stream_->socket().shutdown(tcp::socket::shutdown_both, gone);
  stream_->socket().close(gone);
  closing();
}

void HttpConnection::read_request() {
  auto& parser = stream_->parser.emplace();
  parser.header_limit(limits_.max_request);
  parser.body_limit(0);
  stream_->plain.expires_after(waiting_time(limits_.request_patience));
  http::async_read(stream_->plain, stream_->request_buffer, parser, with([this](error_code error, std::size_t) {
                     if (error == http::error::end_of_stream || error == beast::error::timeout ||
                         error == asio::error::connection_reset) {
                       return close();
                     }
                     take_request(request_of(*stream_, error, peer_));
                   }));
}

void HttpConnection::reply(std::string head, Then then) {
  text_ = std::move(head);
  then_ = then;
  write_piece();
}

void HttpConnection::write_piece() {
  stream_->plain.expires_after(waiting_time(limits_.reply_patience));
  asio::async_write(stream_->plain, asio::buffer(text_), with([this](error_code error, std::size_t) {
                      if (error) return close();
                      text_ = next_piece();
                      if (closed_) return;
                      if (!text_.empty()) return write_piece();
                      if (then_ == Then::kReadRequest) return read_request();
                      if (then_ == Then::kLinger) return linger();
                      close();
                    }));
}

void HttpConnection::linger() {
  error_code gone;
  stream_->socket().shutdown(tcp::socket::shutdown_send, gone);
  stream_->plain.expires_after(waiting_time(kLinger));
  text_.resize(kMaxLingered);
  asio::async_read(stream_->plain, asio::buffer(text_), with([this](error_code, std::size_t) { close(); }));
}

void HttpConnection::accept(const WebSocket& options) {
  stream_->plain.expires_never();
  if (options.send_buffer_size > 0) {
    error_code gone;
    stream_->socket().set_option(asio::socket_base::send_buffer_size(options.send_buffer_size), gone);
  }
  auto& web_socket = stream_->web_socket.emplace(std::move(stream_->plain));
  websocket::stream_base::timeout timeout{};
  timeout.handshake_timeout = waiting_time(options.patience);
  timeout.idle_timeout = waiting_time(options.silence);
  timeout.keep_alive_pings = options.pings;
  web_socket.set_option(timeout);
  web_socket.read_message_max(options.max_message);
  if (!options.protocol.empty()) {
    web_socket.set_option(
        websocket::stream_base::decorator([protocol = options.protocol](websocket::response_type& response) {
          response.set(http::field::sec_websocket_protocol, protocol);
        }));
  }
  web_socket.async_accept(stream_->parser->get(), with([this](error_code error) {
                            if (error) return close();
                            open_ = true;
                            opened();
                          }));
}

void HttpConnection::read_message() {
  if (closed_ || std::exchange(reading_, true)) return;
  stream_->message.clear();
  stream_->web_socket->async_read(
      stream_->message, with([this](error_code error, std::size_t) {
        reading_ = false;
        too_long_ = error == websocket::error::message_too_big;
        if (error) return close();
        const auto bytes = stream_->message.data();
        take_message({static_cast<const std::byte*>(bytes.data()), bytes.size()}, stream_->web_socket->got_binary());
      }));
}

void HttpConnection::write(std::span<const std::byte> message, bool binary) {
  writing_ = true;
  stream_->web_socket->binary(binary);
  stream_->web_socket->async_write(asio::buffer(message.data(), message.size()),
                                   with([this](error_code error, std::size_t) {
                                     writing_ = false;
                                     if (error) return close();
                                     written();
                                   }));
}

}  // namespace tendon::web
