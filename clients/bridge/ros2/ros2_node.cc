// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/ros2/ros2_node.h"

#include <dds/dds.h>
#include <ros2_types.h>
#include <ros2_types_text.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <deque>
#include <span>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include "clients/bridge/ros2/type_hash.h"

namespace tendon::bridge {
namespace {

using Topic = RosInput::Topic;

/// The participants of a machine use the first free index. ROS 2 creates a participant for each process.
constexpr int kMostParticipants = 100;

constexpr int kMostStateCommands = 10;  ///< the depth of the queue of crtk_python_client

std::string configuration(const Ros2Node::Config& config) {
  std::string interface = "address=\"127.0.0.1\"";
  std::string multicast = "false";
  std::vector<std::string> peers = config.peers;
  if (config.interface.empty()) {
    peers.emplace_back("127.0.0.1");
  } else {
    interface = "name=\"" + config.interface + "\"";
    multicast = "true";
  }
  std::string xml =
      "<CycloneDDS><Domain Id=\"any\"><General><Interfaces><NetworkInterface " + interface +
      "/></Interfaces><AllowMulticast>" + multicast +
      "</AllowMulticast></General><Discovery><SPDPInterval>1s</SPDPInterval><ParticipantIndex>auto</ParticipantIndex>"
      "<MaxAutoParticipantIndex>" +
      std::to_string(kMostParticipants - 1) + "</MaxAutoParticipantIndex><Peers>";
  for (const std::string& peer : peers) xml += "<Peer Address=\"" + peer + "\"/>";
  return xml + "</Peers></Discovery></Domain></CycloneDDS>";
}

dds_entity_t made(dds_entity_t entity, const std::string& what) {
  if (entity < 0) throw std::runtime_error("DDS cannot create a " + what + ": " + dds_strretcode(entity));
  return entity;
}

class Qos {
 public:
  Qos(const dds_topic_descriptor_t& type, dds_reliability_kind_t reliability, int depth) : qos_(dds_create_qos()) {
    static constexpr dds_data_representation_id_t kXcdr1 = DDS_DATA_REPRESENTATION_XCDR1;
    const std::string hash = "typehash=" + type_hash(kRos2Types, type.m_typename) + ";";
    dds_qset_userdata(qos_, hash.data(), hash.size());
    dds_qset_reliability(qos_, reliability, 0);
    dds_qset_history(qos_, DDS_HISTORY_KEEP_LAST, depth);
    dds_qset_durability(qos_, DDS_DURABILITY_VOLATILE);
    dds_qset_data_representation(qos_, 1, &kXcdr1);
  }
  ~Qos() { dds_delete_qos(qos_); }
  Qos(const Qos&) = delete;
  Qos& operator=(const Qos&) = delete;
  const dds_qos_t* get() const noexcept { return qos_; }

 private:
  dds_qos_t* qos_;
};

// ---- Conversion to the structures of DDS. They are only read during dds_write. --------------------------------

char* text_of(const std::string& text) { return const_cast<char*>(text.c_str()); }  // NOLINT: it only reads

template <class Sequence, class Element>
Sequence sequence_of(const std::vector<Element>& elements) {
  Sequence sequence{};
  sequence._maximum = sequence._length = static_cast<std::uint32_t>(elements.size());
  sequence._buffer = const_cast<Element*>(elements.data());  // NOLINT: it only reads
  sequence._release = false;
  return sequence;
}

std_msgs_msg_dds__Header_ dds_of(const RosHeader& header) {
  return {{header.stamp.sec, header.stamp.nanosec}, text_of(header.frame_id)};
}
geometry_msgs_msg_dds__Vector3_ dds_of(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

geometry_msgs_msg_dds__PoseStamped_ dds_of(const RosPose& pose) {
  const Quat& q = pose.orientation;
  return {dds_of(pose.header), {{pose.position.x(), pose.position.y(), pose.position.z()}, {q.x, q.y, q.z, q.w}}};
}
geometry_msgs_msg_dds__TwistStamped_ dds_of(const RosTwist& twist) {
  return {dds_of(twist.header), {dds_of(twist.linear), dds_of(twist.angular)}};
}
geometry_msgs_msg_dds__WrenchStamped_ dds_of(const RosWrench& wrench) {
  return {dds_of(wrench.header), {dds_of(wrench.force), dds_of(wrench.torque)}};
}
sensor_msgs_msg_dds__Joy_ dds_of(const RosJoy& joy) {
  sensor_msgs_msg_dds__Joy_ dds{};
  dds.header = dds_of(joy.header);
  dds.axes = sequence_of<decltype(dds.axes)>(joy.axes);
  dds.buttons = sequence_of<decltype(dds.buttons)>(joy.buttons);
  return dds;
}

crtk_msgs_msg_dds__OperatingState_ dds_of(const RosOperatingState& state) {
  return {dds_of(state.header), text_of(state.state), state.is_homed, state.is_busy};
}

std::string string_of(const char* text) { return text == nullptr ? "" : text; }

Vec3 vector_of(const geometry_msgs_msg_dds__Vector3_& v) { return {v.x, v.y, v.z}; }

RosInput input_of(Topic topic, const void* sample) {
  RosInput input;
  input.topic = topic;
  if (topic == Topic::kStateCommand) {
    input.text = string_of(static_cast<const crtk_msgs_msg_dds__StringStamped_*>(sample)->string);
  } else if (topic != Topic::kServoCp) {
    const auto& message = *static_cast<const geometry_msgs_msg_dds__WrenchStamped_*>(sample);
    input.wrench = {
        .header = {{message.header.stamp.sec, message.header.stamp.nanosec}, string_of(message.header.frame_id)},
        .force = vector_of(message.wrench.force),
        .torque = vector_of(message.wrench.torque)};
  }
  return input;
}

/// Returns "publisher" and the beginning of the GUID, which is unique for each program.
std::string name_of(const dds_guid_t& guid) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "publisher %02x%02x%02x%02x.%02x%02x%02x%02x.%02x%02x%02x%02x", guid.v[0],
                guid.v[1], guid.v[2], guid.v[3], guid.v[4], guid.v[5], guid.v[6], guid.v[7], guid.v[8], guid.v[9],
                guid.v[10], guid.v[11]);
  return text.data();
}

std::string called(dds_entity_t reader, dds_instance_handle_t writer) {
  dds_builtintopic_endpoint_t* about = dds_get_matched_publication_data(reader, writer);
  if (about == nullptr) return "a publisher";
  std::string name = name_of(about->participant_key);
  dds_builtintopic_free_endpoint(about);
  return name;
}

// ---- Shared with the threads of DDS ----------------------------------------------------------------------

class Bell {
 public:
  Bell() : descriptor_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    if (descriptor_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  }
  ~Bell() { ::close(descriptor_); }
  Bell(const Bell&) = delete;
  Bell& operator=(const Bell&) = delete;
  int descriptor() const noexcept { return descriptor_; }
  void ring() const noexcept { ::eventfd_write(descriptor_, 1); }
  void clear() const noexcept {
    eventfd_t count = 0;
    ::eventfd_read(descriptor_, &count);
  }

 private:
  int descriptor_;
};

struct Ears {
  explicit Ears(const Bell& of_all) : bell(of_all) {}
  const Bell& bell;
  std::atomic<std::uint64_t> arrived{0};
  std::atomic<bool> matched{false};
};

void on_data(dds_entity_t, void* ears) {
  auto& of_reader = *static_cast<Ears*>(ears);
  of_reader.arrived.fetch_add(1, std::memory_order_relaxed);
  of_reader.bell.ring();
}

void on_match(dds_entity_t, const dds_subscription_matched_status_t, void* ears) {
  auto& of_reader = *static_cast<Ears*>(ears);
  of_reader.matched.store(true, std::memory_order_release);
  of_reader.bell.ring();
}

}  // namespace

struct Ros2Node::State {
  struct Device {
    explicit Device(const Bell& bell) : ears(bell) {}
    dds_entity_t pose = 0;
    dds_entity_t twist = 0;
    dds_entity_t wrench = 0;
    dds_entity_t joy = 0;
    dds_entity_t joints = 0;
    dds_entity_t servo = 0;        ///< 0: none
    dds_entity_t measured_cp = 0;  ///< like the next three, 0 without CRTK
    dds_entity_t measured_cv = 0;
    dds_entity_t measured_cf = 0;
    dds_entity_t operating_state = 0;
    std::vector<std::pair<Topic, dds_entity_t>> readers;
    Ears ears;
    std::uint64_t taken = 0;
  };

  dds_entity_t topic(const std::string& name, const dds_topic_descriptor_t& type) const {
    return made(dds_create_topic(participant, &type, ("rt/" + name).c_str(), nullptr, nullptr), "topic " + name);
  }
  dds_entity_t writer(const std::string& name, const dds_topic_descriptor_t& type) const {
    const Qos qos(type, DDS_RELIABILITY_RELIABLE, 1);
    return made(dds_create_writer(participant, topic(name, type), qos.get(), nullptr), "writer of " + name);
  }
  void read(Device& device, Topic topic_read, const std::string& under, const dds_topic_descriptor_t& type) const {
    const bool each = topic_read == Topic::kStateCommand;
    const Qos qos(type, each ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, each ? kMostStateCommands : 1);
    const std::string name = under + std::string(topic_name(topic_read));
    dds_listener_t* listener = dds_create_listener(nullptr);
    dds_lset_data_available_arg(listener, on_data, &device.ears, true);
    dds_lset_subscription_matched_arg(listener, on_match, &device.ears, true);
    const dds_entity_t entity = dds_create_reader(participant, topic(name, type), qos.get(), listener);
    dds_delete_listener(listener);
    device.readers.emplace_back(topic_read, made(entity, "reader of " + name));
  }
  template <class Message>
  void write(dds_entity_t writer, const Message& message) {
    ++(dds_write(writer, &message) == DDS_RETCODE_OK ? published : unsent);
  }

  Bell bell;
  dds_entity_t domain = 0;
  dds_entity_t participant = 0;
  dds_entity_t diagnostics = 0;
  std::deque<Device> devices;
  std::uint64_t published = 0;
  std::uint64_t unsent = 0;
};

Ros2Node::Ros2Node(const Config& config) : state_(std::make_unique<State>()) {
  const std::string in_domain = "participant in domain " + std::to_string(config.domain) + " on " +
                                (config.interface.empty() ? "the loopback" : config.interface);
  state_->domain = made(dds_create_domain(config.domain, configuration(config).c_str()), in_domain);
  try {
    state_->participant = made(dds_create_participant(config.domain, nullptr, nullptr), in_domain);
    state_->diagnostics = state_->writer("diagnostics", diagnostic_msgs_msg_dds__DiagnosticArray__desc);
    for (const std::string& name : config.devices) {
      State::Device& device = state_->devices.emplace_back(state_->bell);
      const std::string under = "tendon/" + name + "/";
      device.pose = state_->writer(under + "pose", geometry_msgs_msg_dds__PoseStamped__desc);
      device.twist = state_->writer(under + "twist", geometry_msgs_msg_dds__TwistStamped__desc);
      device.wrench = state_->writer(under + "wrench", geometry_msgs_msg_dds__WrenchStamped__desc);
      device.joy = state_->writer(under + "joy", sensor_msgs_msg_dds__Joy__desc);
      device.joints = state_->writer(under + "joint_states", sensor_msgs_msg_dds__JointState__desc);
      if (config.servo == RosServo::Kind::kTwist) {
        device.servo = state_->writer(under + "servo_twist", geometry_msgs_msg_dds__TwistStamped__desc);
      } else if (config.servo == RosServo::Kind::kPose) {
        device.servo = state_->writer(under + "servo_pose", geometry_msgs_msg_dds__PoseStamped__desc);
      }
      state_->read(device, Topic::kWrenchCommand, under, geometry_msgs_msg_dds__WrenchStamped__desc);
      if (!config.crtk) continue;
      const std::string of_crtk = name + "/";
      device.measured_cp = state_->writer(of_crtk + "measured_cp", geometry_msgs_msg_dds__PoseStamped__desc);
      device.measured_cv = state_->writer(of_crtk + "measured_cv", geometry_msgs_msg_dds__TwistStamped__desc);
      device.measured_cf = state_->writer(of_crtk + "measured_cf", geometry_msgs_msg_dds__WrenchStamped__desc);
      device.operating_state = state_->writer(of_crtk + "operating_state", crtk_msgs_msg_dds__OperatingState__desc);
      state_->read(device, Topic::kServoCf, of_crtk, geometry_msgs_msg_dds__WrenchStamped__desc);
      state_->read(device, Topic::kServoCp, of_crtk, geometry_msgs_msg_dds__PoseStamped__desc);
      state_->read(device, Topic::kStateCommand, of_crtk, crtk_msgs_msg_dds__StringStamped__desc);
    }
  } catch (...) {
    dds_delete(state_->domain);
    throw;
  }
}

Ros2Node::~Ros2Node() { dds_delete(state_->domain); }

int Ros2Node::descriptor() const noexcept { return state_->bell.descriptor(); }
void Ros2Node::clear() { state_->bell.clear(); }

std::vector<RosInput> Ros2Node::take(std::size_t i) {
  State::Device& device = state_->devices[i];
  std::vector<RosInput> inputs;
  for (const auto& [topic, reader] : device.readers) {
    for (int reads = 0; reads < kMostStateCommands; ++reads) {
      std::array<void*, 1> samples{};
      std::array<dds_sample_info_t, 1> infos{};
      if (dds_take(reader, samples.data(), infos.data(), 1, 1) != 1) break;
      if (infos[0].valid_data) {
        ++device.taken;
        RosInput input = input_of(topic, samples[0]);
        input.writer = infos[0].publication_handle;
        input.called = called(reader, infos[0].publication_handle);
        const bool replaces = topic != Topic::kStateCommand && !inputs.empty() && inputs.back().topic == topic;
        if (replaces) inputs.pop_back();
        inputs.push_back(std::move(input));
      }
      dds_return_loan(reader, samples.data(), 1);
    }
  }
  return inputs;
}

std::optional<std::vector<std::uint64_t>> Ros2Node::writers_if_changed(std::size_t i) {
  State::Device& device = state_->devices[i];
  if (!device.ears.matched.exchange(false, std::memory_order_acq_rel)) return {};
  std::vector<std::uint64_t> writers;
  for (const auto& [topic, reader] : device.readers) {
    std::vector<std::uint64_t> of_reader;  // while it is empty, data() is null: DDS refuses a pointer with a size of 0
    for (;;) {
      const dds_return_t count = dds_get_matched_publications(reader, of_reader.data(), of_reader.size());
      const auto found = static_cast<std::size_t>(std::max(count, 0));
      const bool all = found <= of_reader.size();
      of_reader.resize(found);
      if (all) break;
    }
    writers.insert(writers.end(), of_reader.begin(), of_reader.end());
  }
  return writers;
}

void Ros2Node::publish(std::size_t i, const RosDevice::Messages& messages) {
  const State::Device& device = state_->devices[i];
  if (messages.pose) state_->write(device.pose, dds_of(*messages.pose));
  if (messages.twist) state_->write(device.twist, dds_of(*messages.twist));
  if (messages.wrench) state_->write(device.wrench, dds_of(*messages.wrench));
  if (device.measured_cp != 0) {
    if (messages.pose) state_->write(device.measured_cp, dds_of(*messages.pose));
    if (messages.twist) state_->write(device.measured_cv, dds_of(*messages.twist));
    if (messages.measured_cf) state_->write(device.measured_cf, dds_of(*messages.measured_cf));
    if (messages.operating_state) state_->write(device.operating_state, dds_of(*messages.operating_state));
  }
  if (messages.joy) state_->write(device.joy, dds_of(*messages.joy));
  if (messages.servo.twist) state_->write(device.servo, dds_of(*messages.servo.twist));
  if (messages.servo.pose) state_->write(device.servo, dds_of(*messages.servo.pose));
  if (messages.joints) {
    std::vector<char*> names;
    for (const std::string& name : messages.joints->name) names.push_back(text_of(name));
    sensor_msgs_msg_dds__JointState_ dds{};
    dds.header = dds_of(messages.joints->header);
    dds.name = sequence_of<decltype(dds.name)>(names);
    dds.position = sequence_of<decltype(dds.position)>(messages.joints->position);
    dds.velocity = sequence_of<decltype(dds.velocity)>(messages.joints->velocity);
    state_->write(device.joints, dds);
  }
}

void Ros2Node::publish(const std::vector<RosDiagnosis>& diagnoses, RosTime stamp) {
  std::deque<std::vector<diagnostic_msgs_msg_dds__KeyValue_>> values;
  std::vector<diagnostic_msgs_msg_dds__DiagnosticStatus_> status;
  for (const RosDiagnosis& one : diagnoses) {
    auto& of_one = values.emplace_back();
    for (const auto& [key, value] : one.values) of_one.push_back({text_of(key), text_of(value)});
    auto& dds = status.emplace_back();
    dds.level = static_cast<std::uint8_t>(one.level);
    dds.name = text_of(one.name);
    dds.message = text_of(one.message);
    dds.hardware_id = text_of(one.hardware_id);
    dds.values = sequence_of<decltype(dds.values)>(of_one);
  }
  const RosHeader header{stamp, {}};
  diagnostic_msgs_msg_dds__DiagnosticArray_ dds{};
  dds.header = dds_of(header);
  dds.status = sequence_of<decltype(dds.status)>(status);
  state_->write(state_->diagnostics, dds);
}

std::uint64_t Ros2Node::published() const noexcept { return state_->published; }
std::uint64_t Ros2Node::unsent() const noexcept { return state_->unsent; }

std::uint64_t Ros2Node::superseded() const noexcept {
  std::uint64_t all = 0;
  for (const State::Device& device : state_->devices) {
    const std::uint64_t arrived = device.ears.arrived.load(std::memory_order_relaxed);
    all += arrived > device.taken ? arrived - device.taken : 0;
  }
  return all;
}

}  // namespace tendon::bridge
