# SPDX-License-Identifier: Apache-2.0
# Can the tests of rigid tools fail? Each mutant is these tests with one planted bug: a copy of one source file in which
# one text was replaced by another, linked ahead of the library.

# These tests are objects of their own, which the mutants take.
set_source_files_properties(
  touch/distance_grid_test.cc touch/layer_test.cc touch/mesh_tool_test.cc touch/rigid_contact_test.cc
  touch/rigid_shape_test.cc touch/surface_distance_test.cc
  PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)

# rigid_tool_mutant(name SOURCE layer.cc REPLACE "text" "by" TEST Suite.Name): that test finds it. Without semicolons.
function(rigid_tool_mutant name)
  cmake_parse_arguments(ARG "" "SOURCE;TEST" "REPLACE" ${ARGN})
  set(original ${PROJECT_SOURCE_DIR}/clients/softbody/touch/${ARG_SOURCE})
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${original})
  tendon_apart(tendon_softbody ${original})
  file(READ ${original} text)
  list(POP_FRONT ARG_REPLACE from to)
  string(FIND "${text}" "${from}" at)
  if(at EQUAL -1)
    message(FATAL_ERROR "mutant ${name}: ${ARG_SOURCE} no longer has \"${from}\"; plant its bug anew in ${CMAKE_CURRENT_FUNCTION_LIST_FILE}")
  endif()
  string(REPLACE "${from}" "${to}" text "${text}")
  set(mutated ${CMAKE_CURRENT_BINARY_DIR}/mutants/${name}.cc)
  file(CONFIGURE OUTPUT ${mutated} CONTENT "${text}" @ONLY)
  add_executable(rigid-tools-${name} ${mutated}
    $<FILTER:$<TARGET_OBJECTS:softbody_test>,INCLUDE,touch/\(distance|layer|mesh|rigid|surface\)_>)
  set_target_properties(rigid-tools-${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  target_link_libraries(rigid-tools-${name} PRIVATE tendon_softbody GTest::gtest_main)
  add_test(NAME RigidTools.Find.${name} COMMAND rigid-tools-${name} --gtest_filter=${ARG_TEST})
  set_tests_properties(RigidTools.Find.${name} PROPERTIES LABELS unit TIMEOUT 300
    PASS_REGULAR_EXPRESSION "FAILED  \\] ${ARG_TEST}")
endfunction()

# Friction pushes the hand on.
rigid_tool_mutant(friction-pushes-on SOURCE layer.cc
  REPLACE "slope += drag" "slope -= drag"
  TEST RigidContact.FrictionDragsTheShapeAndEveryPointLosesEnergy)
# The pressure of the answer before bounds friction.
rigid_tool_mutant(pressure-of-the-last-answer SOURCE rigid_contact.cc
  REPLACE "if (layer_.rubs() && round > 0)" "if (layer_.rubs() && round > 1000)"
  TEST RigidContact.FrictionIsBoundedByThePressureOfItsOwnAnswer)
# Friction acts across the scene's way to the tool, and not across the tool's own normal.
rigid_tool_mutant(friction-across-one-normal SOURCE layer.cc
  REPLACE "tie.normal = d.gradient.normalized()" "tie.normal = Vec3::UnitZ()"
  TEST Grasp.LiftingBetweenTwoRoughSpheresMovesTheLiverUp)
# The normal that is sent points into the body.
rigid_tool_mutant(normal-into-the-body SOURCE layer.cc
  REPLACE "= -placed.tool->distance(" "= placed.tool->distance("
  TEST RigidContact.OutsideNothingIsFeltAndTheGapIsTheWayToTheLayer)
# The layer has its whole stiffness at once.
rigid_tool_mutant(no-onset SOURCE layer.cc
  REPLACE "if (overlap < onset) {" "if (overlap < 0) {"
  TEST Layer.PressesWithYoungsModulusAndBeginsWithoutAStepInForceOrStiffness)
# A fast tool is followed in steps as long as those of a thick one.
rigid_tool_mutant(steps-too-long SOURCE rigid_contact.cc
  REPLACE "tool.shape.thinnest() / 8" "tool.shape.thinnest() * 4"
  TEST MeshTool.AThinPlateThatComesFastDoesNotComeOutOnTheOtherSide)
# A facet has too few points for a thin tool.
rigid_tool_mutant(points-too-far-apart SOURCE layer.cc
  REPLACE "kMostPieces = 32" "kMostPieces = 8"
  TEST RigidContact.AThinToolSlidesAlongEitherAxisAndGivesBackWhatItTook)
# Of points that lie together only those count whose middle is pressed.
rigid_tool_mutant(bunches-that-are-points SOURCE layer.cc
  REPLACE "config_.thickness + bunch.spread * reach" "config_.thickness"
  TEST Layer.PressesEachPointThatAToolTouchesAndNoOther)
# At a corner the side is that of whichever facet was looked at first.
rigid_tool_mutant(side-of-one-facet SOURCE surface_distance.cc
  REPLACE "facet.of_corners[0])" "facet.normal)"
  TEST SurfaceDistance.AtASharpCornerTheSideIsRightWhereSingleFacetsAreWrong)
# The samples themselves are the weights of the splines.
rigid_tool_mutant(samples-for-weights SOURCE distance_grid.cc
  REPLACE "(8 * values[first + step] - values[first] - values[first + 2 * step]) / 6" "values[first + step]"
  TEST DistanceGrid.MeetsASmoothDistanceToTheFourthOrder)
