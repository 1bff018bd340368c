# SPDX-License-Identifier: Apache-2.0
# cmake -D SOURCE=… -D OUT=… -P without.cmake: without Cyclone DDS, Tendon is configured without the DDS part of `tendon-plug ros2`,
# and says so.
file(REMOVE_RECURSE ${OUT})
foreach(tests OFF ON)
  set(build ${OUT}/${tests})
  execute_process(COMMAND ${CMAKE_COMMAND} -S ${SOURCE} -B ${build} -G Ninja -DTENDON_TESTS=${tests} -DCMAKE_DISABLE_FIND_PACKAGE_CycloneDDS=ON
                  OUTPUT_VARIABLE said ERROR_VARIABLE said COMMAND_ERROR_IS_FATAL ANY)
  if(NOT said MATCHES "No cyclonedds-dev or no cyclonedds-tools: tendon-plug is built without ros2")
    message(FATAL_ERROR "does not say that ros2 is left out:\n${said}")
  endif()
  # Each file that is used is there, or made.
  execute_process(COMMAND ninja -C ${build} -n OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND ninja -C ${build} -t targets all OUTPUT_VARIABLE targets COMMAND_ERROR_IS_FATAL ANY)
  if(targets MATCHES "ros2_node|fast_peer" OR NOT targets MATCHES "bin/tendon-plug:")
    message(FATAL_ERROR "expected tendon-plug, without DDS")
  endif()
endforeach()
