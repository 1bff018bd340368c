# SPDX-License-Identifier: Apache-2.0
# cmake -D NODE=… -D PAGE=… -D OUT=… -P embed.cmake: builds the page in PAGE with Vite, and writes OUT/page_files.cc, which holds
# its files, as they are and compressed, by .incbin. With an empty NODE the page is missing.html.
set(built ${OUT}/page)
file(REMOVE_RECURSE ${built})
if(NODE)
  execute_process(COMMAND ${NODE} node_modules/typescript/bin/tsc -p tsconfig.json
                  WORKING_DIRECTORY ${PAGE} COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND ${NODE} node_modules/vite/bin/vite.js build --logLevel warn --outDir ${built} --emptyOutDir
                  WORKING_DIRECTORY ${PAGE} COMMAND_ERROR_IS_FATAL ANY)
else()
  configure_file(${CMAKE_CURRENT_LIST_DIR}/missing.html ${built}/index.html COPYONLY)
endif()

set(type_html "text/html; charset=utf-8")
set(type_js "text/javascript; charset=utf-8")
set(type_css "text/css; charset=utf-8")
set(type_svg "image/svg+xml")

file(GLOB_RECURSE files RELATIVE ${built} ${built}/*)
list(SORT files)
set(blobs)
set(table)
set(number 0)
foreach(file ${files})
  get_filename_component(ending ${file} LAST_EXT)
  string(SUBSTRING "${ending}" 1 -1 ending)
  if(NOT DEFINED type_${ending})
    message(FATAL_ERROR "embed.cmake does not know what type ${file} is of")
  endif()
  execute_process(COMMAND gzip -9nc ${built}/${file} OUTPUT_FILE ${OUT}/page-${number}.gz COMMAND_ERROR_IS_FATAL ANY)
  foreach(blob "bytes_${number}:${built}/${file}" "gzip_${number}:${OUT}/page-${number}.gz")
    string(REGEX MATCH "^([^:]*):(.*)$" _ "${blob}")
    string(APPEND blobs "asm(\".pushsection .rodata\\n.global tendon_page_${CMAKE_MATCH_1}\\n.global tendon_page_${CMAKE_MATCH_1}_end\\n\"
    \"tendon_page_${CMAKE_MATCH_1}:\\n.incbin \\\"${CMAKE_MATCH_2}\\\"\\ntendon_page_${CMAKE_MATCH_1}_end:\\n.byte 0\\n.popsection\\n\");
extern \"C\" const char tendon_page_${CMAKE_MATCH_1}[], tendon_page_${CMAKE_MATCH_1}_end[];\n")
  endforeach()
  string(APPEND table "      {\"/${file}\", \"${type_${ending}}\", text(tendon_page_bytes_${number}, tendon_page_bytes_${number}_end),
       text(tendon_page_gzip_${number}, tendon_page_gzip_${number}_end)},\n")
  math(EXPR number "${number} + 1")
endforeach()

file(WRITE ${OUT}/page_files.cc "// Made by embed.cmake.
#include \"clients/dashboard/page_files.h\"

#include <array>
#include <cstddef>

${blobs}
namespace tendon::dash {

std::span<const PageFile> page_files() {
  const auto text = [](const char* begin, const char* end) { return std::string_view(begin, static_cast<std::size_t>(end - begin)); };
  static const std::array<PageFile, ${number}> files = {{
${table}  }};
  return files;
}

}  // namespace tendon::dash
")
