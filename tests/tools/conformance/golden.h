// SPDX-License-Identifier: Apache-2.0
#pragma once

// Parts of protocol/vectors/golden.md that the kit sends unchanged. documents_test.cc compares them with plain.json.

namespace tendon::conformance::golden {

inline constexpr const char* kRandom = "a0a1a2a3a4a5a6a7a8a9aaabacadaeaf";
inline constexpr const char* kHello = "080110011802220477616c6c2a0b6c6f63616c2d6d6f64656c";
/// Frames: the state with tick 1000, and the control with id 7.
inline constexpr const char* kState =
    "0a5508e8071100ca9a3b000000001a12097b14ae47e17a843f197b14ae47e17a94bf220909000000000000e03f2a0909000000000000"
    "00c031000000000000d03f3900000000000020404503000000486350e0c65b5802";
inline constexpr const char* kControl = "1a070807120308f403";

}  // namespace tendon::conformance::golden
