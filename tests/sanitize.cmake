# SPDX-License-Identifier: Apache-2.0
# Compiler and linker flags for the sanitizers and libFuzzer, which are used for everything that is compiled after this.
set(TENDON_SANITIZE "" CACHE STRING "Sanitizers, as -fsanitize= takes them (see the presets asan and tsan)")
option(TENDON_SANITIZE_ALL "With sanitizers: build and test also what is outside of the rooms that a server is made of" OFF)
option(TENDON_FUZZ "Build the fuzz targets (clang)" OFF)

if(TENDON_SANITIZE)
  add_compile_options(-fsanitize=${TENDON_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${TENDON_SANITIZE})
  # These two checks test every access through a pointer and take as much time as all other checks together. Except for
  # alignment and bad casts, AddressSanitizer finds the same errors. deploy/test-sanitizers enables them.
  if(TENDON_SANITIZE MATCHES "undefined" AND NOT TENDON_SANITIZE_ALL)
    add_compile_options(-fno-sanitize=null,alignment,object-size,vptr)
  endif()
  # With sanitizers g++ 12 warns of uses and overruns that do not exist (std::function, std::regex, std::string), and of
  # fences that TSan does not follow (Asio's; each of our Asio objects belongs to one thread). The builds without
  # sanitizers keep these warnings as errors.
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    add_compile_options(-Wno-array-bounds -Wno-maybe-uninitialized -Wno-tsan)
  endif()
endif()

if(TENDON_FUZZ AND NOT CMAKE_CXX_COMPILER_ID MATCHES "Clang")
  message(FATAL_ERROR "TENDON_FUZZ needs clang: -DCMAKE_CXX_COMPILER=clang++")
endif()

# tendon_fuzzer(target): libFuzzer's main function and its coverage counters.
function(tendon_fuzzer target)
  target_compile_options(${target} PRIVATE -fsanitize=fuzzer)
  target_link_options(${target} PRIVATE -fsanitize=fuzzer)
endfunction()
