# SPDX-License-Identifier: Apache-2.0
# Can the tests of tendon-sweep and of what it sweeps fail? Each mutant is tendon-sweep or tendon-lab with one planted
# bug: a copy of one source file in which one text was replaced by another, linked ahead of the library that it comes
# from.

# tendon_sweep_mutant(name SOURCE results.cc REPLACE "text" "by" TEST Suite.Name): that test finds it. With PROGRAM
# tendon-lab it is tendon-lab that has the bug.
function(tendon_sweep_mutant name)
  cmake_parse_arguments(ARG "" "SOURCE;TEST;PROGRAM" "REPLACE" ${ARGN})
  set(original ${CMAKE_CURRENT_SOURCE_DIR}/${ARG_SOURCE})
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${original})
  file(READ ${original} text)
  list(POP_FRONT ARG_REPLACE from to)
  string(FIND "${text}" "${from}" at)
  if(at EQUAL -1)
    message(FATAL_ERROR "mutant ${name}: ${ARG_SOURCE} no longer has \"${from}\"; plant its bug anew in ${CMAKE_CURRENT_FUNCTION_LIST_FILE}")
  endif()
  string(REPLACE "${from}" "${to}" text "${text}")
  set(mutated ${CMAKE_CURRENT_BINARY_DIR}/mutants/${name}.cc)
  file(CONFIGURE OUTPUT ${mutated} CONTENT "${text}" @ONLY)
  if(ARG_PROGRAM STREQUAL "tendon-lab")
    add_executable(tendon-sweep-${name} ${mutated})
    target_link_libraries(tendon-sweep-${name} PRIVATE tendon_lab_main)
    set(which TENDON_LAB_PROGRAM)
  else()
    add_executable(tendon-sweep-${name} ${mutated} sweep_main.cc)
    target_link_libraries(tendon-sweep-${name} PRIVATE
      tendon_build_info tendon_protocol tendon_scene tendon_sweep nlohmann_json::nlohmann_json CLI11::CLI11 tendon_warnings)
    set(which TENDON_SWEEP_PROGRAM)
  endif()
  set_target_properties(tendon-sweep-${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  add_test(NAME Sweep.Find.${name} COMMAND sweep_test --gtest_filter=${ARG_TEST})
  set_tests_properties(Sweep.Find.${name} PROPERTIES LABELS e2e TIMEOUT 60
    ENVIRONMENT "${which}=$<TARGET_FILE:tendon-sweep-${name}>"
    PASS_REGULAR_EXPRESSION "FAILED  \\] ${ARG_TEST}")
endfunction()

# A second result takes the place of the first.
tendon_sweep_mutant(rename-for-link SOURCE results.cc
  REPLACE "if (link(path_.c_str(), name.c_str()) == 0)" "if (rename(path_.c_str(), name.c_str()) == 0)"
  TEST Sweep.TwoResultsThatDifferAreBothKeptAndMergeNamesTheUnit)
# After a power cut a result may be there, and empty.
tendon_sweep_mutant(no-sync SOURCE results.cc
  REPLACE "if (fsync(file_) != 0)" "if (false)"
  TEST Sweep.AResultIsSyncedBeforeItHasItsName)
# Whatever a program prints is a result when it ends well.
tendon_sweep_mutant(believes-any-output SOURCE shards.cc
  REPLACE "end_of(end.output, units)" "(void)units"
  TEST Sweep.AShardThatIsKilledOrBreaksOffIsNotDoneAndRunsAgain)
# A newer build goes on with the shards of an older one.
tendon_sweep_mutant(any-program SOURCE shards.cc
  REPLACE "here != plan.sha256" "here.empty()"
  TEST Sweep.AnotherPlanAnotherProgramOrNoneIsRefused)
# It names the unit before the one that differs.
tendon_sweep_mutant(names-the-wrong-unit SOURCE ../../support/units.cc
  REPLACE "if (unit * apart != moments_apart)" "if ((unit + 1) * apart != moments_apart)"
  TEST Sweep.BisectNamesTheUnitWithALineAndWithoutOne)
# The half that stays the same is looked at more closely.
tendon_sweep_mutant(the-other-half SOURCE bisect.cc
  REPLACE "part = differ ? left : right" "part = differ ? right : left"
  TEST Sweep.BisectFindsOneOfSeveralUnitsWithoutLinesByHalves)
# Each shard begins with unit 0.
tendon_sweep_mutant(units-from-the-shard SOURCE ../../support/units.cc PROGRAM tendon-lab
  REPLACE "run(unit, end)" "run(unit - units.first, end)"
  TEST SweepOf.PaperIsWhatOneProcessSays)
# A figure is written, and not read.
tendon_sweep_mutant(a-figure-is-not-read SOURCE ../lab/experiments/paper.cc PROGRAM tendon-lab
  REPLACE "row.prescribed.limited_share = number_of(line, \"limited_share\")" "row.prescribed.limited_share = 0"
  TEST SweepOf.PaperIsWhatOneProcessSays)
