# SPDX-License-Identifier: Apache-2.0
# The contents of `cmake --install` and of the Debian packages that are created by `cpack`:
#   tendon             the server and the tools, including sweeps and the upload of recordings. Its image can also run
#                      the job of a sweep
#   tendon-bridge      bridges for existing programs, which do not need any other package
#   libtendon1         libtendon.so.1, the C library
#   libtendon-dev      its header, and the C++ library: find_package(tendon), tendon::client
#   tendon-fem-worker  the only package that depends on PETSc and MPI, if the build has found them
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(programs tendond tendon-inject tendon-softbody tendon-lab tendon-report tendon-identify tendon-replay tendon-conformance
    tendon-fem tendon-mesh tendon-sweep tendon-worlds)
install(TARGETS tendond tendon-softbody tendon-lab tendon-report tendon-identify tendon-replay tendon-fem tendon-mesh tendon-sweep
        tendon-worlds COMPONENT programs)
install(DIRECTORY deploy/scenes/ DESTINATION ${CMAKE_INSTALL_DATADIR}/tendon/scenes COMPONENT programs
        FILES_MATCHING PATTERN "*.toml" PATTERN "*.msh")
install(FILES README.md CHANGELOG.md LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT programs)
install(FILES deploy/discovery/README.md deploy/discovery/records.md deploy/discovery/tendon.service.in
        DESTINATION ${CMAKE_INSTALL_DATADIR}/tendon/discovery COMPONENT programs)
if(TARGET tendon-dash)
  list(APPEND programs tendon-dash)
  install(TARGETS tendon-dash COMPONENT programs)
  install(DIRECTORY deploy/monitoring DESTINATION ${CMAKE_INSTALL_DATADIR}/tendon COMPONENT programs
          PATTERN check EXCLUDE PATTERN otelcol-contrib.txt EXCLUDE)
endif()
# Rename it to the name of its manual page.
set(ship ${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/tendon-ship)
configure_file(deploy/recordings/ship ${ship} @ONLY)
install(PROGRAMS ${ship} DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT programs)
if(TARGET tendon-fem-worker)
  install(TARGETS tendon-fem-worker COMPONENT worker)
  install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/tendon-fem-worker COMPONENT worker)
endif()
install(TARGETS tendon-bridge COMPONENT bridge)
# The former name, for one release.
install(PROGRAMS clients/bridge/tendon-plug DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT bridge)
# The program searches for these libraries relative to its own folder.
install(TARGETS hdPhantom HD LIBRARY DESTINATION lib/tendon/chai3d COMPONENT bridge)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/tendon-bridge COMPONENT bridge)
# These files are only installed by the packages. `cmake --install` into a home folder does not change /etc.
install(FILES deploy/udev/60-tendon.rules DESTINATION lib/udev/rules.d COMPONENT machine EXCLUDE_FROM_ALL)
install(FILES deploy/systemd/tendond.service deploy/recordings/tendon-ship.service deploy/recordings/tendon-ship.timer
        DESTINATION lib/systemd/system COMPONENT machine EXCLUDE_FROM_ALL)
install(FILES deploy/scenes/demo.toml DESTINATION /etc/tendon RENAME scene.toml COMPONENT machine EXCLUDE_FROM_ALL)

# Each program has a manual page, which is created from --help, and completion. bash-completion needs a file with the
# name of each program, so the same file is installed several times.
tendon_needs(has_help2man "manual pages" help2man)
set(completions ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
set(pages)
# describe_program(NAME COMPONENT [FILE]): FILE is the path of a program that is not a target.
function(describe_program program component)
  install(FILES deploy/packaging/completion.bash DESTINATION ${completions} RENAME ${program} COMPONENT ${component})
  if(NOT has_help2man)
    return()
  endif()
  set(file ${ARGN})
  set(depends ${ARGN})
  if(NOT file)
    set(file $<TARGET_FILE:${program}>)
    set(depends ${program})
  endif()
  set(page ${CMAKE_CURRENT_BINARY_DIR}/man/${program}.1)
  add_custom_command(OUTPUT ${page}.gz
    COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/deploy/packaging/manual ${TENDON_HELP2MAN} ${PROJECT_VERSION}
            "$<IF:$<STREQUAL:${program},tendond>,networked haptics server,part of the Tendon haptics server>" ${file} ${page}
    COMMAND gzip -9nf ${page}
    DEPENDS ${depends} ${CMAKE_CURRENT_SOURCE_DIR}/deploy/packaging/manual VERBATIM)
  install(FILES ${page}.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT ${component})
  set(pages ${pages} ${page}.gz PARENT_SCOPE)
endfunction()
foreach(program ${programs})
  describe_program(${program} programs)
endforeach()
describe_program(tendon-ship programs ${ship})
describe_program(tendon-bridge bridge)
if(TARGET tendon-fem-worker)
  describe_program(tendon-fem-worker worker)
endif()
add_custom_target(man ALL DEPENDS ${pages})

# The C library.
install(TARGETS tendon_c LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT c NAMELINK_COMPONENT c_development)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libtendon1 COMPONENT c)
install(FILES clients/c/tendon.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT c_development)
install(DIRECTORY clients/c/examples DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libtendon-dev COMPONENT c_development)

# The client library. The installed headers have the same paths as in this repository: #include "clients/cpp/run.h".
set(libraries tendon_client tendon_output tendon_server_name tendon_usage tendon_protocol tendon_address tendon_proto tendon_core tendon_core_design)
foreach(library ${libraries})
  string(REPLACE tendon_ "" name ${library})
  set_target_properties(${library} PROPERTIES EXPORT_NAME ${name})
endforeach()
install(TARGETS ${libraries} EXPORT tendon COMPONENT development INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tendon)
# Strip the static libraries, because CMake only strips programs.
install(CODE "
  if(CMAKE_INSTALL_DO_STRIP)
    file(GLOB archives \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_LIBDIR}/libtendon_*.a\")
    execute_process(COMMAND ${CMAKE_STRIP} --strip-debug \${archives} COMMAND_ERROR_IS_FATAL ANY)
  endif()" COMPONENT development)
install(EXPORT tendon NAMESPACE tendon:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/tendon COMPONENT development)
foreach(room core protocol clients/cpp)
  install(DIRECTORY ${room}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tendon/${room} COMPONENT development
          FILES_MATCHING PATTERN "*.h")
endforeach()
install(FILES protocol/wire/tendon.proto protocol/WIRE.md protocol/SESSION.md DESTINATION ${CMAKE_INSTALL_DATADIR}/tendon/protocol
        COMPONENT development)
install(FILES protocol/vectors/golden.md DESTINATION ${CMAKE_INSTALL_DATADIR}/tendon/protocol/vectors COMPONENT development)
configure_package_config_file(deploy/packaging/tendon-config.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/tendon-config.cmake
                              INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/tendon)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/tendon-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/tendon-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/tendon-config-version.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/tendon COMPONENT development)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME tendon)
set(CPACK_PACKAGE_VENDOR "The Tendon authors")
set(CPACK_PACKAGE_CONTACT "The Tendon authors <tendon@localhost>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/packages)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL programs machine injector conformance bridge c c_development development)
if(TARGET tendon-fem-worker)
  list(APPEND CPACK_COMPONENTS_ALL worker)
endif()
set(CPACK_COMPONENT_PROGRAMS_GROUP run)
set(CPACK_COMPONENT_MACHINE_GROUP run)
set(CPACK_COMPONENT_INJECTOR_GROUP run)
set(CPACK_COMPONENT_CONFORMANCE_GROUP run)
set(CPACK_COMPONENT_BRIDGE_GROUP bridge)
set(CPACK_COMPONENT_C_GROUP c)
set(CPACK_COMPONENT_C_DEVELOPMENT_GROUP dev)
set(CPACK_COMPONENT_DEVELOPMENT_GROUP dev)
set(CPACK_COMPONENT_WORKER_GROUP worker)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_RUN_PACKAGE_NAME tendon)
set(CPACK_DEBIAN_RUN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_RUN_PACKAGE_SHLIBDEPS ON)
# These libraries are loaded at runtime if a scene needs them, so dpkg-shlibdeps does not find them.
set(CPACK_DEBIAN_RUN_PACKAGE_DEPENDS "libsystemd0")
if(TARGET tendon::libusb)
  string(APPEND CPACK_DEBIAN_RUN_PACKAGE_DEPENDS ", libusb-1.0-0")
endif()
set(CPACK_DEBIAN_RUN_PACKAGE_RECOMMENDS "gnuplot-nox, libopenblas0-pthread")
set(CPACK_DEBIAN_RUN_PACKAGE_SUGGESTS "avahi-daemon, gmsh, rclone, tendon-fem-worker")
set(CPACK_DEBIAN_RUN_DESCRIPTION "Networked haptics server with an energy-bounding output limiter
 Runs the control loop of a haptic device at 1 kHz. It limits each force so that the device never gives out more
 energy than it has received, even if the forces of remote physics engines are late, rare or wrong.")
set(CPACK_DEBIAN_RUN_PACKAGE_CONTROL_EXTRA ${CMAKE_CURRENT_SOURCE_DIR}/deploy/packaging/conffiles)
set(CPACK_DEBIAN_BRIDGE_PACKAGE_NAME tendon-bridge)
set(CPACK_DEBIAN_BRIDGE_PACKAGE_CONFLICTS tendon-plug)
set(CPACK_DEBIAN_BRIDGE_PACKAGE_REPLACES tendon-plug)
set(CPACK_DEBIAN_BRIDGE_PACKAGE_SECTION science)
set(CPACK_DEBIAN_BRIDGE_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_BRIDGE_DESCRIPTION "Haptic devices of a Tendon server for existing programs
 Connects programs that use CHAI3D, VRPN, Inverse-compatible JSON or ROS 2 to the device of a Tendon server on the
 network. The energy of the device is bounded by an output limiter.")
set(CPACK_DEBIAN_WORKER_PACKAGE_NAME tendon-fem-worker)
set(CPACK_DEBIAN_WORKER_PACKAGE_SECTION science)
set(CPACK_DEBIAN_WORKER_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_WORKER_PACKAGE_DEPENDS openmpi-bin)
set(CPACK_DEBIAN_WORKER_DESCRIPTION "Large soft bodies for the Tendon haptics server, with PETSc and MPI
 The workers of tendon-fem, which distribute the finite elements of a soft body over many cores and machines.")
set(CPACK_DEBIAN_C_PACKAGE_NAME libtendon1)
set(CPACK_DEBIAN_C_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_C_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_C_PACKAGE_GENERATE_SHLIBS ON)  # and lets ldconfig run
set(CPACK_DEBIAN_C_DESCRIPTION "C library for clients of the Tendon haptics server
 Nine functions for physics engines in C and in languages that can call C: wait for the position of the hand, and send
 a force.")
set(CPACK_DEBIAN_DEV_PACKAGE_NAME libtendon-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "libtendon1 (= ${PROJECT_VERSION}), libeigen3-dev, libprotobuf-dev, libsodium-dev, libsystemd-dev")
set(CPACK_DEBIAN_DEV_DESCRIPTION "Library for physics engines of the Tendon haptics server
 Opens a session over UDP, and calls a function that computes the force for the latest position.")
include(CPack)
