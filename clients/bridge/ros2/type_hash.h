// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace tendon::bridge {

/// Returns the type hash of a ROS 2 message. ROS 2 Iron and later compare the hashes of a publisher and its subscribers.
///
///     hash = "RIHS01_" + hexadecimal digits of SHA-256({"type_description": …, "referenced_type_descriptions": […]})
///
/// The text is a type_description_interfaces/TypeDescription in JSON. The separators are ", " and ": ". It does not
/// contain default values and comments. All types that are used directly or indirectly are listed, sorted by name.
///
/// `idl` contains the definitions. Only the part of IDL that is used by ros2_types.idl is supported: modules, structs,
/// fields with the types of ROS, `sequence<T>` without a bound, and comments with //. `type` is the name of the type in
/// DDS, for example "std_msgs::msg::dds_::Header_".
///
/// Throws std::invalid_argument with the unknown word if `idl` or `type` is invalid.
///
/// Source: REP 2011 and REP 2016. Thread-safe: yes. Realtime-safe: no.
std::string type_hash(std::string_view idl, std::string_view type);

}  // namespace tendon::bridge
