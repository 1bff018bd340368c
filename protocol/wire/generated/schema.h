// SPDX-License-Identifier: Apache-2.0
// Generated from tendon.proto by protocol/generate.
#pragma once

#include <array>

#include "protocol/wire/any_order.h"

// The schema of each message, for AnyOrder.

namespace tendon::wire::schema {

inline constexpr std::array kEchoShapes = {FieldShape{1, Shape::kBits64}, FieldShape{2, Shape::kBits64},
                                           FieldShape{3, Shape::kCount64}, FieldShape{4, Shape::kBits32}};
inline constexpr Schema kEcho{kEchoShapes};

inline constexpr std::array kVec3Shapes = {FieldShape{1, Shape::kBits64}, FieldShape{2, Shape::kBits64},
                                           FieldShape{3, Shape::kBits64}};
inline constexpr Schema kVec3{kVec3Shapes};

inline constexpr std::array kQuatShapes = {FieldShape{1, Shape::kBits64}, FieldShape{2, Shape::kBits64},
                                           FieldShape{3, Shape::kBits64}, FieldShape{4, Shape::kBits64}};
inline constexpr Schema kQuat{kQuatShapes};

inline constexpr std::array kDeviceStateShapes = {
    FieldShape{1, Shape::kCount64},          FieldShape{2, Shape::kBits64},
    FieldShape{3, Shape::kMessage, &kVec3},  FieldShape{4, Shape::kMessage, &kVec3},
    FieldShape{5, Shape::kMessage, &kVec3},  FieldShape{6, Shape::kBits64},
    FieldShape{7, Shape::kBits64},           FieldShape{8, Shape::kBits32},
    FieldShape{9, Shape::kCount64},          FieldShape{10, Shape::kCount64},
    FieldShape{11, Shape::kCount32},         FieldShape{12, Shape::kCount32},
    FieldShape{13, Shape::kCount32},         FieldShape{14, Shape::kMessage, &kVec3},
    FieldShape{15, Shape::kMessage, &kQuat}, FieldShape{16, Shape::kMessage, &kVec3},
    FieldShape{17, Shape::kBits32},          FieldShape{18, Shape::kMessage, &kVec3},
    FieldShape{19, Shape::kBits64},          FieldShape{20, Shape::kBits64},
    FieldShape{21, Shape::kBits64},          FieldShape{22, Shape::kMessage, &kVec3},
    FieldShape{23, Shape::kBits64s},         FieldShape{24, Shape::kBits64s},
    FieldShape{25, Shape::kBits64s},         FieldShape{26, Shape::kCount32},
    FieldShape{27, Shape::kBits64},          FieldShape{28, Shape::kMessage, &kVec3}};
inline constexpr Schema kDeviceState{kDeviceStateShapes};

inline constexpr std::array kForceTableShapes = {FieldShape{1, Shape::kBits64}, FieldShape{2, Shape::kBits64},
                                                 FieldShape{3, Shape::kBits64s}};
inline constexpr Schema kForceTable{kForceTableShapes};

inline constexpr std::array kContactShapes = {FieldShape{1, Shape::kMessage, &kVec3}, FieldShape{2, Shape::kBits64},
                                              FieldShape{3, Shape::kMessage, &kForceTable}};
inline constexpr Schema kContact{kContactShapes};

inline constexpr std::array kLocalModelShapes = {FieldShape{1, Shape::kMessage, &kVec3}, FieldShape{2, Shape::kBits64s},
                                                 FieldShape{3, Shape::kBits64},
                                                 FieldShape{4, Shape::kMessage, &kContact}};
inline constexpr Schema kLocalModel{kLocalModelShapes};

inline constexpr std::array kRotationModelShapes = {FieldShape{1, Shape::kMessage, &kQuat},
                                                    FieldShape{2, Shape::kBits64s}};
inline constexpr Schema kRotationModel{kRotationModelShapes};

inline constexpr std::array kForceCommandShapes = {
    FieldShape{1, Shape::kCount64},         FieldShape{2, Shape::kCount64},
    FieldShape{3, Shape::kMessage, &kVec3}, FieldShape{4, Shape::kMessage, &kLocalModel},
    FieldShape{5, Shape::kCount32},         FieldShape{6, Shape::kCount32},
    FieldShape{7, Shape::kCount32},         FieldShape{8, Shape::kFlag},
    FieldShape{9, Shape::kBits64},          FieldShape{10, Shape::kMessage, &kVec3},
    FieldShape{11, Shape::kBits64},         FieldShape{14, Shape::kMessage, &kRotationModel},
    FieldShape{15, Shape::kCount32},        FieldShape{16, Shape::kCount32}};
inline constexpr Schema kForceCommand{kForceCommandShapes};

inline constexpr std::array kSetStateRateShapes = {FieldShape{1, Shape::kCount32}, FieldShape{2, Shape::kCount32}};
inline constexpr Schema kSetStateRate{kSetStateRateShapes};

inline constexpr std::array kRearmShapes = {FieldShape{1, Shape::kCount32}};
inline constexpr Schema kRearm{kRearmShapes};

inline constexpr std::array kDescribeShapes = {FieldShape{1, Shape::kCount32}, FieldShape{2, Shape::kFlag}};
inline constexpr Schema kDescribe{kDescribeShapes};

inline constexpr std::array kTakeLeaseShapes = {FieldShape{1, Shape::kCount32}, FieldShape{2, Shape::kCount32}};
inline constexpr Schema kTakeLease{kTakeLeaseShapes};

inline constexpr std::array kGiveLeaseShapes = {FieldShape{1, Shape::kCount32}, FieldShape{2, Shape::kCount32}};
inline constexpr Schema kGiveLease{kGiveLeaseShapes};

inline constexpr std::array kLeaseLostShapes = {FieldShape{1, Shape::kCount32}, FieldShape{2, Shape::kCount32},
                                                FieldShape{3, Shape::kText}};
inline constexpr Schema kLeaseLost{kLeaseLostShapes};

inline constexpr std::array kSetStateDeadbandShapes = {FieldShape{1, Shape::kBits64}, FieldShape{2, Shape::kBits64},
                                                       FieldShape{3, Shape::kCount32}};
inline constexpr Schema kSetStateDeadband{kSetStateDeadbandShapes};

inline constexpr std::array kDisarmShapes = {FieldShape{1, Shape::kCount32}};
inline constexpr Schema kDisarm{kDisarmShapes};

inline constexpr std::array kVibrationShapes = {FieldShape{1, Shape::kBits64}, FieldShape{2, Shape::kBits64},
                                                FieldShape{3, Shape::kCount32}};
inline constexpr Schema kVibration{kVibrationShapes};

inline constexpr std::array kSetOutputShapes = {FieldShape{1, Shape::kCount32}, FieldShape{2, Shape::kCount32},
                                                FieldShape{3, Shape::kBits32, nullptr, true},
                                                FieldShape{4, Shape::kMessage, &kVibration, true}};
inline constexpr Schema kSetOutput{kSetOutputShapes};

inline constexpr std::array kRateControlShapes = {FieldShape{1, Shape::kBits64}, FieldShape{2, Shape::kBits64},
                                                  FieldShape{3, Shape::kBits64}};
inline constexpr Schema kRateControl{kRateControlShapes};

inline constexpr std::array kCoupleShapes = {FieldShape{1, Shape::kCount32},
                                             FieldShape{2, Shape::kCount32},
                                             FieldShape{3, Shape::kCount32},
                                             FieldShape{4, Shape::kCount32},
                                             FieldShape{5, Shape::kBits64},
                                             FieldShape{6, Shape::kBits64},
                                             FieldShape{7, Shape::kMessage, &kQuat},
                                             FieldShape{8, Shape::kCount32},
                                             FieldShape{9, Shape::kBits64},
                                             FieldShape{10, Shape::kBits64},
                                             FieldShape{11, Shape::kBits64},
                                             FieldShape{12, Shape::kFlag},
                                             FieldShape{13, Shape::kFlag},
                                             FieldShape{14, Shape::kCount32},
                                             FieldShape{15, Shape::kFlag},
                                             FieldShape{16, Shape::kBits64},
                                             FieldShape{17, Shape::kBits64},
                                             FieldShape{18, Shape::kBits64},
                                             FieldShape{19, Shape::kBits64},
                                             FieldShape{20, Shape::kBits64},
                                             FieldShape{21, Shape::kMessage, &kRateControl}};
inline constexpr Schema kCouple{kCoupleShapes};

inline constexpr std::array kEngageShapes = {FieldShape{1, Shape::kCount32}};
inline constexpr Schema kEngage{kEngageShapes};

inline constexpr std::array kDisengageShapes = {FieldShape{1, Shape::kCount32}};
inline constexpr Schema kDisengage{kDisengageShapes};

inline constexpr std::array kSetScaleShapes = {FieldShape{1, Shape::kCount32}, FieldShape{2, Shape::kBits64},
                                               FieldShape{3, Shape::kBits64}};
inline constexpr Schema kSetScale{kSetScaleShapes};

inline constexpr std::array kSetShareShapes = {FieldShape{1, Shape::kCount32}, FieldShape{2, Shape::kCount32},
                                               FieldShape{3, Shape::kBits64}};
inline constexpr Schema kSetShare{kSetShareShapes};

inline constexpr std::array kOfferFieldShapes = {FieldShape{1, Shape::kBytes}, FieldShape{2, Shape::kCount32},
                                                 FieldShape{3, Shape::kCount32}, FieldShape{4, Shape::kBytes}};
inline constexpr Schema kOfferField{kOfferFieldShapes};

inline constexpr std::array kFieldMaterialShapes = {FieldShape{1, Shape::kBits64}, FieldShape{2, Shape::kBits64},
                                                    FieldShape{3, Shape::kBits64}, FieldShape{4, Shape::kBits64}};
inline constexpr Schema kFieldMaterial{kFieldMaterialShapes};

inline constexpr std::array kFieldFixtureShapes = {
    FieldShape{1, Shape::kCount32}, FieldShape{2, Shape::kMessage, &kVec3}, FieldShape{3, Shape::kMessage, &kVec3},
    FieldShape{4, Shape::kBits64}, FieldShape{5, Shape::kBits64}};
inline constexpr Schema kFieldFixture{kFieldFixtureShapes};

inline constexpr std::array kFieldDepthTableShapes = {FieldShape{1, Shape::kCount32}, FieldShape{2, Shape::kBits64},
                                                      FieldShape{3, Shape::kBits64s}};
inline constexpr Schema kFieldDepthTable{kFieldDepthTableShapes};

inline constexpr std::array kUseFieldShapes = {FieldShape{1, Shape::kCount32},
                                               FieldShape{2, Shape::kCount32},
                                               FieldShape{3, Shape::kCount32},
                                               FieldShape{4, Shape::kBytes},
                                               FieldShape{5, Shape::kMessages, &kFieldMaterial},
                                               FieldShape{6, Shape::kMessages, &kFieldFixture},
                                               FieldShape{7, Shape::kMessages, &kFieldDepthTable}};
inline constexpr Schema kUseField{kUseFieldShapes};

inline constexpr std::array kDropFieldShapes = {FieldShape{1, Shape::kBytes}};
inline constexpr Schema kDropField{kDropFieldShapes};

inline constexpr std::array kControlShapes = {FieldShape{1, Shape::kCount32},
                                              FieldShape{2, Shape::kMessage, &kSetStateRate, true},
                                              FieldShape{3, Shape::kMessage, &kRearm, true},
                                              FieldShape{4, Shape::kMessage, &kDescribe, true},
                                              FieldShape{5, Shape::kMessage, &kTakeLease, true},
                                              FieldShape{6, Shape::kMessage, &kGiveLease, true},
                                              FieldShape{7, Shape::kMessage, &kLeaseLost, true},
                                              FieldShape{8, Shape::kMessage, &kSetStateDeadband, true},
                                              FieldShape{9, Shape::kMessage, &kDisarm, true},
                                              FieldShape{10, Shape::kMessage, &kSetOutput, true},
                                              FieldShape{11, Shape::kMessage, &kCouple, true},
                                              FieldShape{12, Shape::kMessage, &kEngage, true},
                                              FieldShape{13, Shape::kMessage, &kDisengage, true},
                                              FieldShape{14, Shape::kMessage, &kSetScale, true},
                                              FieldShape{15, Shape::kMessage, &kSetShare, true},
                                              FieldShape{16, Shape::kMessage, &kOfferField, true},
                                              FieldShape{17, Shape::kMessage, &kUseField, true},
                                              FieldShape{18, Shape::kMessage, &kDropField, true}};
inline constexpr Schema kControl{kControlShapes};

inline constexpr std::array kChannelDescriptionShapes = {FieldShape{1, Shape::kText}, FieldShape{2, Shape::kCount32},
                                                         FieldShape{3, Shape::kCount32}, FieldShape{4, Shape::kText}};
inline constexpr Schema kChannelDescription{kChannelDescriptionShapes};

inline constexpr std::array kDeviceDescriptionShapes = {FieldShape{1, Shape::kCount32},
                                                        FieldShape{2, Shape::kText},
                                                        FieldShape{3, Shape::kText},
                                                        FieldShape{4, Shape::kCount32},
                                                        FieldShape{5, Shape::kCount32},
                                                        FieldShape{6, Shape::kMessage, &kVec3},
                                                        FieldShape{7, Shape::kMessage, &kVec3},
                                                        FieldShape{8, Shape::kBits64},
                                                        FieldShape{9, Shape::kBits64},
                                                        FieldShape{10, Shape::kBits64},
                                                        FieldShape{11, Shape::kBits64},
                                                        FieldShape{12, Shape::kCount32},
                                                        FieldShape{13, Shape::kMessages, &kChannelDescription}};
inline constexpr Schema kDeviceDescription{kDeviceDescriptionShapes};

inline constexpr std::array kOutputDescriptionShapes = {FieldShape{1, Shape::kText}, FieldShape{2, Shape::kCount32}};
inline constexpr Schema kOutputDescription{kOutputDescriptionShapes};

inline constexpr std::array kHandleDescriptionShapes = {FieldShape{1, Shape::kCount32},
                                                        FieldShape{2, Shape::kMessage, &kQuat},
                                                        FieldShape{3, Shape::kTexts},
                                                        FieldShape{4, Shape::kFlag},
                                                        FieldShape{5, Shape::kBits64},
                                                        FieldShape{6, Shape::kBits64},
                                                        FieldShape{7, Shape::kBits64},
                                                        FieldShape{8, Shape::kText},
                                                        FieldShape{9, Shape::kCount32},
                                                        FieldShape{10, Shape::kTexts},
                                                        FieldShape{11, Shape::kMessages, &kOutputDescription}};
inline constexpr Schema kHandleDescription{kHandleDescriptionShapes};

inline constexpr std::array kControlAckShapes = {FieldShape{1, Shape::kCount32},
                                                 FieldShape{2, Shape::kCount32},
                                                 FieldShape{3, Shape::kText},
                                                 FieldShape{4, Shape::kCount32},
                                                 FieldShape{5, Shape::kMessage, &kDeviceDescription},
                                                 FieldShape{6, Shape::kMessage, &kHandleDescription}};
inline constexpr Schema kControlAck{kControlAckShapes};

inline constexpr std::array kByeShapes = {FieldShape{1, Shape::kCount32}, FieldShape{2, Shape::kText}};
inline constexpr Schema kBye{kByeShapes};

inline constexpr std::array kDelaysShapes = {FieldShape{1, Shape::kCount64}, FieldShape{2, Shape::kCount64}};
inline constexpr Schema kDelays{kDelaysShapes};

inline constexpr std::array kLinkReportShapes = {FieldShape{1, Shape::kCount64},
                                                 FieldShape{2, Shape::kBits64},
                                                 FieldShape{3, Shape::kCount64},
                                                 FieldShape{4, Shape::kCount64},
                                                 FieldShape{5, Shape::kCount64},
                                                 FieldShape{6, Shape::kCount64},
                                                 FieldShape{7, Shape::kCount64},
                                                 FieldShape{8, Shape::kCount64},
                                                 FieldShape{9, Shape::kCount64},
                                                 FieldShape{10, Shape::kMessage, &kDelays},
                                                 FieldShape{11, Shape::kMessage, &kDelays},
                                                 FieldShape{12, Shape::kMessage, &kDelays},
                                                 FieldShape{13, Shape::kCount64},
                                                 FieldShape{14, Shape::kBits64},
                                                 FieldShape{15, Shape::kCount64},
                                                 FieldShape{16, Shape::kCount64},
                                                 FieldShape{17, Shape::kCount64},
                                                 FieldShape{18, Shape::kCount64},
                                                 FieldShape{19, Shape::kCount64},
                                                 FieldShape{20, Shape::kText},
                                                 FieldShape{21, Shape::kCount64},
                                                 FieldShape{22, Shape::kCount64},
                                                 FieldShape{23, Shape::kCount64},
                                                 FieldShape{24, Shape::kCount64},
                                                 FieldShape{25, Shape::kCount64}};
inline constexpr Schema kLinkReport{kLinkReportShapes};

inline constexpr std::array kDeviceReportShapes = {
    FieldShape{1, Shape::kCount64},  FieldShape{2, Shape::kBits64},  FieldShape{3, Shape::kCount64},
    FieldShape{4, Shape::kCount32},  FieldShape{5, Shape::kCount64}, FieldShape{6, Shape::kCount64},
    FieldShape{7, Shape::kCount64},  FieldShape{8, Shape::kCount64}, FieldShape{9, Shape::kCount64s},
    FieldShape{10, Shape::kCount32}, FieldShape{11, Shape::kText},   FieldShape{12, Shape::kText}};
inline constexpr Schema kDeviceReport{kDeviceReportShapes};

inline constexpr std::array kPeerReportShapes = {
    FieldShape{1, Shape::kCount32}, FieldShape{2, Shape::kCount32}, FieldShape{3, Shape::kText},
    FieldShape{4, Shape::kCount32}, FieldShape{5, Shape::kFlag},    FieldShape{6, Shape::kMessage, &kLinkReport},
    FieldShape{7, Shape::kBits64},  FieldShape{8, Shape::kText}};
inline constexpr Schema kPeerReport{kPeerReportShapes};

inline constexpr std::array kPortSurfaceShapes = {FieldShape{1, Shape::kMessage, &kVec3}, FieldShape{2, Shape::kBits64},
                                                  FieldShape{3, Shape::kBits64}};
inline constexpr Schema kPortSurface{kPortSurfaceShapes};

inline constexpr std::array kPortTurnShapes = {FieldShape{1, Shape::kMessage, &kQuat},
                                               FieldShape{2, Shape::kMessage, &kVec3},
                                               FieldShape{3, Shape::kMessage, &kVec3}};
inline constexpr Schema kPortTurn{kPortTurnShapes};

inline constexpr std::array kPortGripShapes = {FieldShape{1, Shape::kBits64}, FieldShape{2, Shape::kBits64},
                                               FieldShape{3, Shape::kBits64}, FieldShape{4, Shape::kBits64},
                                               FieldShape{5, Shape::kBits64}, FieldShape{6, Shape::kBits64},
                                               FieldShape{7, Shape::kBits64}};
inline constexpr Schema kPortGrip{kPortGripShapes};

inline constexpr std::array kPortStateShapes = {FieldShape{1, Shape::kCount32},
                                                FieldShape{2, Shape::kCount32},
                                                FieldShape{3, Shape::kCount64},
                                                FieldShape{4, Shape::kCount64},
                                                FieldShape{5, Shape::kCount64},
                                                FieldShape{6, Shape::kCount64},
                                                FieldShape{7, Shape::kBits64},
                                                FieldShape{8, Shape::kCount64},
                                                FieldShape{9, Shape::kCount32},
                                                FieldShape{10, Shape::kCount64},
                                                FieldShape{11, Shape::kBits32},
                                                FieldShape{12, Shape::kMessage, &kVec3},
                                                FieldShape{13, Shape::kMessage, &kVec3},
                                                FieldShape{14, Shape::kMessage, &kVec3},
                                                FieldShape{15, Shape::kMessage, &kVec3},
                                                FieldShape{16, Shape::kBits64},
                                                FieldShape{17, Shape::kBits64},
                                                FieldShape{18, Shape::kBits64},
                                                FieldShape{19, Shape::kBits64},
                                                FieldShape{20, Shape::kMessage, &kVec3},
                                                FieldShape{21, Shape::kBits64},
                                                FieldShape{22, Shape::kMessage, &kPortSurface},
                                                FieldShape{23, Shape::kMessage, &kPortTurn},
                                                FieldShape{24, Shape::kMessage, &kPortGrip},
                                                FieldShape{25, Shape::kBits64},
                                                FieldShape{26, Shape::kBits64},
                                                FieldShape{27, Shape::kBits64},
                                                FieldShape{28, Shape::kBits64},
                                                FieldShape{29, Shape::kFlag}};
inline constexpr Schema kPortState{kPortStateShapes};

inline constexpr std::array kDeviceStatesShapes = {
    FieldShape{1, Shape::kCount64},   FieldShape{2, Shape::kBits64},    FieldShape{3, Shape::kCount32},
    FieldShape{4, Shape::kBits64s},   FieldShape{5, Shape::kBits32s},   FieldShape{6, Shape::kBits32s},
    FieldShape{7, Shape::kBits32s},   FieldShape{8, Shape::kBits32s},   FieldShape{9, Shape::kCount32s},
    FieldShape{10, Shape::kCount32s}, FieldShape{11, Shape::kCount64s}, FieldShape{12, Shape::kCount64s},
    FieldShape{13, Shape::kCount32s}, FieldShape{14, Shape::kCount32s}};
inline constexpr Schema kDeviceStates{kDeviceStatesShapes};

inline constexpr std::array kFieldBrickShapes = {FieldShape{1, Shape::kBytes}, FieldShape{2, Shape::kBytes}};
inline constexpr Schema kFieldBrick{kFieldBrickShapes};

inline constexpr std::array kFieldStatusShapes = {FieldShape{1, Shape::kBytes}, FieldShape{2, Shape::kBytes}};
inline constexpr Schema kFieldStatus{kFieldStatusShapes};

inline constexpr std::array kFieldPoseShapes = {
    FieldShape{1, Shape::kCount32},         FieldShape{2, Shape::kCount32},
    FieldShape{3, Shape::kCount64},         FieldShape{4, Shape::kBits64},
    FieldShape{5, Shape::kMessage, &kVec3}, FieldShape{6, Shape::kMessage, &kQuat},
    FieldShape{7, Shape::kMessage, &kVec3}, FieldShape{8, Shape::kMessage, &kVec3}};
inline constexpr Schema kFieldPose{kFieldPoseShapes};

inline constexpr std::array kFrameShapes = {
    FieldShape{1, Shape::kMessage, &kDeviceState, true},  FieldShape{2, Shape::kMessage, &kForceCommand, true},
    FieldShape{3, Shape::kMessage, &kControl, true},      FieldShape{4, Shape::kMessage, &kControlAck, true},
    FieldShape{5, Shape::kMessage, &kBye, true},          FieldShape{6, Shape::kMessage, &kLinkReport, true},
    FieldShape{7, Shape::kMessage, &kDeviceReport, true}, FieldShape{8, Shape::kMessage, &kPeerReport, true},
    FieldShape{9, Shape::kMessage, &kPortState, true},    FieldShape{10, Shape::kMessage, &kDeviceStates, true},
    FieldShape{11, Shape::kMessage, &kFieldBrick, true},  FieldShape{12, Shape::kMessage, &kFieldStatus, true},
    FieldShape{13, Shape::kMessage, &kFieldPose, true}};
inline constexpr Schema kFrame{kFrameShapes};

inline constexpr std::array kDatagramShapes = {FieldShape{1, Shape::kBits64}, FieldShape{2, Shape::kMessage, &kEcho},
                                               FieldShape{3, Shape::kMessages, &kFrame}};
inline constexpr Schema kDatagram{kDatagramShapes};

inline constexpr std::array kClaimShapes = {FieldShape{1, Shape::kText}, FieldShape{2, Shape::kText},
                                            FieldShape{3, Shape::kCount32}};
inline constexpr Schema kClaim{kClaimShapes};

inline constexpr std::array kHelloShapes = {FieldShape{1, Shape::kCount32}, FieldShape{2, Shape::kCount32},
                                            FieldShape{3, Shape::kCount32}, FieldShape{4, Shape::kText},
                                            FieldShape{5, Shape::kTexts},   FieldShape{6, Shape::kMessages, &kClaim},
                                            FieldShape{7, Shape::kTexts}};
inline constexpr Schema kHello{kHelloShapes};

inline constexpr std::array kGrantShapes = {FieldShape{1, Shape::kCount32}, FieldShape{2, Shape::kCount32},
                                            FieldShape{3, Shape::kCount32}};
inline constexpr Schema kGrant{kGrantShapes};

inline constexpr std::array kWelcomeShapes = {
    FieldShape{1, Shape::kCount32}, FieldShape{2, Shape::kTexts},
    FieldShape{3, Shape::kCount32}, FieldShape{4, Shape::kText},
    FieldShape{5, Shape::kBits64},  FieldShape{6, Shape::kBits64},
    FieldShape{7, Shape::kCount32}, FieldShape{8, Shape::kCount32},
    FieldShape{9, Shape::kText},    FieldShape{10, Shape::kMessages, &kGrant}};
inline constexpr Schema kWelcome{kWelcomeShapes};

inline constexpr std::array kRefusedShapes = {FieldShape{1, Shape::kCount32}, FieldShape{2, Shape::kText},
                                              FieldShape{3, Shape::kCount32}, FieldShape{4, Shape::kCount32}};
inline constexpr Schema kRefused{kRefusedShapes};

inline constexpr std::array kAnswerShapes = {FieldShape{1, Shape::kMessage, &kWelcome, true},
                                             FieldShape{2, Shape::kMessage, &kRefused, true}};
inline constexpr Schema kAnswer{kAnswerShapes};

}  // namespace tendon::wire::schema
