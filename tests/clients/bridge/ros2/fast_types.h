// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>

#include <array>
#include <cstdint>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace tendon::fast {

// These types were written from the definitions in the ROS packages, independently of clients/bridge/ros2. `each`
// visits the fields in the order of the wire format.

struct Header {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  std::string frame_id;
  template <class Visit>
  void each(Visit&& visit) {
    visit(sec), visit(nanosec), visit(frame_id);
  }
};

struct PoseStamped {
  static constexpr const char* kName = "geometry_msgs::msg::dds_::PoseStamped_";
  Header header;
  std::array<double, 3> position{};
  std::array<double, 4> orientation{};  ///< x y z w
  template <class Visit>
  void each(Visit&& visit) {
    header.each(visit), visit(position), visit(orientation);
  }
};

struct TwoVectors {
  Header header;
  std::array<double, 3> first{};
  std::array<double, 3> second{};
  template <class Visit>
  void each(Visit&& visit) {
    header.each(visit), visit(first), visit(second);
  }
};
struct TwistStamped : TwoVectors {
  static constexpr const char* kName = "geometry_msgs::msg::dds_::TwistStamped_";
};
struct WrenchStamped : TwoVectors {
  static constexpr const char* kName = "geometry_msgs::msg::dds_::WrenchStamped_";
};

struct Joy {
  static constexpr const char* kName = "sensor_msgs::msg::dds_::Joy_";
  Header header;
  std::vector<float> axes;
  std::vector<std::int32_t> buttons;
  template <class Visit>
  void each(Visit&& visit) {
    header.each(visit), visit(axes), visit(buttons);
  }
};

struct JointState {
  static constexpr const char* kName = "sensor_msgs::msg::dds_::JointState_";
  Header header;
  std::vector<std::string> name;
  std::vector<double> position, velocity, effort;
  template <class Visit>
  void each(Visit&& visit) {
    header.each(visit), visit(name), visit(position), visit(velocity), visit(effort);
  }
};

template <class Element, class Visit>
void each_of(std::vector<Element>& elements, Visit& visit) {
  auto count = static_cast<std::uint32_t>(elements.size());
  visit(count);
  elements.resize(count);
  for (Element& element : elements) element.each(visit);
}

struct KeyValue {
  std::string key, value;
  template <class Visit>
  void each(Visit&& visit) {
    visit(key), visit(value);
  }
};
struct DiagnosticStatus {
  std::uint8_t level = 0;
  std::string name, message, hardware_id;
  std::vector<KeyValue> values;
  template <class Visit>
  void each(Visit&& visit) {
    visit(level), visit(name), visit(message), visit(hardware_id), each_of(values, visit);
  }
};
struct DiagnosticArray {
  static constexpr const char* kName = "diagnostic_msgs::msg::dds_::DiagnosticArray_";
  Header header;
  std::vector<DiagnosticStatus> status;
  template <class Visit>
  void each(Visit&& visit) {
    header.each(visit), each_of(status, visit);
  }
};

template <class Message>
class Type : public eprosima::fastdds::dds::TopicDataType {
  using Payload = eprosima::fastrtps::rtps::SerializedPayload_t;
  using Cdr = eprosima::fastcdr::Cdr;

 public:
  Type() {
    setName(Message::kName);
    m_typeSize = 16384;
    m_isGetKeyDefined = false;
  }
  bool serialize(void* data, Payload* payload) override {
    eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->max_size);
    Cdr cdr(buffer, Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR);
    payload->encapsulation = CDR_LE;
    cdr.serialize_encapsulation();
    static_cast<Message*>(data)->each([&cdr](auto& field) { cdr << field; });
    payload->length = static_cast<std::uint32_t>(cdr.getSerializedDataLength());
    return true;
  }
  bool deserialize(Payload* payload, void* data) override {
    eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->length);
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    cdr.read_encapsulation();
    static_cast<Message*>(data)->each([&cdr](auto& field) { cdr >> field; });
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void*) override {
    return [this] { return m_typeSize; };
  }
  void* createData() override { return new Message; }
  void deleteData(void* data) override { delete static_cast<Message*>(data); }
  bool getKey(void*, eprosima::fastrtps::rtps::InstanceHandle_t*, bool) override { return false; }
};

}  // namespace tendon::fast
