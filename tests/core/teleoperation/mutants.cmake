# SPDX-License-Identifier: Apache-2.0
# Can the promises of coupling_world_test.cc fail? Each mutant is that test with one fault planted in coupling.cc: a
# copy in which one text was replaced by another, linked ahead of the library. The worlds must name the promise that it
# breaks.

# coupling_mutant(name "text" "by" promise): without semicolons; promise is what the worlds say, a|b.
function(coupling_mutant name from to promise)
  set(original ${PROJECT_SOURCE_DIR}/core/teleoperation/coupling.cc)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${original})
  tendon_apart(tendon_core ${original})
  file(READ ${original} text)
  string(FIND "${text}" "${from}" at)
  if(at EQUAL -1)
    message(FATAL_ERROR "mutant ${name}: coupling.cc no longer has \"${from}\"; plant its fault anew in ${CMAKE_CURRENT_FUNCTION_LIST_FILE}")
  endif()
  string(REPLACE "${from}" "${to}" text "${text}")
  set(mutated ${CMAKE_CURRENT_BINARY_DIR}/mutants/${name}.cc)
  file(CONFIGURE OUTPUT ${mutated} CONTENT "${text}" @ONLY)
  add_executable(coupling-worlds-${name} ${mutated} $<TARGET_OBJECTS:core_coupling_worlds>)
  set_target_properties(coupling-worlds-${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  target_link_libraries(coupling-worlds-${name} PRIVATE tendon_core GTest::gtest_main)
  target_precompile_headers(coupling-worlds-${name} REUSE_FROM tendon_test_pch)
  add_test(NAME CouplingWorlds.Find.${name} COMMAND coupling-worlds-${name})
  set_tests_properties(CouplingWorlds.Find.${name} PROPERTIES LABELS unit TIMEOUT 300
    PASS_REGULAR_EXPRESSION "breaks \"(${promise})\"")
endfunction()

if(NOT TENDON_TESTS OR TENDON_SANITIZE)
  return()
endif()
add_library(core_coupling_worlds OBJECT coupling_world_test.cc)
target_compile_definitions(core_coupling_worlds PRIVATE TENDON_PROPERTY_CASES=${TENDON_PROPERTY_CASES})
target_link_libraries(core_coupling_worlds PRIVATE tendon_core tendon_warnings GTest::gtest)
target_precompile_headers(core_coupling_worlds REUSE_FROM tendon_test_pch)

# The leader gives while it is clutched: the theorem allows it, the manual does not.
coupling_mutant(gives-while-clutched "gives() const noexcept { return live() &&"
  "gives() const noexcept { return in_act() &&" "gives")
# Who was lost is engaged again when its peer is back.
coupling_mutant(engages-after-a-loss "fresh_ && told) {
    phase_ = PortPhase::kCoupled"
  "fresh_) {
    phase_ = phase_ == PortPhase::kLost ? PortPhase::kEngaged : PortPhase::kCoupled" "act|still")
# Who was lost is coupled again before its peer knows of the loss.
coupling_mutant(loss-untold "lost_sequence_ == 0 ||" "true ||" "act|still")
# An act that was heard before engages again.
coupling_mutant(act-counts-twice "newest_.engagement > seen_" "newest_.engagement >= seen_" "act|still")
# What the handle does while it is clutched moves the other end when the clutch is released.
coupling_mutant(clutch-loses-its-offset "if (live() && was_live_ && !new_act_)" "if (live() && sequence_ > 1 && !new_act_)"
  "still")
# The force is whole at once.
coupling_mutant(no-ramp "if (turned || !driven()) gain_ = 0" "if (turned || !driven()) gain_ = driven() ? 1 : 0" "ramp")
# The force ends with a step.
coupling_mutant(no-fade "fade_ = stepped ? 1 :" "fade_ = stepped ? 0 :" "step")
# A joule of the leader is taken for one of the follower.
coupling_mutant(joule-of-the-wrong-end "? map.leader_joule() : map.follower_joule()"
  "? map.follower_joule() : map.leader_joule()" "pair")
# A line sends what its account has not paid.
coupling_mutant(line-pays-nothing ".withdraw = std::exchange(given_, 0)" ".withdraw = 0 * std::exchange(given_, 0)" pair)
# What comes by waves is paid in twice.
coupling_mutant(waves-credited-twice ".credit = std::exchange(taken_, 0)" ".credit = 2 * std::exchange(taken_, 0)" pair)
