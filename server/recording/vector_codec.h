// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string_view>

#include "core/base/motion.h"
#include "recording.pb.h"

// Functions that are used by both recording_codec.cc and field_codec.cc.

namespace tendon::recording {

namespace pb = tendon::recording::v1;

inline void put(pb::Vec3* out, const Vec3& v) {
  out->set_x(v.x());
  out->set_y(v.y());
  out->set_z(v.z());
}

inline Vec3 vec3(const pb::Vec3& v) { return {v.x(), v.y(), v.z()}; }

inline void put(pb::Quat* out, const Quat& q) {
  out->set_w(q.w);
  out->set_x(q.x);
  out->set_y(q.y);
  out->set_z(q.z);
}

inline Quat quat(const pb::Quat& q) { return {q.w(), q.x(), q.y(), q.z()}; }

template <class Message>
Message parse(std::string_view bytes) {
  Message message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
    throw std::invalid_argument("the data are not a " + message.GetTypeName());
  return message;
}

}  // namespace tendon::recording
