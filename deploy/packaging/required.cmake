# SPDX-License-Identifier: Apache-2.0
# These packages are required. If one of them is missing, the error message contains the name of the Debian package.

# tendon_requires(DEBIAN package NAME …) uses find_package(), tendon_requires(DEBIAN module NAME MODULE) uses
# pkg-config, and tendon_requires(DEBIAN library|path VARIABLE …) uses find_library() or find_path().
macro(tendon_requires debian kind name)
  set(CMAKE_MESSAGE_LOG_LEVEL NOTICE)  # QUIET does not apply to the dependencies of a package
  if("${kind}" STREQUAL "package")
    find_package(${name} QUIET ${ARGN})
    set(tendon_has ${${name}_FOUND})
  elseif("${kind}" STREQUAL "module")
    pkg_check_modules(${name} QUIET IMPORTED_TARGET GLOBAL ${ARGN})
    set(tendon_has ${${name}_FOUND})
  else()
    cmake_language(CALL find_${kind} ${name} ${ARGN})
    set(tendon_has ${${name}})
  endif()
  unset(CMAKE_MESSAGE_LOG_LEVEL)
  if(NOT tendon_has)
    message(FATAL_ERROR "Tendon needs ${debian}. To install all that it needs: deploy/setup demo (with tests: deploy/setup test).")
  endif()
endmacro()

tendon_requires(libc6-dev package Threads)
tendon_requires(pkgconf package PkgConfig)
tendon_requires(libeigen3-dev package Eigen3 NO_MODULE)
tendon_requires(nlohmann-json3-dev package nlohmann_json)
tendon_requires(libprotobuf-dev package Protobuf)
if(NOT TARGET protobuf::protoc)
  message(FATAL_ERROR "Tendon needs protobuf-compiler. To install all that it needs: deploy/setup demo.")
endif()
tendon_requires(libtomlplusplus-dev package tomlplusplus)
tendon_requires(libcli11-dev package CLI11)
tendon_requires(zlib1g-dev package ZLIB)
tendon_requires(libasio-dev path ASIO_INCLUDE_DIR asio.hpp)
tendon_requires(libsodium-dev module sodium libsodium)
tendon_requires(libsystemd-dev module systemd libsystemd)
tendon_requires(libxxhash-dev module xxhash libxxhash)
# In Debian 12, CHOLMOD does not have any files for CMake or pkg-config.
tendon_requires(libsuitesparse-dev library CHOLMOD_LIBRARY cholmod)
tendon_requires(libsuitesparse-dev path CHOLMOD_INCLUDE_DIR cholmod.h PATH_SUFFIXES suitesparse)
# This header-only library is used for Lanczos' method.
tendon_requires(libspectra-dev path SPECTRA_INCLUDE_DIR Spectra/SymEigsSolver.h)
