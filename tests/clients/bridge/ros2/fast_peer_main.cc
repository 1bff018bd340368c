// SPDX-License-Identifier: Apache-2.0
// A client that uses Fast DDS, as ROS 2 does, with independently written message types. It reads topics, publishes
// wrench_command, and ten times per second prints a flat JSON object with the newest values.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <iostream>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <type_traits>
#include <vector>

#include "tests/clients/bridge/ros2/fast_types.h"

namespace tendon::fast {
namespace {

namespace dds = eprosima::fastdds::dds;
using nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr const char* kOnTheLoopback = R"(<?xml version="1.0" encoding="UTF-8" ?>
<dds><profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <transport_descriptors><transport_descriptor>
    <transport_id>loopback</transport_id><type>UDPv4</type>
    <interfaceWhiteList><address>127.0.0.1</address></interfaceWhiteList>
  </transport_descriptor></transport_descriptors>
  <participant profile_name="loopback"><rtps>
    <userTransports><transport_id>loopback</transport_id></userTransports>
    <useBuiltinTransports>false</useBuiltinTransports>
    PEERS
  </rtps></participant>
</profiles></dds>)";

constexpr std::string_view kPeers =
    "<builtin><initialPeersList><locator><udpv4><address>127.0.0.1</address></udpv4></locator></initialPeersList>"
    "</builtin>";

double us(Clock::duration d) { return std::chrono::duration<double, std::micro>(d).count(); }

class Delays {
 public:
  void add(double value) { all_.push_back(value); }
  void write(ordered_json& line, const std::string& name) {
    if (all_.empty()) return;
    std::ranges::sort(all_);
    line[name + "_n"] = all_.size();
    line[name + "_p50_us"] = all_[all_.size() / 2];
    line[name + "_p99_us"] = all_[all_.size() * 99 / 100];
  }

 private:
  std::vector<double> all_;
};

void describe(ordered_json& line, const std::string& topic, const PoseStamped& pose) {
  for (std::size_t i = 0; i < 3; ++i) line[topic + "_" + "xyz"[i]] = pose.position[i];
  for (std::size_t i = 0; i < 4; ++i) line[topic + "_q" + "xyzw"[i]] = pose.orientation[i];
}
void describe(ordered_json& line, const std::string& topic, const TwoVectors& both) {
  for (std::size_t i = 0; i < 3; ++i) line[topic + "_" + "xyz"[i]] = both.first[i];
  for (std::size_t i = 0; i < 3; ++i) line[topic + "_r" + "xyz"[i]] = both.second[i];
}
void describe(ordered_json& line, const std::string& topic, const Joy& joy) {
  for (std::size_t i = 0; i < joy.axes.size(); ++i) line[topic + "_axis" + std::to_string(i)] = joy.axes[i];
  for (std::size_t i = 0; i < joy.buttons.size(); ++i) line[topic + "_button" + std::to_string(i)] = joy.buttons[i];
}
void describe(ordered_json& line, const std::string& topic, const JointState& joints) {
  line[topic + "_names"] = joints.name;
  line[topic + "_position"] = joints.position;
  line[topic + "_velocity"] = joints.velocity;
}
void describe(ordered_json& line, const std::string& topic, const DiagnosticArray& array) {
  for (const DiagnosticStatus& status : array.status) {
    line[topic + "_level"] = status.level;
    line[topic + "_name"] = status.name;
    line[topic + "_message"] = status.message;
    line[topic + "_values"] = status.values.size();
  }
}

class Reader {
 public:
  virtual ~Reader() = default;
  virtual void write(ordered_json& line, bool last) = 0;
};

/// The peer waits for these events on `wrench`: the force along y is toggled, and the force is zero.
struct Awaited {
  std::mutex mutex;
  double value = 0;
  Clock::time_point since{};
  bool waiting = false;
  Delays delays;
  std::optional<Clock::time_point> stopped;
  std::optional<Clock::duration> let_go;
};

template <class Message>
class ReaderOf final : public Reader, public dds::DataReaderListener {
 public:
  ReaderOf(std::string topic, Awaited& awaited) : topic_(std::move(topic)), awaited_(awaited) {}

  void on_data_available(dds::DataReader* reader) override {
    Message message;
    dds::SampleInfo info;
    while (reader->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      const auto now = std::chrono::system_clock::now().time_since_epoch();
      const auto stamp = std::chrono::seconds(message.header.sec) + std::chrono::nanoseconds(message.header.nanosec);
      const std::lock_guard lock(mutex_);
      if (count_++ == 0) {
        first_ = stamp;
        first_age_ = std::chrono::duration_cast<Clock::duration>(now - stamp);
      }
      if (stamp < newest_) ++back_;
      newest_ = stamp;
      ages_.add(us(std::chrono::duration_cast<Clock::duration>(now - stamp)));
      message_ = message;
      if constexpr (std::is_same_v<Message, WrenchStamped>) {
        const std::lock_guard lock_awaited(awaited_.mutex);
        if (awaited_.stopped && !awaited_.let_go && message.first == std::array<double, 3>{}) {
          awaited_.let_go = Clock::now() - *awaited_.stopped;
        }
        if (awaited_.waiting && std::abs(message.first[1] - awaited_.value) < 1e-6) {
          awaited_.waiting = false;
          awaited_.delays.add(us(Clock::now() - awaited_.since));
        }
      }
    }
  }

  void write(ordered_json& line, bool last) override {
    const std::lock_guard lock(mutex_);
    line[topic_ + "_n"] = count_;
    if (count_ == 0) return;
    line[topic_ + "_back"] = back_;
    line[topic_ + "_frame"] = message_.header.frame_id;
    line[topic_ + "_first_age_us"] = us(first_age_);
    line[topic_ + "_span_s"] = std::chrono::duration<double>(newest_ - first_).count();
    describe(line, topic_, message_);
    if (last) ages_.write(line, topic_ + "_age");
  }

 private:
  std::string topic_;
  Awaited& awaited_;
  std::mutex mutex_;
  std::uint64_t count_ = 0;
  std::uint64_t back_ = 0;  ///< number of messages that are older than the previous one
  std::chrono::nanoseconds first_{};
  std::chrono::nanoseconds newest_{};
  Clock::duration first_age_{};
  Message message_;
  Delays ages_;
};

struct Options {
  std::uint32_t domain = 0;
  std::string device = "device";
  std::vector<std::string> read;
  bool best_effort = false;
  bool all_transports = false;
  bool localhost_only = false;
  std::string write = "wrench_command";
  std::vector<double> wrench;
  std::string frame;
  double hz = 1000;
  double wrench_for_s = 1e9;
  bool toggle = false;
  double duration_s = 120;
};

class Peer {
 public:
  explicit Peer(const Options& options) : options_(options) {
    auto* factory = dds::DomainParticipantFactory::get_instance();
    std::string xml = kOnTheLoopback;
    xml.replace(xml.find("PEERS"), 5, options.localhost_only ? "" : kPeers);
    if (options.all_transports) {
      participant_ = factory->create_participant(options.domain, dds::PARTICIPANT_QOS_DEFAULT);
    } else {
      factory->load_XML_profiles_string(xml.data(), xml.size());
      participant_ = factory->create_participant_with_profile(options.domain, "loopback");
    }
    if (participant_ == nullptr) throw std::runtime_error("Fast DDS cannot create a participant");
    subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
    publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
    for (const std::string& topic : options.read) {
      if (topic == "diagnostics") {
        read<DiagnosticArray>(topic, "rt/diagnostics");
        continue;
      }
      const std::string path = path_of(topic);
      if (topic == "pose" || topic == "servo_pose" || topic == "measured_cp")
        read<PoseStamped>(topic, path);
      else if (topic == "twist" || topic == "servo_twist" || topic == "measured_cv")
        read<TwistStamped>(topic, path);
      else if (topic == "wrench" || topic == "measured_cf")
        read<WrenchStamped>(topic, path);
      else if (topic == "joy")
        read<Joy>(topic, path);
      else if (topic == "joint_states")
        read<JointState>(topic, path);
      else
        throw std::runtime_error("no topic " + topic);
    }
    if (!options.wrench.empty() || options.toggle) {
      dds::DataWriterQos qos = dds::DATAWRITER_QOS_DEFAULT;
      qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;  // the default of rclcpp
      qos.history().depth = 10;
      qos.publish_mode().kind = dds::SYNCHRONOUS_PUBLISH_MODE;
      writer_ = publisher_->create_datawriter(topic_of<WrenchStamped>(path_of(options.write)), qos);
    }
  }

  void run() {
    const auto start = Clock::now();
    const auto end = start + std::chrono::duration<double>(options_.duration_s);
    auto next_line = start;
    auto next_toggle = start + std::chrono::seconds(3);
    WrenchStamped wrench;
    wrench.header.frame_id = options_.frame;
    for (std::size_t i = 0; i < options_.wrench.size(); ++i) {
      (i < 3 ? wrench.first : wrench.second)[i % 3] = options_.wrench[i];
    }
    if (options_.toggle) wrench.first[1] = 0.2;
    for (auto now = start; now < end; now = Clock::now()) {
      if (writer_ != nullptr && std::chrono::duration<double>(now - start).count() < options_.wrench_for_s) {
        if (options_.toggle && now >= next_toggle) {
          wrench.first[1] = 0.5 - wrench.first[1];
          // not a multiple of the haptic period, so all phases occur
          next_toggle = now + std::chrono::microseconds(20'300);
          const std::lock_guard lock(awaited_.mutex);
          awaited_.value = wrench.first[1];
          awaited_.since = Clock::now();
          awaited_.waiting = true;
        }
        writer_->write(&wrench);
        ++written_;
        written_at_ = now;
      } else if (written_ > 0) {
        const std::lock_guard lock(awaited_.mutex);
        awaited_.stopped = written_at_;
      }
      if (now >= next_line) {
        say(false);
        next_line = now + std::chrono::milliseconds(100);
      }
      std::this_thread::sleep_until(now + std::chrono::duration<double>(1 / options_.hz));
    }
    say(true);
  }

  ~Peer() {
    participant_->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

 private:
  std::string path_of(const std::string& topic) const {
    const bool of_crtk = topic.starts_with("measured_") || topic == "servo_cf";
    return (of_crtk ? "rt/" : "rt/tendon/") + options_.device + "/" + topic;
  }

  template <class Message>
  dds::Topic* topic_of(const std::string& path) {
    dds::TypeSupport type(new Type<Message>);
    type.register_type(participant_);
    return participant_->create_topic(path, type.get_type_name(), dds::TOPIC_QOS_DEFAULT);
  }

  template <class Message>
  void read(const std::string& topic, const std::string& path) {
    dds::DataReaderQos qos = dds::DATAREADER_QOS_DEFAULT;
    qos.reliability().kind = options_.best_effort ? dds::BEST_EFFORT_RELIABILITY_QOS : dds::RELIABLE_RELIABILITY_QOS;
    qos.history().depth = 10;  // the default of rclcpp
    auto listener = std::make_unique<ReaderOf<Message>>(topic, awaited_);
    if (subscriber_->create_datareader(topic_of<Message>(path), qos, listener.get()) == nullptr) {
      throw std::runtime_error("Fast DDS cannot create a reader of " + path);
    }
    readers_.push_back(std::move(listener));
  }

  void say(bool last) {
    ordered_json line = {{"event", last ? "end" : "seen"}, {"written", written_}};
    for (const auto& reader : readers_) reader->write(line, last);
    const std::lock_guard lock(awaited_.mutex);
    if (awaited_.let_go) line["let_go_us"] = us(*awaited_.let_go);
    if (last) awaited_.delays.write(line, "round");
    std::cout << line << std::endl;
  }

  Options options_;
  dds::DomainParticipant* participant_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
  dds::DataWriter* writer_ = nullptr;
  std::uint64_t written_ = 0;
  Clock::time_point written_at_{};
  Awaited awaited_;
  std::vector<std::unique_ptr<Reader>> readers_;
};

int run(int argc, char** argv) {
  Options o;
  CLI::App app("The tests' other side of `tendon-bridge ros2`: a program on Fast DDS.", "fast_peer");
  app.add_option("--domain", o.domain);
  app.add_option("--device", o.device);
  app.add_option("--read", o.read,
                 "Topics: pose, twist, wrench, joy, joint_states, servo_twist, servo_pose, diagnostics, measured_cp, "
                 "measured_cv, measured_cf")
      ->delimiter(',');
  app.add_option("--write", o.write, "wrench_command or servo_cf");
  app.add_flag("--best-effort", o.best_effort, "Readers that ask for no more; else reliable ones");
  app.add_flag("--all-transports", o.all_transports, "As Fast DDS is without a profile; else UDP on the loopback");
  app.add_flag("--localhost-only", o.localhost_only, "As ROS_LOCALHOST_ONLY=1 makes it: nobody is asked by unicast");
  app.add_option("--wrench", o.wrench, "fx,fy,fz or fx,fy,fz,tx,ty,tz for wrench_command")->delimiter(',');
  app.add_option("--frame", o.frame, "frame_id of it");
  app.add_option("--hz", o.hz);
  app.add_option("--wrench-for-s", o.wrench_for_s);
  app.add_flag("--toggle", o.toggle, "Ask for 0.2 and 0.3 N along y in turn, and measure until `wrench` says so");
  app.add_option("--duration-s", o.duration_s);
  CLI11_PARSE(app, argc, argv);
  Peer(o).run();
  return 0;
}

}  // namespace
}  // namespace tendon::fast

int main(int argc, char** argv) {
  try {
    return tendon::fast::run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "fast_peer: " << error.what() << '\n';
    return 1;
  }
}
