// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "protocol/link.h"

/// HTTP and WebSockets for programs that serve browsers, on one thread. Thread-safe: no. Realtime-safe: no.
namespace tendon::web {

// These hide Beast.
struct Stream;  ///< an accepted TCP connection
struct Timer;   ///< calls a function once
struct Release {
  void operator()(Stream* stream) const;
  void operator()(Timer* timer) const;  ///< the function is not called any more
};
using Incoming = std::unique_ptr<Stream, Release>;
using Alarm = std::unique_ptr<Timer, Release>;

/// Accepts connections and runs all handlers.
class HttpServer {
 public:
  /// Starts to listen. Throws std::runtime_error: "cannot listen on 127.0.0.1:8080: Address already in use".
  explicit HttpServer(const Address& listen);
  ~HttpServer();

  Address address() const;

  void post(std::function<void()> call);  ///< calls it after the pending handlers

  /// Calls `call` once after `in`, unless the result is destroyed before.
  Alarm after(Duration in, std::function<void()> call);

  /// Runs until SIGINT or SIGTERM, or for `duration` if it is > 0. If no descriptors are left, it accepts later.
  void run(Duration duration, std::function<void(Incoming)> accepted);

 private:
  friend class Watch;
  struct State;
  std::unique_ptr<State> state_;
};

/// Watches a duplicate of a descriptor, whose owner may close its own at any time.
class Watch {
 public:
  Watch(HttpServer& server, int descriptor);
  ~Watch();
  /// Calls `call` once: with true if the descriptor is readable, with false after an error or if the watch is destroyed.
  void wait(std::function<void(bool readable)> call);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The relevant parts of an HTTP request. The texts are valid until the handler returns.
struct Request {
  unsigned refused = 0;  ///< HTTP status 400, 413 or 431 if the request is invalid or too long; 0: valid
  std::string_view method{};
  std::string_view target{};  ///< path and query, undecoded
  std::optional<std::string_view> host{};
  std::optional<std::string_view> origin{};
  std::optional<std::string_view> authorization{};
  std::optional<std::string_view> range{};
  std::string_view accept_encoding{};
  bool repeated = false;    ///< more than one Host, Origin or Authorization
  bool keep_alive = false;  ///< the client may send another request
  bool upgrade = false;     ///< requests a WebSocket
  std::string protocols{};  ///< Sec-WebSocket-Protocol, several separated by commas
  bool local = false;       ///< from an address of this machine
  bool proxied = false;     ///< forwarded by a proxy: Forwarded, X-Forwarded-For, X-Real-IP or Via
};

/// One connection: HTTP requests, then perhaps a WebSocket. The owner deletes it in gone(), or if done() is true.
class HttpConnection {
 public:
  struct Limits {
    std::uint32_t max_request = 16 * 1024;  ///< bytes of request headers
    Duration request_patience{};            ///< timeout of a request
    Duration reply_patience{};              ///< timeout for reading a part of a reply
  };
  enum class Then : std::uint8_t { kReadRequest, kLinger, kClose };
  struct WebSocket {
    Duration patience{};       ///< timeout of the handshake
    Duration silence{};        ///< timeout of a silent client; with `pings`, one that does not answer a ping
    bool pings = true;         ///< ping a silent client
    std::size_t max_message;   ///< bytes; a longer message closes the connection (1009)
    std::string protocol{};    ///< selected subprotocol; empty: none
    int send_buffer_size = 0;  ///< bytes that the kernel buffers; 0: its default
  };

  HttpConnection(Incoming stream, const Limits& limits);
  virtual ~HttpConnection();
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;

  virtual void read_request();
  void close();
  bool closed() const noexcept { return closed_; }
  bool done() const noexcept { return closed_ && pending_ == 0; }  ///< closed, and no handler uses it
  const std::optional<Address>& peer() const noexcept { return peer_; }

 protected:
  virtual void take_request(const Request& request) = 0;
  virtual std::string next_piece() { return {}; }  ///< the next part of a reply; empty: none
  virtual void opened() = 0;                       ///< the WebSocket is open
  virtual void take_message(std::span<const std::byte> message, bool binary) = 0;
  virtual void written() = 0;
  virtual void closing() {}  ///< called once
  virtual void gone() = 0;   ///< deletes the connection

  /// Writes `head` and all pieces. kLinger: reads for at most 1 s and 64 kB, because a reset would discard the reply.
  void reply(std::string head, Then then);
  void accept(const WebSocket& options);  ///< accepts the WebSocket that was requested last
  void read_message();                    ///< reads one message. May be called again while one is read
  void write(std::span<const std::byte> message, bool binary);  ///< `message` must be valid until written()
  bool open() const noexcept { return open_ && !closed_; }
  bool writing() const noexcept { return writing_; }
  bool too_long() const noexcept { return too_long_; }  ///< closed because a message was too long

  /// Wraps the handler of another operation: it is not called after close(), and keeps the connection until then.
  template <class Handler>
  auto with(Handler handler) {
    ++pending_;
    return [this, handler = std::move(handler)](auto... results) mutable {
      --pending_;
      if (!closed_) handler(results...);
      if (done()) gone();
    };
  }

 private:
  void write_piece();
  void linger();

  Incoming stream_;
  Limits limits_;
  std::optional<Address> peer_;
  std::string text_;  ///< the part of a reply that is being written
  Then then_ = Then::kClose;
  bool open_ = false;
  bool reading_ = false;
  bool writing_ = false;
  bool too_long_ = false;
  int pending_ = 0;
  bool closed_ = false;
};

}  // namespace tendon::web
