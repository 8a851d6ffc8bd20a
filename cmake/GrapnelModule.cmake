# Modules in dependency order: a module may use only those before it.
set(GRAPNEL_MODULES text spatial describe model import dynamics integrate contact constraint impact simulate identify lanes plan result control report
    problem approach capture linear scenario campaign compare plant api)

# Libraries may end in a shared one, such as Python's module. No function of theirs is ever replaced by one of that name
# from elsewhere, which the compiler would allow for by not inlining it: this is what makes position-independent code
# cost nothing
# (docs/performance.md).
function(grapnel_position_independent target)
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  target_compile_options(${target} PRIVATE -fno-semantic-interposition)
endfunction()

# grapnel_module(<name> [TEXT] [LIGHT] [SOURCES <file>...] [USES <module>...] [LIBRARIES <target>...] [PRIVATE_LIBRARIES
# <target>...])
#
# Defines grapnel::<name>, and Grapnel::<name> as for users of an installed Grapnel. Its headers are
# visible as "grapnel/<name>/..." only to targets that link it: each module's include directory holds a link to that
# module alone, so that an
# include against the dependency order does not compile. Installed they lie in one directory. TEXT: the module reads and
# writes text and files, once per command and never per case. LIGHT, which TEXT implies: the module computes little
# itself. Both are compiled at -O1, in
# two thirds of the time, and without optimization under sanitizers, in two fifths.
function(grapnel_module name)
  cmake_parse_arguments(ARG "TEXT;LIGHT" "" "SOURCES;USES;LIBRARIES;PRIVATE_LIBRARIES" ${ARGN})
  list(FIND GRAPNEL_MODULES ${name} own_rank)
  if(own_rank EQUAL -1)
    message(FATAL_ERROR "grapnel_module: '${name}' is not in GRAPNEL_MODULES")
  endif()
  foreach(used ${ARG_USES})
    list(FIND GRAPNEL_MODULES ${used} used_rank)
    if(used_rank EQUAL -1 OR used_rank GREATER_EQUAL own_rank)
      message(FATAL_ERROR "grapnel_module: '${name}' must not use '${used}': modules depend only on earlier ones")
    endif()
  endforeach()

  set(include_root ${PROJECT_BINARY_DIR}/include/${name})
  file(MAKE_DIRECTORY ${include_root}/grapnel)
  file(CREATE_LINK ${CMAKE_CURRENT_SOURCE_DIR} ${include_root}/grapnel/${name} SYMBOLIC)

  set(target grapnel_${name})
  list(TRANSFORM ARG_USES PREPEND grapnel:: OUTPUT_VARIABLE used_targets)
  if(ARG_SOURCES)
    add_library(${target} STATIC ${ARG_SOURCES})
    # All files compile as one: headers are read and templates compiled once for all of them. A file with compile
    # separate options remains alone.
    set_target_properties(${target} PROPERTIES UNITY_BUILD ${GRAPNEL_UNITY} UNITY_BUILD_BATCH_SIZE 0)
    if(GRAPNEL_UNITY AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      # A class of one file may have members of that file's own types; the warning takes the file for a header.
      target_compile_options(${target} PRIVATE -Wno-subobject-linkage)
    endif()
    grapnel_position_independent(${target})
    set(optimized FULLY)
    if(ARG_TEXT OR ARG_LIGHT)
      set(optimized LIGHTLY)
    endif()
    set_target_properties(${target} PROPERTIES GRAPNEL_OPTIMIZED ${optimized})  # the order in which tests link modules
    if(ARG_TEXT OR ARG_LIGHT)
      target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
    endif()
    if(GRAPNEL_SANITIZE AND (ARG_TEXT OR ARG_LIGHT))
      target_compile_options(${target} PRIVATE -O0)
    endif()
    set(scope PUBLIC)
    target_link_libraries(${target} PRIVATE ${ARG_PRIVATE_LIBRARIES})
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  target_include_directories(${target} ${scope} $<BUILD_INTERFACE:${include_root}>)
  target_link_libraries(${target} ${scope} grapnel::options ${used_targets} ${ARG_LIBRARIES})
  add_library(grapnel::${name} ALIAS ${target})
  add_library(Grapnel::${name} ALIAS ${target})
  grapnel_install_library(${target} ${name})
  if(GRAPNEL_INSTALL)
    install(DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/grapnel/${name}
            COMPONENT development FILES_MATCHING PATTERN "*.hpp" PATTERN "*.h")
  endif()
endfunction()

# Sets <out> to the compiled modules that the targets link, directly or through other targets of Grapnel: those compiled
# with full optimization first.
function(grapnel_modules_of out)
  set(queue ${ARGN})
  set(seen)
  set(FULLY)
  set(LIGHTLY)
  while(queue)
    list(POP_FRONT queue target)
    string(REGEX REPLACE "^\\$<LINK_ONLY:(.*)>$" "\\1" target "${target}")
    if(NOT target MATCHES "^grapnel" OR NOT TARGET ${target})
      continue()
    endif()
    get_target_property(aliased ${target} ALIASED_TARGET)
    if(aliased)
      set(target ${aliased})
    endif()
    if(target IN_LIST seen)
      continue()
    endif()
    list(APPEND seen ${target})
    get_target_property(optimized ${target} GRAPNEL_OPTIMIZED)
    if(optimized)
      list(APPEND ${optimized} ${target})
    endif()
    get_target_property(linked ${target} INTERFACE_LINK_LIBRARIES)
    if(linked)
      list(APPEND queue ${linked})
    endif()
  endwhile()
  set(${out} ${FULLY} ${LIGHTLY} PARENT_SCOPE)
endfunction()

# grapnel_link_modules_first(<target>...): for programs and plugins, once their libraries are defined.
#
# Functions that are not inlined, as most of the standard library's and Eigen's products and decompositions, are in every
# object that calls them, and the linker takes the first. Modules with full optimization therefore come first: otherwise
# the copies of a module of text, or of a test, would slow the others down, and would give the program and the Python
# module different last bits of some results.
function(grapnel_link_modules_first)
  if(APPLE OR NOT CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang")
    return()
  endif()
  foreach(target ${ARGN})
    get_target_property(libraries ${target} LINK_LIBRARIES)
    grapnel_modules_of(modules ${libraries})
    if(modules)
      list(TRANSFORM modules REPLACE "(.+)" "$<TARGET_FILE:\\1>" OUTPUT_VARIABLE files)
      list(JOIN files " " files)
      target_link_options(${target} PRIVATE "SHELL:-Wl,--whole-archive ${files} -Wl,--no-whole-archive")
    endif()
  endforeach()
endfunction()
