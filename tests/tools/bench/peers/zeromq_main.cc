// SPDX-License-Identifier: Apache-2.0
// Measures a pair of ZeroMQ sockets. The first argument is the transport, tcp or ipc. ZeroMQ uses TCP_NODELAY.
#include <zmq.h>

#include <array>
#include <memory>
#include <stdexcept>
#include <string>

#include "tests/tools/bench/peers/echo_client.h"

namespace tendon::bench {
namespace {

class Pair {
 public:
  Pair() : context_(zmq_ctx_new()), socket_(zmq_socket(context_, ZMQ_PAIR)) {
    const int none = 0;
    expect(zmq_setsockopt(socket_, ZMQ_LINGER, &none, sizeof none));
  }
  ~Pair() {
    zmq_close(socket_);
    zmq_ctx_term(context_);
  }
  Pair(const Pair&) = delete;
  Pair& operator=(const Pair&) = delete;
  void* get() const noexcept { return socket_; }

  static void expect(int result) {
    if (result < 0) throw std::runtime_error(std::string("ZeroMQ: ") + zmq_strerror(zmq_errno()));
  }

 private:
  void* context_;
  void* socket_;
};

void serve(bool tcp, EchoSetup& setup) {
  const Pair pair;
  const std::string address = tcp ? "tcp://127.0.0.1:*" : "ipc://@" + setup.name();
  Pair::expect(zmq_bind(pair.get(), address.c_str()));
  std::array<char, 128> bound{};
  std::size_t size = bound.size();
  Pair::expect(zmq_getsockopt(pair.get(), ZMQ_LAST_ENDPOINT, bound.data(), &size));
  setup.announce(bound.data());
  std::array<std::byte, kRequestBytes> request{};
  const std::array<std::byte, kReplyBytes> reply{};
  for (;;) {
    Pair::expect(zmq_recv(pair.get(), request.data(), request.size(), 0));
    setup.delay_reply();
    Pair::expect(zmq_send(pair.get(), reply.data(), reply.size(), 0));
  }
}

class PairClient : public EchoClient {
 public:
  explicit PairClient(const EchoSetup& setup) {
    const int patience_ms = static_cast<int>(kPatience / std::chrono::milliseconds(1));
    Pair::expect(zmq_setsockopt(pair_.get(), ZMQ_RCVTIMEO, &patience_ms, sizeof patience_ms));
    Pair::expect(zmq_connect(pair_.get(), setup.address().c_str()));
  }
  bool request_reply() override {
    Pair::expect(zmq_send(pair_.get(), request_.data(), request_.size(), 0));
    return zmq_recv(pair_.get(), reply_.data(), reply_.size(), 0) == static_cast<int>(reply_.size());
  }

 private:
  Pair pair_;
  std::array<std::byte, kRequestBytes> request_{};
  std::array<std::byte, kReplyBytes> reply_{};
};

}  // namespace
}  // namespace tendon::bench

int main(int argc, char** argv) {
  using namespace tendon::bench;  // NOLINT
  const bool tcp = argc > 1 && std::string(argv[1]) == "tcp";
  int major = 0;
  int minor = 0;
  int patch = 0;
  zmq_version(&major, &minor, &patch);
  const std::string version = std::to_string(major) + "." + std::to_string(minor) + "." + std::to_string(patch);
  return peer_main(
      argc - 1, argv + 1, "ZeroMQ " + version + (tcp ? " over tcp" : " over ipc") + ", pair, reliable",
      [tcp](EchoSetup& setup) { serve(tcp, setup); },
      [](EchoSetup& setup) { return std::make_unique<PairClient>(setup); });
}
