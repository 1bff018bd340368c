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

/// An HTTP and WebSocket server for browsers. It runs on one thread. Thread-safe: no. Realtime-safe: no.
namespace tendon::web {

// These hide Beast.
struct Stream;  ///< a TCP connection
struct Timer;   ///< a one-shot timer
struct Release {
  void operator()(Stream* stream) const;
  void operator()(Timer* timer) const;
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

  void post(std::function<void()> call);  ///< calls `call` after all pending handlers

  /// Starts a timer that calls `call` after `in`. The timer is canceled if the returned object is destroyed.
  Alarm after(Duration in, std::function<void()> call);

  /// Runs until SIGINT or SIGTERM, or for `duration` if it is > 0. The function `accepted` is called for each new
  /// connection.
  void run(Duration duration, std::function<void(Incoming)> accepted);

 private:
  friend class Watch;
  struct State;
  std::unique_ptr<State> state_;
};

/// Waits until a file descriptor is readable. The descriptor is duplicated, so the owner can close it at any time.
class Watch {
 public:
  Watch(HttpServer& server, int descriptor);
  ~Watch();
  /// Calls `call(true)` when the descriptor is readable, or `call(false)` on error or when the Watch is destroyed.
  void wait(std::function<void(bool readable)> call);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// An HTTP request. The strings are valid until the handler returns.
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
  bool keep_alive = false;  ///< the connection remains open after the reply
  bool upgrade = false;     ///< requests a WebSocket
  std::string protocols{};  ///< Sec-WebSocket-Protocol, several separated by commas
  bool local = false;       ///< the address of the client is a loopback address
  bool proxied = false;     ///< forwarded by a proxy: Forwarded, X-Forwarded-For, X-Real-IP or Via
};

/// A connection that receives HTTP requests and can be upgraded to a WebSocket. The owner must delete it when gone() is
/// called, and may delete it when done() is true.
class HttpConnection {
 public:
  struct Limits {
    std::uint32_t max_request = 16 * 1024;  ///< bytes of request headers
    Duration request_patience{};            ///< timeout of a request
    Duration reply_patience{};              ///< timeout for sending a part of a reply
  };
  enum class Then : std::uint8_t { kReadRequest, kLinger, kClose };
  struct WebSocket {
    Duration patience{};       ///< timeout of the handshake
    Duration silence{};        ///< timeout if no data is received
    bool pings = true;         ///< sends a ping before the timeout
    std::size_t max_message;   ///< bytes; longer messages close the connection with status 1009
    std::string protocol{};    ///< selected subprotocol; empty: none
    int send_buffer_size = 0;  ///< size of the kernel buffer in bytes; 0: default
  };

  HttpConnection(Incoming stream, const Limits& limits);
  virtual ~HttpConnection();
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;

  virtual void read_request();
  void close();
  bool closed() const noexcept { return closed_; }
  bool done() const noexcept { return closed_ && pending_ == 0; }  ///< closed, and no handler is pending
  const std::optional<Address>& peer() const noexcept { return peer_; }

 protected:
  virtual void take_request(const Request& request) = 0;
  virtual std::string next_piece() { return {}; }  ///< the next part of a reply, or an empty string at the end
  virtual void opened() = 0;                       ///< the WebSocket is open
  virtual void take_message(std::span<const std::byte> message, bool binary) = 0;
  virtual void written() = 0;
  virtual void closing() {}  ///< called once by close()
  virtual void gone() = 0;   ///< must delete the connection

  /// Sends `head` and then next_piece() until it is empty. If `then` is kLinger, the remaining data is read
  /// for up to 1 s before the connection is closed, because the reply would otherwise be discarded.
  void reply(std::string head, Then then);
  void accept(const WebSocket& options);                        ///< accepts the WebSocket request
  void read_message();                                          ///< reads the next message if no read is pending
  void write(std::span<const std::byte> message, bool binary);  ///< `message` must be valid until written()
  bool open() const noexcept { return open_ && !closed_; }
  bool writing() const noexcept { return writing_; }
  bool too_long() const noexcept { return too_long_; }  ///< whether a message exceeded max_message

  /// Wraps the handler of another operation. The handler is not called after close(), and gone() is not called while
  /// the operation is pending.
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
  std::string text_;  ///< the buffer of the current operation
  Then then_ = Then::kClose;
  bool open_ = false;
  bool reading_ = false;
  bool writing_ = false;
  bool too_long_ = false;
  int pending_ = 0;
  bool closed_ = false;
};

}  // namespace tendon::web
