// SPDX-License-Identifier: Apache-2.0
// Measures Fast DDS with two topics on the loopback. The QoS is best effort. The transport is UDP, not shared memory.
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/config.h>
#include <array>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "server/machine/clock.h"
#include "tests/tools/bench/peers/echo_client.h"

namespace tendon::bench {
namespace {

namespace dds = eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using Payload = eprosima::fastrtps::rtps::SerializedPayload_t;
constexpr int kDomain = 212;
template <std::size_t Size>
class Octets : public dds::TopicDataType {
 public:
  Octets() {
    setName(("Octets" + std::to_string(Size)).c_str());
    m_typeSize = kHeader + Size;
    m_isGetKeyDefined = false;
  }
  bool serialize(void* data, Payload* payload) override {
    payload->encapsulation = CDR_LE;
    std::memcpy(payload->data, "\0\1\0\0", kHeader);  // little-endian
    std::memcpy(payload->data + kHeader, data, Size);
    payload->length = kHeader + Size;
    return true;
  }
  bool deserialize(Payload* payload, void* data) override { return std::memcpy(data, payload->data + kHeader, Size); }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* /*data*/) override {
    return [] { return static_cast<std::uint32_t>(kHeader + Size); };
  }
  void* createData() override { return new std::array<std::byte, Size>; }
  void deleteData(void* data) override { delete static_cast<std::array<std::byte, Size>*>(data); }
  bool getKey(void* /*data*/, InstanceHandle_t* /*handle*/, bool /*md5*/) override { return false; }

 private:
  static constexpr std::size_t kHeader = 4;
};

template <class T>
T* made(T* entity) {
  if (entity == nullptr) throw std::runtime_error("Fast DDS cannot create an entity");
  return entity;
}

/// Writes samples of Written bytes and reads samples of Read bytes.
template <std::size_t Written, std::size_t Read>
class Ends {
 public:
  explicit Ends(const std::string& name) {
    dds::DomainParticipantQos on_loopback;
    auto udp = std::make_unique<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList.emplace_back("127.0.0.1");
    on_loopback.transport().use_builtin_transports = false;
    on_loopback.transport().user_transports.emplace_back(std::move(udp));
    auto* const participant =
        made(dds::DomainParticipantFactory::get_instance()->create_participant(kDomain, on_loopback));
    const auto topic = [&](dds::TopicDataType* type) {
      dds::TypeSupport(type).register_type(participant);
      return made(participant->create_topic(name + type->getName(), type->getName(), dds::TOPIC_QOS_DEFAULT));
    };
    dds::DataWriterQos written;
    written.reliability().kind = dds::BEST_EFFORT_RELIABILITY_QOS;
    written.data_sharing().off();
    dds::DataReaderQos read;
    read.reliability().kind = dds::BEST_EFFORT_RELIABILITY_QOS;
    read.data_sharing().off();
    writer_ = made(made(participant->create_publisher(dds::PUBLISHER_QOS_DEFAULT))
                       ->create_datawriter(topic(new Octets<Written>), written));
    reader_ = made(made(participant->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT))
                       ->create_datareader(topic(new Octets<Read>), read));
  }

  void wait_until_matched() const {
    dds::PublicationMatchedStatus readers;
    dds::SubscriptionMatchedStatus writers;
    while (readers.current_count == 0 || writers.current_count == 0) {
      writer_->get_publication_matched_status(readers);
      reader_->get_subscription_matched_status(writers);
      clock::sleep_until(clock::now() + std::chrono::milliseconds(1));
    }
  }
  void write() { writer_->write(written_.data()); }
  bool wait_and_take() {
    dds::SampleInfo info;
    while (reader_->wait_for_unread_message({static_cast<std::int32_t>(seconds(kPatience)), 0})) {
      if (reader_->take_next_sample(read_.data(), &info) == ReturnCode_t::RETCODE_OK && info.valid_data) return true;
    }
    return false;
  }

 private:
  dds::DataWriter* writer_ = nullptr;
  dds::DataReader* reader_ = nullptr;
  std::array<std::byte, Written> written_{};
  std::array<std::byte, Read> read_{};
};

void serve(EchoSetup& setup) {
  Ends<kReplyBytes, kRequestBytes> ends(setup.name());
  for (;;) {
    if (!ends.wait_and_take()) continue;
    setup.delay_reply();
    ends.write();
  }
}

class TopicClient : public EchoClient {
 public:
  explicit TopicClient(const EchoSetup& setup) : ends_(setup.name()) { ends_.wait_until_matched(); }
  bool request_reply() override {
    ends_.write();
    return ends_.wait_and_take();
  }

 private:
  Ends<kRequestBytes, kReplyBytes> ends_;
};

}  // namespace
}  // namespace tendon::bench

int main(int argc, char** argv) {
  using namespace tendon::bench;  // NOLINT
  return peer_main(argc, argv, "Fast DDS " FASTRTPS_VERSION_STR ", best effort, UDP", serve,
                   [](EchoSetup& setup) { return std::make_unique<TopicClient>(setup); });
}
