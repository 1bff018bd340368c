# SPDX-License-Identifier: Apache-2.0
# What `cmake --install` brings, and the three Debian packages that `cpack` makes of it: `tendon`, to run; `tendon-plug`, for the
# machine of a program that exists already, which needs nothing else; and `libtendon-dev`, to write an engine with:
# find_package(tendon), tendon::client.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(programs tendond tendon-inject tendon-softbody tendon-lab tendon-report tendon-identify tendon-replay tendon-conformance)
install(TARGETS tendond tendon-softbody tendon-lab tendon-report tendon-identify tendon-replay COMPONENT programs)
install(DIRECTORY deploy/scenes/ DESTINATION ${CMAKE_INSTALL_DATADIR}/tendon/scenes COMPONENT programs
        FILES_MATCHING PATTERN "*.toml" PATTERN "*.msh")
install(FILES README.md CHANGELOG.md LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT programs)
install(FILES deploy/discovery/README.md deploy/discovery/records.md deploy/discovery/tendon.service.in
        DESTINATION ${CMAKE_INSTALL_DATADIR}/tendon/discovery COMPONENT programs)
if(TARGET tendon-dash)
  list(APPEND programs tendon-dash)
  install(TARGETS tendon-dash COMPONENT programs)
  install(DIRECTORY deploy/monitoring DESTINATION ${CMAKE_INSTALL_DATADIR}/tendon COMPONENT programs)
endif()
install(TARGETS tendon-plug COMPONENT plug)
# Where the program looks for them: beside its own folder.
install(TARGETS hdPhantom HD LIBRARY DESTINATION lib/tendon/chai3d COMPONENT plug)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/tendon-plug COMPONENT plug)
# What belongs to the whole machine is for packages only: `cmake --install` into a home folder leaves /etc alone.
install(FILES deploy/udev/60-tendon.rules DESTINATION lib/udev/rules.d COMPONENT machine EXCLUDE_FROM_ALL)
install(FILES deploy/systemd/tendond.service DESTINATION lib/systemd/system COMPONENT machine EXCLUDE_FROM_ALL)
install(FILES deploy/scenes/demo.toml DESTINATION /etc/tendon RENAME scene.toml COMPONENT machine EXCLUDE_FROM_ALL)

# One file completes all programs; bash-completion looks for one by the name of each.
set(completions ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
foreach(program ${programs})
  install(FILES deploy/packaging/completion.bash DESTINATION ${completions} RENAME ${program} COMPONENT programs)
endforeach()
install(FILES deploy/packaging/completion.bash DESTINATION ${completions} RENAME tendon-plug COMPONENT plug)

# A manual page is what --help says.
find_program(HELP2MAN help2man)
if(HELP2MAN)
  set(pages)
  foreach(program ${programs} tendon-plug)
    set(page ${CMAKE_CURRENT_BINARY_DIR}/man/${program}.1)
    add_custom_command(OUTPUT ${page}.gz
      COMMAND ${HELP2MAN} --no-info --no-discard-stderr --section 1 --version-string ${PROJECT_VERSION}
              --name "$<IF:$<STREQUAL:${program},tendond>,networked haptics server,part of the Tendon haptics server>"
              --output ${page} $<TARGET_FILE:${program}>
      COMMAND gzip -9nf ${page}
      DEPENDS ${program} VERBATIM)
    list(APPEND pages ${page}.gz)
    if(program STREQUAL "tendon-plug")
      install(FILES ${page}.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT plug)
    else()
      install(FILES ${page}.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT programs)
    endif()
  endforeach()
  add_custom_target(man ALL DEPENDS ${pages})
else()
  message(STATUS "No help2man: no manual pages")
endif()

# The client's library. Headers keep the names that they have here: #include "clients/cpp/run.h".
set(libraries tendon_client tendon_server_name tendon_protocol tendon_address tendon_proto tendon_core tendon_core_design)
foreach(library ${libraries})
  string(REPLACE tendon_ "" name ${library})
  set_target_properties(${library} PROPERTIES EXPORT_NAME ${name})
endforeach()
install(TARGETS ${libraries} EXPORT tendon COMPONENT development INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tendon)
# CMake strips programs, and leaves archives as they are.
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
set(CPACK_COMPONENTS_ALL programs machine injector conformance plug development)
set(CPACK_COMPONENT_PROGRAMS_GROUP run)
set(CPACK_COMPONENT_MACHINE_GROUP run)
set(CPACK_COMPONENT_INJECTOR_GROUP run)
set(CPACK_COMPONENT_CONFORMANCE_GROUP run)
set(CPACK_COMPONENT_PLUG_GROUP plug)
set(CPACK_COMPONENT_DEVELOPMENT_GROUP dev)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_RUN_PACKAGE_NAME tendon)
set(CPACK_DEBIAN_RUN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_RUN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_RUN_PACKAGE_RECOMMENDS gnuplot-nox)
set(CPACK_DEBIAN_RUN_PACKAGE_SUGGESTS avahi-daemon)
set(CPACK_DEBIAN_RUN_DESCRIPTION "Networked haptics server with an energy-bounding output limiter
 Runs the loop of a haptic device at 1 kHz and bounds every force so that the device never gives out more energy than it took in,
 while physics engines anywhere on the network send forces late, rarely or wrong.")
set(CPACK_DEBIAN_RUN_PACKAGE_CONTROL_EXTRA ${CMAKE_CURRENT_SOURCE_DIR}/deploy/packaging/conffiles)
set(CPACK_DEBIAN_PLUG_PACKAGE_NAME tendon-plug)
set(CPACK_DEBIAN_PLUG_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PLUG_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PLUG_DESCRIPTION "Haptic devices of a Tendon server for programs that exist already
 Runs beside a program that knows CHAI3D, VRPN, Inverse-compatible JSON or ROS 2, and gives it the device of a Tendon server
 anywhere on the network, behind an output limiter that bounds its energy.")
set(CPACK_DEBIAN_DEV_PACKAGE_NAME libtendon-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "libeigen3-dev, libprotobuf-dev, libsodium-dev, libsystemd-dev")
set(CPACK_DEBIAN_DEV_DESCRIPTION "Library to write a physics engine for the Tendon haptics server
 A session over UDP, newest pose wins, one callback: position in, force out.")
include(CPack)
