# SPDX-License-Identifier: Apache-2.0
# Precompiled headers for tests that are not optimized.
#
# With clang, the inline functions of these headers are compiled only once. They are optimized and put into an object
# that each program links, instead of being compiled again in each source (https://clang.llvm.org/docs/UsersManual.html,
# "Building a PCH with object file").
#
# Only tests may do this. The linker keeps one copy of an inline function, and an installed program must not get a copy
# that was not optimized.

# A failed test prints its line. Use the preset `dev` with a debugger.
set(tests_debug_information $<$<CONFIG:RelWithDebInfo>:-g0>)

# tendon_headers(name LIBS … HEADERS …): declares a set of headers.
function(tendon_headers name)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "" "" "LIBS;HEADERS")
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${name}.cc CONTENT "// Carries the precompiled headers.\n")
  add_library(${name} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/${name}.cc)
  set_target_properties(${name} PROPERTIES UNITY_BUILD OFF)
  target_compile_options(${name} PRIVATE -O0 ${tests_debug_information})
  target_link_libraries(${name} PRIVATE ${ARG_LIBS} tendon_warnings)
  target_precompile_headers(${name} PRIVATE ${ARG_HEADERS})
  if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
    target_compile_options(${name} PRIVATE -Xclang -fmodules-codegen -fpch-instantiate-templates)
    set(functions ${CMAKE_CURRENT_BINARY_DIR}/${name}_functions.o)
    get_directory_property(options COMPILE_OPTIONS)
    list(FILTER options INCLUDE REGEX sanitize|frame-pointer)
    add_custom_command(
      OUTPUT ${functions}
      COMMAND ${CMAKE_CXX_COMPILER} ${options} -O2 -ffunction-sections
              -c CMakeFiles/${name}.dir/cmake_pch.hxx.pch -o ${functions}
      DEPENDS $<TARGET_OBJECTS:${name}>
      VERBATIM)
    add_custom_target(${name}_functions DEPENDS ${functions})
    set_target_properties(${name}_functions PROPERTIES FUNCTIONS ${functions})
  endif()
endfunction()

# tendon_links_headers(program name): for a program that links objects compiled with the headers `name`.
function(tendon_links_headers program name)
  if(TARGET ${name}_functions)
    set(scope PRIVATE)
    get_target_property(type ${program} TYPE)
    if(NOT type STREQUAL EXECUTABLE)
      set(scope INTERFACE)
    endif()
    get_target_property(functions ${name}_functions FUNCTIONS)
    # The object is a source, so it comes before the libraries and no member of an archive is linked only for an inline
    # function. Some of these functions call others that no library defines. The linker drops them because they are
    # never called.
    target_sources(${program} ${scope} ${functions})
    add_dependencies(${program} ${name}_functions)
  endif()
endfunction()

# tendon_unoptimized(target name): compiles the target's sources with the headers `name`, and without optimization.
function(tendon_unoptimized target name)
  target_compile_options(${target} PRIVATE -O0 ${tests_debug_information})
  target_precompile_headers(${target} REUSE_FROM ${name})
  tendon_links_headers(${target} ${name})
endfunction()
