// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/ros2/type_hash.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

namespace tendon::bridge::type_hash_test {
namespace {

std::string definitions() {
  std::ifstream file(TENDON_SOURCE_DIR "/clients/bridge/ros2/ros2_types.idl");
  return {std::istreambuf_iterator<char>(file), {}};
}

/// As printed by `ros2 topic info --verbose` of ROS 2 Jazzy, from public code.
TEST(TypeHash, IsThatOfRos2) {
  const std::string idl = definitions();
  const auto expect = [&](const char* type, const char* hash) {
    EXPECT_EQ(type_hash(idl, type), std::string("RIHS01_") + hash) << type;
  };
  expect("builtin_interfaces::msg::dds_::Time_", "b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197");
  expect("std_msgs::msg::dds_::Header_", "f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01");
  expect("geometry_msgs::msg::dds_::PoseStamped_", "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8");
  expect("geometry_msgs::msg::dds_::TwistStamped_", "5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64");
  expect("geometry_msgs::msg::dds_::WrenchStamped_",
         "8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77");
  expect("sensor_msgs::msg::dds_::Joy_", "0d356c79cad3401e35ffeb75a96a96e08be3ef896b8b83841d73e890989372c5");
  expect("sensor_msgs::msg::dds_::JointState_", "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e");
  expect("diagnostic_msgs::msg::dds_::DiagnosticArray_",
         "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e");
  EXPECT_EQ(type_hash("module std_msgs { module msg { module dds_ { struct Bool_ { boolean data; }; }; }; };",
                      "std_msgs::msg::dds_::Bool_"),
            "RIHS01_feb91e995ff9ebd09c0cb3d2aed18b11077585839fb5db80193b62d74528f6c9");
}

TEST(TypeHash, DependsOnNamesTypesAndOrderOfTheFields) {
  const auto of = [](const std::string& fields) {
    return type_hash("module a { module msg { module dds_ { struct B_ {" + fields + "}; }; }; };  // end",
                     "a::msg::dds_::B_");
  };
  const std::string hash = of("long x; sequence<double> y;");
  EXPECT_EQ(of("long x;  // a comment; long z;\n sequence<double>  y ;"), hash);
  EXPECT_NE(of("long x2; sequence<double> y;"), hash);
  EXPECT_NE(of("unsigned long x; sequence<double> y;"), hash);
  EXPECT_NE(of("long x; double y;"), hash);
  EXPECT_NE(of("sequence<double> y; long x;"), hash);
  EXPECT_EQ(of("string _string;").size(), std::string("RIHS01_").size() + 64);
}

TEST(TypeHash, RefusesWhatItDoesNotKnowWithTheWord) {
  const auto refusal = [](const std::string& idl, const std::string& type = "a::msg::dds_::B_") -> std::string {
    try {
      return type_hash(idl, type);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
  };
  const std::string before = "module a { module msg { module dds_ { ";
  EXPECT_EQ(refusal(""), "IDL: expected a type that is defined, got \"a/msg/B\"");
  EXPECT_EQ(refusal("", "a/B"), "IDL: expected the name of a message, PKG::msg::dds_::NAME_, got \"a/B\"");
  EXPECT_EQ(refusal("enum"), "IDL: expected module or struct, got \"enum\"");
  EXPECT_EQ(refusal(before), "IDL: expected module or struct, got \"the end\"");
  EXPECT_EQ(refusal(before + "struct B_ { long; }; }; }; };"), "IDL: expected a type and a name, got \"long\"");
  EXPECT_EQ(refusal(before + "struct B_ { C_ c; }; }; }; };"), "IDL: expected a type that is defined, got \"a/msg/C\"");
  EXPECT_EQ(refusal(before + "struct B_ { sequence long> c; }; }; }; };"), "IDL: expected <, got \"long\"");
}

}  // namespace
}  // namespace tendon::bridge::type_hash_test
