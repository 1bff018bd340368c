// SPDX-License-Identifier: Apache-2.0
// Measures messages over a VRPN connection with low latency. VRPN uses UDP for these messages.
#include <vrpn_Connection.h>

#include <array>
#include <memory>
#include <stdexcept>
#include <string>

#include "server/machine/clock.h"
#include "tests/tools/bench/peers/echo_client.h"

namespace tendon::bench {
namespace {

constexpr const char* kRequest = "tendon_bench request";
constexpr const char* kReply = "tendon_bench reply";

/// Sends messages of one type and counts the received messages of the other type.
class End {
 public:
  End(vrpn_Connection* connection, const char* sent, const char* received) : connection_(connection) {
    if (connection == nullptr) throw std::runtime_error("VRPN cannot create a connection");
    sender_ = connection->register_sender("tendon_bench");
    sent_ = connection->register_message_type(sent);
    connection->register_handler(connection->register_message_type(received), count, this);
  }
  ~End() { connection_->removeReference(); }
  End(const End&) = delete;
  End& operator=(const End&) = delete;

  template <std::size_t Size>
  void send(const std::array<char, Size>& bytes) {
    connection_->pack_message(Size, connection_->get_time(), sent_, sender_, bytes.data(), vrpn_CONNECTION_LOW_LATENCY);
    connection_->send_pending_reports();
  }
  /// Waits for a message, with a timeout for each socket.
  bool hear(timeval patience) {
    connection_->mainloop(&patience);
    if (heard_ == 0) return false;
    --heard_;
    return true;
  }
  bool connected() const { return connection_->connected(); }

 private:
  static int VRPN_CALLBACK count(void* self, vrpn_HANDLERPARAM /*message*/) {
    ++static_cast<End*>(self)->heard_;
    return 0;
  }
  vrpn_Connection* connection_;
  vrpn_int32 sender_ = 0;
  vrpn_int32 sent_ = 0;
  int heard_ = 0;
};

constexpr timeval kShort{.tv_sec = 0, .tv_usec = 1000};

void serve(EchoSetup& setup) {
  constexpr int kPorts = 20000;
  const int port = kPorts + setup.number % kPorts;
  End end(vrpn_create_server_connection(port, nullptr, nullptr, "127.0.0.1"), kReply, kRequest);
  setup.announce("localhost:" + std::to_string(port));
  const std::array<char, kReplyBytes> reply{};
  for (;;) {
    if (!end.hear(kShort)) continue;
    setup.delay_reply();
    end.send(reply);
  }
}

class ConnectionClient : public EchoClient {
 public:
  explicit ConnectionClient(const EchoSetup& setup)
      : end_(vrpn_get_connection_by_name(setup.address().c_str(), nullptr, nullptr, nullptr, nullptr, "127.0.0.1"),
             kRequest, kReply) {
    while (!end_.connected()) end_.hear(kShort);
  }
  bool request_reply() override {
    end_.send(request_);
    for (const LocalTime end = clock::now() + kPatience; clock::now() < end;) {
      if (end_.hear(kShort)) return true;
    }
    return false;
  }

 private:
  End end_;
  std::array<char, kRequestBytes> request_{};
};

}  // namespace
}  // namespace tendon::bench

int main(int argc, char** argv) {
  using namespace tendon::bench;  // NOLINT
  return peer_main(argc, argv, "VRPN, unreliable messages, UDP", serve,
                   [](EchoSetup& setup) { return std::make_unique<ConnectionClient>(setup); });
}
