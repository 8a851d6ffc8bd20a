# The report's viewer: TypeScript in web/, bundled by esbuild from npm and embedded into the program.
#
# GRAPNEL_WEB selects it: ON requires it, OFF omits it, AUTO builds it if possible (as part of another project: OFF).
# This is determined when the build is configured: Node.js 18 or later and npm are there, and `npm ci` could get the
# packages of web/package-lock.json. They go to the build tree (web/ there); the source tree is unchanged. Without a
# viewer only reports are unavailable.
# What is wrong with web/src itself fails the build in AUTO too.
set(GRAPNEL_WEB ${GRAPNEL_WEB_DEFAULT} CACHE STRING "Embed the report's viewer (needs Node.js and npm): AUTO, ON, OFF")
set_property(CACHE GRAPNEL_WEB PROPERTY STRINGS AUTO ON OFF)

set(grapnel_web_source ${CMAKE_CURRENT_LIST_DIR}/../web)
cmake_path(NORMAL_PATH grapnel_web_source)
set(grapnel_web ${PROJECT_BINARY_DIR}/web)

# Sets <reason> to why there are no packages in the build tree, or to "" where they are.
function(grapnel_install_viewer_packages reason)
  find_program(GRAPNEL_NODE NAMES node nodejs DOC "Node.js, for the report's viewer")
  find_program(GRAPNEL_NPM NAMES npm DOC "npm, for the report's viewer")
  mark_as_advanced(GRAPNEL_NODE GRAPNEL_NPM)
  if(NOT GRAPNEL_NODE OR NOT GRAPNEL_NPM)
    set(${reason} "Node.js and npm were not found" PARENT_SCOPE)
    return()
  endif()
  execute_process(COMMAND ${GRAPNEL_NODE} --version OUTPUT_VARIABLE version OUTPUT_STRIP_TRAILING_WHITESPACE
                  ERROR_QUIET RESULT_VARIABLE failed)
  string(REGEX REPLACE "^v" "" version "${version}")
  if(failed OR version VERSION_LESS 18)
    set(${reason} "Node.js 18 or later is needed, ${GRAPNEL_NODE} is '${version}'" PARENT_SCOPE)
    return()
  endif()

  set(all)
  foreach(file package.json package-lock.json .npmrc build.mjs)
    configure_file(${grapnel_web_source}/${file} ${grapnel_web}/${file} COPYONLY)
    if(NOT file STREQUAL build.mjs)
      file(READ ${grapnel_web_source}/${file} text)
      string(APPEND all "${text}")
    endif()
  endforeach()
  string(SHA256 wanted "${all}")
  set(stamp ${grapnel_web}/packages.sha256)
  set(installed)
  if(EXISTS ${stamp})
    file(READ ${stamp} installed)
  endif()
  if(NOT installed STREQUAL wanted)
    message(STATUS "Report viewer: installing its packages (npm ci)")
    file(REMOVE ${stamp})
    # No scripts of packages are run, because none needs one. Few retries, so that a machine without network continues.
    set(cache)
    foreach(attempt 1 2)
      execute_process(COMMAND ${GRAPNEL_NPM} ci --ignore-scripts --no-audit --no-fund --prefer-offline
                              --fetch-retries=1 --fetch-retry-mintimeout=1000 --fetch-timeout=60000 ${cache}
                      WORKING_DIRECTORY ${grapnel_web} TIMEOUT 300
                      OUTPUT_VARIABLE output ERROR_VARIABLE output RESULT_VARIABLE failed)
      if(NOT failed OR NOT output MATCHES "EACCES|EPERM|EROFS")
        break()
      endif()
      # npm's own cache cannot be written, as where there is no home folder.
      set(cache --cache ${grapnel_web}/npm-cache)
    endforeach()
    if(failed)
      string(REGEX MATCH "npm (ERR!|error)[^\n]*\n[^\n]*\n?[^\n]*" said "${output}")
      string(REGEX REPLACE "[\n]+" "; " said "${said}")
      set(${reason} "npm ci failed (${failed}): ${said}" PARENT_SCOPE)
      return()
    endif()
    file(WRITE ${stamp} ${wanted})
  endif()
  set(${reason} "" PARENT_SCOPE)
endfunction()

set(GRAPNEL_HAS_VIEWER OFF)
if(GRAPNEL_WEB STREQUAL "AUTO" OR GRAPNEL_WEB)
  grapnel_install_viewer_packages(reason)
  if(reason STREQUAL "")
    set(GRAPNEL_HAS_VIEWER ON)
    enable_language(ASM)  # .incbin
    message(STATUS "Report viewer: bundled with ${GRAPNEL_NODE}")
  elseif(GRAPNEL_WEB STREQUAL "AUTO")
    message(WARNING "Grapnel is built without its report viewer: ${reason}.\n"
                    "Everything else works. For reports, fix this and configure again, or use -DGRAPNEL_WEB=OFF to build without reports.")
  else()
    message(FATAL_ERROR "GRAPNEL_WEB is ${GRAPNEL_WEB}, but: ${reason}")
  endif()
endif()

# Adds the viewer to a target of this directory; report_html.cpp there gives it to the others.
function(grapnel_embed_viewer target)
  if(NOT GRAPNEL_HAS_VIEWER)
    return()
  endif()
  set(out ${grapnel_web}/dist)
  set(GRAPNEL_VIEWER_SCRIPT ${out}/viewer.js)
  set(GRAPNEL_VIEWER_STYLE ${out}/viewer.css)
  add_custom_command(
    OUTPUT ${GRAPNEL_VIEWER_SCRIPT} ${GRAPNEL_VIEWER_STYLE}
    COMMAND ${GRAPNEL_NODE} ${grapnel_web}/build.mjs ${out} --source ${grapnel_web_source} --depfile ${out}/viewer.d
    DEPENDS ${grapnel_web}/build.mjs ${grapnel_web}/packages.sha256 ${grapnel_web_source}/src/main.ts
            ${grapnel_web_source}/tsconfig.json
    DEPFILE ${out}/viewer.d
    COMMENT "Bundling the report's viewer"
    VERBATIM)
  set(assembly ${CMAKE_CURRENT_BINARY_DIR}/viewer.S)
  configure_file(${CMAKE_CURRENT_SOURCE_DIR}/viewer.S.in ${assembly} @ONLY)
  set_source_files_properties(${assembly} PROPERTIES OBJECT_DEPENDS "${GRAPNEL_VIEWER_SCRIPT};${GRAPNEL_VIEWER_STYLE}")
  target_sources(${target} PRIVATE ${assembly})
  set_source_files_properties(report_html.cpp PROPERTIES COMPILE_DEFINITIONS GRAPNEL_HAS_VIEWER)
endfunction()

# Sets <out> to the licenses of the packages that are bundled, one paragraph each, as a copyright file of Debian has
# them.
function(grapnel_viewer_licenses out)
  file(READ ${grapnel_web}/package-lock.json lock)
  string(JSON count LENGTH "${lock}" packages)
  math(EXPR last "${count} - 1")
  set(paragraphs "")
  foreach(i RANGE ${last})
    string(JSON folder MEMBER "${lock}" packages ${i})
    string(JSON dev ERROR_VARIABLE none GET "${lock}" packages "${folder}" dev)
    if(folder STREQUAL "" OR dev STREQUAL "ON" OR dev STREQUAL "true")
      continue()
    endif()
    string(JSON version GET "${lock}" packages "${folder}" version)
    string(JSON license GET "${lock}" packages "${folder}" license)
    file(GLOB texts ${grapnel_web}/${folder}/LICENSE* ${grapnel_web}/${folder}/license*)
    if(NOT texts)
      message(FATAL_ERROR "${folder} of the report's viewer has no license file")
    endif()
    list(GET texts 0 text)
    file(READ ${text} text)
    string(REGEX MATCH "Copyright[^\n]*" copyright "${text}")
    string(REGEX REPLACE "^Copyright *(\\([cC]\\)|©)? *" "" copyright "${copyright}")
    string(STRIP "${text}" text)
    string(REGEX REPLACE "\r" "" text "${text}")
    string(REGEX REPLACE "\n" "\n " text "${text}")
    string(REGEX REPLACE "\n +\n" "\n .\n" text "${text}")
    string(REGEX REPLACE "\n +\n" "\n .\n" text "${text}")
    string(REGEX REPLACE "^node_modules/" "" name "${folder}")
    string(APPEND paragraphs "\nFiles: web/node_modules/${name}/*\nComment: version ${version}, within the viewer of reports\n"
                             "Copyright: ${copyright}\nLicense: ${license}\n ${text}\n")
  endforeach()
  set(${out} "${paragraphs}" PARENT_SCOPE)
endfunction()
