# SPDX-License-Identifier: Apache-2.0
# Can the oracles fail? Each mutant is tendon-worlds with one planted bug: a copy of one source file in which one text was
# replaced by another, linked ahead of the library that it comes from. The worlds must find it.

# tendon_mutant(name SOURCE server/x.cc LIBRARY tendon_loops REPLACE "text" "by" … ORACLES a|b): REPLACE takes pairs,
# without semicolons. The
# oracle that names the bug first is one of ORACLES, within 2000 worlds.
function(tendon_mutant name)
  cmake_parse_arguments(ARG "" "SOURCE;LIBRARY;ORACLES" "REPLACE" ${ARGN})
  set(original ${PROJECT_SOURCE_DIR}/${ARG_SOURCE})
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${original})
  tendon_apart(${ARG_LIBRARY} ${original})
  file(READ ${original} text)
  while(ARG_REPLACE)
    list(POP_FRONT ARG_REPLACE from to)
    string(FIND "${text}" "${from}" at)
    if(at EQUAL -1)
      message(FATAL_ERROR "mutant ${name}: ${ARG_SOURCE} no longer has \"${from}\"; plant its bug anew in ${CMAKE_CURRENT_FUNCTION_LIST_FILE}")
    endif()
    string(REPLACE "${from}" "${to}" text "${text}")
  endwhile()
  set(mutated ${CMAKE_CURRENT_BINARY_DIR}/mutants/${name}.cc)
  file(CONFIGURE OUTPUT ${mutated} CONTENT "${text}" @ONLY)
  add_executable(tendon-worlds-${name} ${mutated})
  set_target_properties(tendon-worlds-${name} PROPERTIES UNITY_BUILD OFF RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  target_include_directories(tendon-worlds-${name} PRIVATE $<TARGET_PROPERTY:${ARG_LIBRARY},INCLUDE_DIRECTORIES>)
  target_link_libraries(tendon-worlds-${name} PRIVATE tendon_worlds_main)
  target_precompile_headers(tendon-worlds-${name} REUSE_FROM tendon_core)
  add_test(NAME Worlds.Find.${name} COMMAND tendon-worlds-${name} run --count 2000 --jobs 1)
  set_tests_properties(Worlds.Find.${name} PROPERTIES LABELS world TIMEOUT 600
    PASS_REGULAR_EXPRESSION "breaks \"(${ARG_ORACLES})\"")
endfunction()

# The work of the hand is booked with the wrong sign.
tendon_mutant(ledger-sign SOURCE core/ledger/energy_ledger.cc LIBRARY tendon_core
  REPLACE "income = work +" "income = -work +"
  ORACLES "ledger")
# A force counts as fresh for a second longer than it was said to.
tendon_mutant(stale-force SOURCE core/remote/held_force.cc LIBRARY tendon_core
  REPLACE "overdue = result.age - validity()" "overdue = result.age - validity() - std::chrono::seconds(1)"
  ORACLES "fresh|stopped")
# One datagram is taken from the link in each turn, and the rest waits for the next one.
tendon_mutant(one-recv-per-tick SOURCE server/network_loop.cc LIBRARY tendon_loops
  REPLACE "i < config_.max_datagrams" "i < 1" "if (more) return now" "if (more && false) return now"
  ORACLES "drained")
# The echo tells when the datagram was sent, by the peer's clock, for when it arrived, by ours.
tendon_mutant(wrong-clock SOURCE protocol/session.cc LIBRARY tendon_protocol
  REPLACE ".received = now, .packet_number" ".received = LocalTime(content.sent.time_since_epoch()), .packet_number"
  ORACLES "round-trip")
# An older force replaces a newer one.
tendon_mutant(older-force SOURCE protocol/session.cc LIBRARY tendon_protocol
  REPLACE "both <= *mine.number" "both == *mine.number"
  ORACLES "newest")
# Who was refused or lost never comes back.
tendon_mutant(no-return SOURCE protocol/connection.cc LIBRARY tendon_protocol
  REPLACE "now >= retry_" "false"
  ORACLES "calm|recovery")
# Datagrams of the next key open, but that key never becomes the present one: the one after it is unknown.
tendon_mutant(deaf-to-new-keys SOURCE protocol/secrets/seal.cc LIBRARY tendon_protocol
  REPLACE "if (ahead == 1) {" "if (false) {"
  ORACLES "recovery")
# A guest whose address has changed is heard, and answered where it was before.
tendon_mutant(no-roaming SOURCE server/network_loop.cc LIBRARY tendon_loops
  REPLACE "if (newest && guest->address != from) {" "if (false) {"
  ORACLES "recovery|counters")
# The error bound of a clock is a third of what it may be.
tendon_mutant(bold-clock SOURCE core/estimation/clock_offset_estimator.cc LIBRARY tendon_core
  REPLACE "const double bound = std::max(" "const double bound = 1.0 / 3 * std::max("
  ORACLES "clock")
# The turn of a handle is not booked: torque costs nothing.
tendon_mutant(turns-for-free SOURCE core/haptic_controller.cc LIBRARY tendon_core
  REPLACE "wrench_of(applied, handle->torque), .dx" "wrench_of(applied, Vec3(Vec3::Zero())), .dx"
  ORACLES "ledger")
# The work of the fingers is booked with the wrong sign.
tendon_mutant(grip-sign SOURCE core/haptic_controller.cc LIBRARY tendon_core
  REPLACE "Vec<1>(handle->grip_force)" "Vec<1>(-handle->grip_force)"
  ORACLES "ledger")
# A press that ends before the next state of a client is forgotten.
tendon_mutant(forgets-presses SOURCE server/network_loop.cc LIBRARY tendon_loops
  REPLACE "view.pressed |= state.buttons" "view.pressed = state.buttons"
  ORACLES "press")
# … or that a client's callback skips.
tendon_mutant(skips-presses SOURCE clients/cpp/force_client.cc LIBRARY tendon_client
  REPLACE "std::exchange(pressed_, 0U)" "0 * std::exchange(pressed_, 0U)"
  ORACLES "press")
# A turn is the long way round where q is written as −q.
tendon_mutant(long-way-round SOURCE core/base/rotation.cc LIBRARY tendon_core
  REPLACE "sign = q.w < 0 ? -1.0 : 1.0" "sign = 1.0"
  ORACLES "ledger|truth|bound")
