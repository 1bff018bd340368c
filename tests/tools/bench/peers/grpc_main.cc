// SPDX-License-Identifier: Apache-2.0
// Measures a bidirectional stream of gRPC over TCP, without encryption. gRPC uses TCP_NODELAY.
#include <echo.grpc.pb.h>
#include <grpcpp/grpcpp.h>

#include <memory>
#include <stdexcept>
#include <string>

#include "tests/tools/bench/peers/echo_client.h"

namespace tendon::bench {
namespace {

class Service : public echo::Echo::Service {
 public:
  explicit Service(const EchoSetup& setup) : meeting_(setup) {}
  grpc::Status Turns(grpc::ServerContext* /*context*/,
                     grpc::ServerReaderWriter<echo::Bytes, echo::Bytes>* stream) override {
    echo::Bytes request;
    echo::Bytes reply;
    reply.set_data(std::string(kReplyBytes, 'x'));
    while (stream->Read(&request)) {
      meeting_.delay_reply();
      stream->Write(reply);
    }
    return grpc::Status::OK;
  }

 private:
  const EchoSetup& meeting_;
};

void serve(EchoSetup& setup) {
  Service service(setup);
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&service);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  if (server == nullptr) throw std::runtime_error("gRPC cannot listen");
  setup.announce("127.0.0.1:" + std::to_string(port));
  server->Wait();
}

/// The stream is reliable, so a reply cannot be lost.
class StreamClient : public EchoClient {
 public:
  explicit StreamClient(const EchoSetup& setup)
      : stub_(echo::Echo::NewStub(grpc::CreateChannel(setup.address(), grpc::InsecureChannelCredentials()))),
        stream_(stub_->Turns(&context_)) {
    request_.set_data(std::string(kRequestBytes, 'x'));
  }
  ~StreamClient() override { context_.TryCancel(); }
  bool request_reply() override {
    if (!stream_->Write(request_) || !stream_->Read(&reply_)) throw std::runtime_error("gRPC: the stream has ended");
    return reply_.data().size() == kReplyBytes;
  }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<echo::Echo::Stub> stub_;
  std::unique_ptr<grpc::ClientReaderWriter<echo::Bytes, echo::Bytes>> stream_;
  echo::Bytes request_;
  echo::Bytes reply_;
};

}  // namespace
}  // namespace tendon::bench

int main(int argc, char** argv) {
  using namespace tendon::bench;  // NOLINT
  return peer_main(argc, argv, "gRPC " + grpc::Version() + ", stream, reliable, tcp", serve,
                   [](EchoSetup& setup) { return std::make_unique<StreamClient>(setup); });
}
