# SPDX-License-Identifier: Apache-2.0
# cmake -D SOURCE=… -D OUT=… -P without.cmake: without Boost, Tendon is configured without tendon-dash, and says so; without Node,
# tendon-dash has a page that says what is missing.
file(REMOVE_RECURSE ${OUT})

# configure(build argument…): sets `said` and `targets`.
function(configure build)
  execute_process(COMMAND ${CMAKE_COMMAND} -S ${SOURCE} -B ${build} -G Ninja ${ARGN} OUTPUT_VARIABLE said ERROR_VARIABLE said
                  COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND ninja -C ${build} -t targets all OUTPUT_VARIABLE targets COMMAND_ERROR_IS_FATAL ANY)
  # Each file that is used is there, or made.
  execute_process(COMMAND ninja -C ${build} -n OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
  set(said "${said}" PARENT_SCOPE)
  set(targets "${targets}" PARENT_SCOPE)
endfunction()

function(expect_no_dash said targets)
  if(NOT said MATCHES "No libboost-dev or no prometheus-cpp-dev: tendon-dash is not built")
    message(FATAL_ERROR "does not say that tendon-dash is left out:\n${said}")
  endif()
  if(targets MATCHES "bin/tendon-dash:" OR NOT targets MATCHES "bin/tendond:")
    message(FATAL_ERROR "expected tendond, and no tendon-dash")
  endif()
endfunction()

foreach(tests OFF ON)
  configure(${OUT}/no-boost-${tests} -DTENDON_TESTS=${tests} -DCMAKE_DISABLE_FIND_PACKAGE_Boost=ON)
  expect_no_dash("${said}" "${targets}")
endforeach()

set(build ${OUT}/no-node)
configure(${build} -DTENDON_TESTS=OFF -DNODE=)
execute_process(COMMAND ninja -C ${build} -t commands clients/dashboard/page_files.cc OUTPUT_VARIABLE commands
                COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCH "[^\n]*embed\\.cmake[^\n]*" command "${commands}")
execute_process(COMMAND sh -c "${command}" WORKING_DIRECTORY ${build} COMMAND_ERROR_IS_FATAL ANY)
file(GLOB_RECURSE pages ${build}/clients/dashboard/page/*)
execute_process(COMMAND ${CMAKE_COMMAND} -E compare_files ${pages} ${SOURCE}/clients/dashboard/missing.html
                RESULT_VARIABLE differs)
if(differs)
  message(FATAL_ERROR "the page is not missing.html alone, but ${pages}")
endif()
file(READ ${build}/clients/dashboard/page_files.cc embedded)
if(NOT embedded MATCHES "{\"/index.html\", \"text/html")
  message(FATAL_ERROR "the page is not in the program:\n${embedded}")
endif()
