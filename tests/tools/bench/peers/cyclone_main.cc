// SPDX-License-Identifier: Apache-2.0
// Measures Cyclone DDS with two topics on the loopback. Uses best effort and a history of one sample.
#include <dds/dds.h>
#include <dds/version.h>
#include <echo.h>

#include <memory>
#include <stdexcept>
#include <string>

#include "server/machine/clock.h"
#include "tests/tools/bench/peers/echo_client.h"

namespace tendon::bench {
namespace {

constexpr const char* kOnTheLoopback =
    "<CycloneDDS><Domain Id=\"any\"><General><Interfaces><NetworkInterface address=\"127.0.0.1\"/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<Peers><Peer Address=\"127.0.0.1\"/></Peers></Discovery></Domain></CycloneDDS>";
constexpr dds_domainid_t kDomain = 211;

dds_entity_t made(dds_entity_t entity) {
  if (entity < 0) throw std::runtime_error(std::string("Cyclone DDS: ") + dds_strretcode(entity));
  return entity;
}

/// A writer and a reader. The names of both topics begin with `name`.
class Ends {
 public:
  Ends(const std::string& name, const dds_topic_descriptor_t& written, const dds_topic_descriptor_t& read) {
    made(dds_create_domain(kDomain, kOnTheLoopback));
    const dds_entity_t participant = made(dds_create_participant(kDomain, nullptr, nullptr));
    dds_qos_t* const qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_BEST_EFFORT, 0);
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 1);
    const auto topic = [&](const dds_topic_descriptor_t& type) {
      return made(
          dds_create_topic(participant, &type, (name + "_" + std::to_string(type.m_size)).c_str(), qos, nullptr));
    };
    writer_ = made(dds_create_writer(participant, topic(written), qos, nullptr));
    reader_ = made(dds_create_reader(participant, topic(read), qos, nullptr));
    dds_delete_qos(qos);
    waitset_ = made(dds_create_waitset(participant));
    made(dds_waitset_attach(waitset_, made(dds_create_readcondition(reader_, DDS_ANY_STATE)), 0));
  }

  void wait_until_matched() const {
    for (;;) {
      dds_publication_matched_status_t readers{};
      dds_subscription_matched_status_t writers{};
      dds_get_publication_matched_status(writer_, &readers);
      dds_get_subscription_matched_status(reader_, &writers);
      if (readers.current_count > 0 && writers.current_count > 0) return;
      clock::sleep_until(clock::now() + std::chrono::milliseconds(1));
    }
  }
  template <class Sample>
  void write(const Sample& sample) const {
    made(dds_write(writer_, &sample));
  }
  template <class Sample>
  bool wait_and_take(Sample& sample, dds_duration_t patience) const {
    dds_attach_t triggered = 0;
    void* into = &sample;
    dds_sample_info_t info{};
    while (dds_waitset_wait(waitset_, &triggered, 1, patience) > 0) {
      if (dds_take(reader_, &into, &info, 1, 1) > 0 && info.valid_data) return true;
    }
    return false;
  }

 private:
  dds_entity_t writer_ = 0;
  dds_entity_t reader_ = 0;
  dds_entity_t waitset_ = 0;
};

void serve(EchoSetup& setup) {
  const Ends ends(setup.name(), tendon_bench_Reply_desc, tendon_bench_Request_desc);
  tendon_bench_Request request{};
  const tendon_bench_Reply reply{};
  for (;;) {
    if (!ends.wait_and_take(request, DDS_INFINITY)) continue;
    setup.delay_reply();
    ends.write(reply);
  }
}

class TopicClient : public EchoClient {
 public:
  explicit TopicClient(const EchoSetup& setup)
      : ends_(setup.name(), tendon_bench_Request_desc, tendon_bench_Reply_desc) {
    ends_.wait_until_matched();
  }
  bool request_reply() override {
    ends_.write(request_);
    return ends_.wait_and_take(reply_, kPatience.count());
  }

 private:
  Ends ends_;
  tendon_bench_Request request_{};
  tendon_bench_Reply reply_{};
};

}  // namespace
}  // namespace tendon::bench

int main(int argc, char** argv) {
  using namespace tendon::bench;  // NOLINT
  return peer_main(argc, argv, "Cyclone DDS " DDS_VERSION ", best effort, UDP", serve,
                   [](EchoSetup& setup) { return std::make_unique<TopicClient>(setup); });
}
