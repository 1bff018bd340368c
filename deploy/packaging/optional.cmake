# SPDX-License-Identifier: Apache-2.0
# This file looks for optional packages. Use tendon_needs() to look for the packages of a part:
#
#     tendon_needs(found "tendon-dash" boost prometheus)
#
# This sets `found`. If a package is missing, incomplete or too old, a line with the name of the part and the Debian
# package is printed and added to left_out.txt in the build folder. If the package is found, you can use the target
# tendon::NAME, or the program ${TENDON_NAME}.
#
# Each file is searched for separately, because the CMake files of a package abort the configuration if one of its files
# is missing. Only MPI needs CMake's module, which is run in a separate project. The result of a probe is cached until
# the files or the compiler change.
file(WRITE ${CMAKE_BINARY_DIR}/left_out.txt "")

# tendon_package(NAME DEBIAN package …): defines how to find a package. The search starts when a part needs the package.
#   PKG_CONFIG modules          the modules that define the flags and the search paths
#   HEADERS, LIBRARIES, FILES   all of them must exist; SUFFIXES and PATHS are additional search paths
#   PROGRAM name                cached in TENDON_<NAME>; must succeed with the arguments RUN in a folder with PROBE_FILE
#   VERSION minimum             taken from MACRO in the first header, the real name of FILES, or the output of RUN
#   PROBE text                  a source file that must compile and link
#   MODULE name, TARGET t       the target that is created by find_package(); it must link with PROBE
function(tendon_package name)
  set(one DEBIAN PROGRAM VERSION MACRO PROBE PROBE_FILE MODULE TARGET)
  set(many PKG_CONFIG HEADERS LIBRARIES FILES SUFFIXES PATHS RUN)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "" "${one}" "${many}")
  foreach(field ${one} ${many})
    set_property(GLOBAL PROPERTY tendon_${name}_${field} "${ARG_${field}}")
  endforeach()
endfunction()

# Calls find_path(), find_library() and so on. The cached result is cleared if the file no longer exists.
macro(tendon_find kind variable)
  if(${variable} AND NOT EXISTS "${${variable}}")
    unset(${variable} CACHE)
  endif()
  cmake_language(CALL find_${kind} ${variable} ${ARGN})
  mark_as_advanced(${variable})
endmacro()

# tendon_once(NAME key): sets `sum`, and sets `known` if NAME was successfully tested with the same `key` before.
function(tendon_once name key)
  string(SHA1 sum "${key};${CMAKE_CXX_COMPILER};${CMAKE_CXX_COMPILER_VERSION};${CMAKE_CXX_FLAGS}")
  set(sum ${sum} PARENT_SCOPE)
  set(known FALSE PARENT_SCOPE)
  if("$CACHE{TENDON_WORKS_${name}}" STREQUAL sum)
    set(known TRUE PARENT_SCOPE)
  endif()
endfunction()

# tendon_why_not(NAME out): returns the reason why a package cannot be used, or nothing if it is found.
function(tendon_why_not name out)
  foreach(field DEBIAN PROGRAM VERSION MACRO PROBE PROBE_FILE MODULE TARGET PKG_CONFIG HEADERS LIBRARIES FILES SUFFIXES PATHS RUN)
    get_property(${field} GLOBAL PROPERTY tendon_${name}_${field})
  endforeach()
  string(TOUPPER TENDON_${name} NAME)
  set(include_dirs)
  set(libraries)
  set(options)
  set(version)
  set(sum)

  if(PKG_CONFIG)
    set(pc tendon_pc_${name})
    pkg_check_modules(${pc} QUIET ${PKG_CONFIG})
    if(NOT ${pc}_FOUND)
      list(JOIN PKG_CONFIG ", " modules)
      set(${out} "pkg-config does not find ${modules}" PARENT_SCOPE)
      return()
    endif()
    list(APPEND include_dirs ${${pc}_INCLUDE_DIRS})
    set(options ${${pc}_CFLAGS_OTHER})
    list(APPEND LIBRARIES ${${pc}_LIBRARIES})
    list(REMOVE_DUPLICATES LIBRARIES)
  endif()
  foreach(header ${HEADERS})
    string(MAKE_C_IDENTIFIER "${NAME}_${header}" variable)
    if(${variable} AND NOT EXISTS "${${variable}}/${header}")
      unset(${variable} CACHE)
    endif()
    tendon_find(path ${variable} ${header} HINTS ${include_dirs} PATH_SUFFIXES ${SUFFIXES})
    if(NOT ${variable})
      set(${out} "${header} is not found" PARENT_SCOPE)
      return()
    endif()
    list(APPEND include_dirs ${${variable}})
    if(MACRO AND NOT version)
      file(STRINGS ${${variable}}/${header} line REGEX "# *define +${MACRO} " LIMIT_COUNT 1)
      string(REGEX MATCH "[0-9][0-9._]*" version "${line}")
      string(REPLACE "_" "." version "${version}")
    endif()
  endforeach()
  foreach(library ${LIBRARIES})
    string(MAKE_C_IDENTIFIER "${NAME}_lib${library}" variable)
    tendon_find(library ${variable} ${library} HINTS ${tendon_pc_${name}_LIBRARY_DIRS})
    if(NOT ${variable})
      set(${out} "lib${library}.so is not found" PARENT_SCOPE)
      return()
    endif()
    list(APPEND libraries ${${variable}})
  endforeach()
  foreach(file ${FILES})
    tendon_find(file ${NAME}_FILE ${file} PATHS ${PATHS})
    if(NOT ${NAME}_FILE)
      set(${out} "${file} is not found" PARENT_SCOPE)
      return()
    endif()
    file(REAL_PATH ${${NAME}_FILE} real)
    if(NOT real MATCHES "-([0-9.]+)\\.[a-z]+$")
      set(VERSION)
    endif()
    set(version "${CMAKE_MATCH_1}")
  endforeach()

  set(scratch ${CMAKE_BINARY_DIR}/CMakeFiles/optional/${name})
  if(PROGRAM)
    tendon_find(program ${NAME} ${PROGRAM})
    if(NOT ${NAME})
      set(${out} "${PROGRAM} is not found" PARENT_SCOPE)
      return()
    endif()
    file(TIMESTAMP "${${NAME}}" time)
    tendon_once(${name} "${${NAME}};${time};${RUN};${VERSION};${PROBE}")
    if(RUN AND NOT known)
      file(MAKE_DIRECTORY ${scratch})
      if(PROBE_FILE)
        file(WRITE ${scratch}/${PROBE_FILE} "${PROBE}")
      endif()
      execute_process(COMMAND ${${NAME}} ${RUN} WORKING_DIRECTORY ${scratch}
                      OUTPUT_VARIABLE said ERROR_VARIABLE said RESULT_VARIABLE failed)
      if(failed)
        list(JOIN RUN " " arguments)
        set(${out} "${PROGRAM} ${arguments} fails" PARENT_SCOPE)
        return()
      endif()
      string(REGEX MATCH "[0-9][0-9.]*" version "${said}")
    elseif(known)
      set(VERSION)
    endif()
  endif()
  if(VERSION AND version VERSION_LESS VERSION)
    set(${out} "version ${version}, and ${VERSION} is needed" PARENT_SCOPE)
    return()
  endif()

  if(MODULE)
    tendon_once(${name} "${MODULE};${PROBE}")
    if(NOT known)
      file(WRITE ${scratch}/probe.cc "${PROBE}\n")
      file(WRITE ${scratch}/CMakeLists.txt
           "cmake_minimum_required(VERSION 3.25)\nproject(probe CXX)\nfind_package(${MODULE} REQUIRED COMPONENTS CXX)\n"
           "add_executable(probe probe.cc)\ntarget_link_libraries(probe ${TARGET})\n")
      file(REMOVE_RECURSE ${scratch}/build)
      set(settings)
      foreach(setting CMAKE_CXX_COMPILER CMAKE_CXX_FLAGS CMAKE_TOOLCHAIN_FILE CMAKE_SYSROOT CMAKE_PREFIX_PATH CMAKE_MAKE_PROGRAM
                      CMAKE_FIND_ROOT_PATH_MODE_PROGRAM CMAKE_FIND_ROOT_PATH_MODE_LIBRARY CMAKE_FIND_ROOT_PATH_MODE_INCLUDE
                      MPI_HOME MPI_CXX_COMPILER)
        if(${setting})
          list(APPEND settings "-D${setting}=${${setting}}")
        endif()
      endforeach()
      execute_process(COMMAND ${CMAKE_COMMAND} -S ${scratch} -B ${scratch}/build -G ${CMAKE_GENERATOR} ${settings}
                      OUTPUT_QUIET ERROR_QUIET RESULT_VARIABLE failed)
      if(NOT failed)
        execute_process(COMMAND ${CMAKE_COMMAND} --build ${scratch}/build OUTPUT_QUIET ERROR_QUIET RESULT_VARIABLE failed)
      endif()
      if(failed)
        set(${out} "a program of one line cannot be built with ${MODULE}" PARENT_SCOPE)
        return()
      endif()
    endif()
    find_package(${MODULE} QUIET COMPONENTS CXX)
    if(NOT TARGET ${TARGET})
      set(${out} "find_package(${MODULE}) does not define ${TARGET}" PARENT_SCOPE)
      return()
    endif()
    set_target_properties(${TARGET} PROPERTIES IMPORTED_GLOBAL TRUE)
    list(APPEND libraries ${TARGET})
  elseif(PROBE AND NOT PROGRAM)
    tendon_once(${name} "${include_dirs};${libraries};${PROBE}")
    if(NOT known)
      file(WRITE ${scratch}/probe.cc "${PROBE}\n")
      try_compile(works ${scratch}/build ${scratch}/probe.cc
                  CMAKE_FLAGS "-DINCLUDE_DIRECTORIES=${include_dirs}" COMPILE_DEFINITIONS ${options} LINK_LIBRARIES ${libraries})
      set(built ${works})
      unset(works CACHE)
      if(NOT built)
        set(${out} "a program of one line cannot be built with it" PARENT_SCOPE)
        return()
      endif()
    endif()
  endif()
  if(sum)
    set(TENDON_WORKS_${name} ${sum} CACHE INTERNAL "")
  endif()

  if(include_dirs OR libraries)
    list(REMOVE_DUPLICATES include_dirs)
    add_library(tendon::${name} INTERFACE IMPORTED GLOBAL)
    target_include_directories(tendon::${name} INTERFACE ${include_dirs})
    target_compile_options(tendon::${name} INTERFACE ${options})
    target_link_libraries(tendon::${name} INTERFACE ${libraries})
  endif()
  set(${out} "" PARENT_SCOPE)
endfunction()

function(tendon_leave_out part debian why)
  message(STATUS "Left out: ${part} (${debian}: ${why})")
  file(APPEND ${CMAKE_BINARY_DIR}/left_out.txt "${part} (${debian}: ${why})\n")
endfunction()

function(tendon_needs found part)
  set(${found} FALSE PARENT_SCOPE)
  foreach(name ${ARGN})
    get_property(known GLOBAL PROPERTY tendon_${name}_KNOWN)
    if(NOT known)
      tendon_why_not(${name} why)
      set_property(GLOBAL PROPERTY tendon_${name}_WHY_NOT "${why}")
      set_property(GLOBAL PROPERTY tendon_${name}_KNOWN TRUE)
    endif()
    get_property(why GLOBAL PROPERTY tendon_${name}_WHY_NOT)
    if(why)
      get_property(debian GLOBAL PROPERTY tendon_${name}_DEBIAN)
      tendon_leave_out("${part}" "${debian}" "${why}")
      return()
    endif()
  endforeach()
  set(${found} TRUE PARENT_SCOPE)
endfunction()

# This makes the build faster.
tendon_package(ccache DEBIAN ccache PROGRAM ccache RUN --version VERSION 3)
# Only the headers are needed for Beast.
tendon_package(boost DEBIAN libboost-dev HEADERS boost/version.hpp boost/beast/websocket.hpp boost/asio/io_context.hpp
  MACRO BOOST_LIB_VERSION VERSION 1.74)
tendon_package(prometheus DEBIAN prometheus-cpp-dev PKG_CONFIG prometheus-cpp-core>=1.0 HEADERS prometheus/text_serializer.h)
tendon_package(node DEBIAN nodejs PROGRAM node RUN --version VERSION 18)
tendon_package(cyclonedds DEBIAN cyclonedds-dev HEADERS dds/dds.h LIBRARIES ddsc
  PROBE "#include <dds/dds.h>\nint main() { return dds_create_participant(DDS_DOMAIN_DEFAULT, nullptr, nullptr) > 0 ? 0 : 1; }")
tendon_package(idlc DEBIAN cyclonedds-tools PROGRAM idlc
  RUN -t -x final -o . ${PROJECT_SOURCE_DIR}/clients/bridge/ros2/ros2_types.idl)
# Version 3.2 is the first version that sends small messages immediately. It is not available in Debian 12.
tendon_package(precice DEBIAN libprecice-dev PKG_CONFIG libprecice>=3.2 libprecice<4 HEADERS precice/precice.hpp
  PROBE "#include <precice/precice.hpp>\nint main() { precice::Participant(\"a\", \"b\", 0, 1).initialize(); }")
tendon_package(mujoco DEBIAN libmujoco-dev HEADERS mujoco/mujoco.h LIBRARIES mujoco
  PROBE "#include <mujoco/mujoco.h>\nint main() { return mj_version() != mjVERSION_HEADER; }")
tendon_package(petsc DEBIAN petsc-dev PKG_CONFIG PETSc>=3.17 HEADERS petscksp.h)
tendon_package(mpi DEBIAN libopenmpi-dev MODULE MPI TARGET MPI::MPI_CXX
  PROBE "#include <mpi.h>\nint main(int count, char** words) { return MPI_Init(&count, &words); }")
# The server only uses the headers. The library is loaded when the first pipe is opened.
tendon_package(libusb DEBIAN libusb-1.0-0-dev HEADERS libusb.h SUFFIXES libusb-1.0 LIBRARIES usb-1.0)
tendon_package(help2man DEBIAN help2man PROGRAM help2man RUN --version VERSION 1)
tendon_package(emscripten DEBIAN emscripten PROGRAM em++ RUN --version VERSION 3.1.6)

# These packages are only used by tests. In Fast DDS 3, the library is called libfastdds.
tendon_package(fastdds DEBIAN libfastrtps-dev HEADERS fastdds/dds/domain/DomainParticipantFactory.hpp fastcdr/Cdr.h
  LIBRARIES fastrtps fastcdr)
tendon_package(go DEBIAN golang-go PROGRAM go RUN version VERSION 1.18)
tendon_package(mkoctfile DEBIAN octave-dev PROGRAM mkoctfile RUN --version VERSION 6)
tendon_package(openigtlink DEBIAN libopenigtlink-dev HEADERS openigtlink/igtlTransformMessage.h LIBRARIES OpenIGTLink
  PROBE "#include <openigtlink/igtlTransformMessage.h>\nint main() { return igtl::TransformMessage::New()->GetPackSize() < 0; }")
tendon_package(openigtlink_examples DEBIAN openigtlink-examples FILES Receiver/ReceiveClient.cxx
  PATHS /usr/share/doc/openigtlink-examples/examples)
tendon_package(zeromq DEBIAN libzmq3-dev PKG_CONFIG libzmq>=4.3 HEADERS zmq.h)
tendon_package(grpc DEBIAN libgrpc++-dev HEADERS grpcpp/grpcpp.h LIBRARIES grpc++ grpc gpr absl_synchronization)
tendon_package(grpc_plugin DEBIAN protobuf-compiler-grpc PROGRAM grpc_cpp_plugin)
tendon_package(umockdev DEBIAN libumockdev-dev PKG_CONFIG umockdev-1.0>=0.17.16 HEADERS umockdev.h glib.h)
tendon_package(umockdev_preload DEBIAN libumockdev-dev LIBRARIES umockdev-preload)
tendon_package(benchmark DEBIAN libbenchmark-dev PKG_CONFIG benchmark>=1.5 HEADERS benchmark/benchmark.h)
tendon_package(bullet DEBIAN libbullet-dev PKG_CONFIG bullet HEADERS btBulletDynamicsCommon.h)
tendon_package(javac DEBIAN default-jdk-headless PROGRAM javac RUN -version VERSION 17)
tendon_package(protobuf_jar DEBIAN libprotobuf-java FILES protobuf.jar PATHS /usr/share/java
  VERSION ${Protobuf_VERSION})
tendon_package(mcs DEBIAN mono-mcs PROGRAM mcs RUN --version VERSION 6)
tendon_package(mono DEBIAN mono-runtime PROGRAM mono RUN --version VERSION 6)
tendon_package(mono_posix DEBIAN libmono-posix4.0-cil FILES Mono.Posix.dll PATHS /usr/lib/mono/4.5 /usr/lib/mono/4.0)
# This checks that rustc can link a program to libsodium.
tendon_package(rustc DEBIAN rustc PROGRAM rustc PROBE_FILE probe.rs RUN --edition 2021 probe.rs -l sodium -o probe
  PROBE "extern \"C\" { fn sodium_init() -> i32; }\nfn main() { unsafe { sodium_init(); } }\n")
