# What `cmake --install` puts where. Components, which are also the Debian packages (GrapnelPackages.cmake): program
# (the program, what it reads, its manual page), development (libraries, headers, find_package), mpi (grapnel-mpi) and,
# where it is built, python.
#
#   bin/grapnel                         lib/libgrapnel_<module>.a        lib/cmake/Grapnel/
#   include/grapnel/<module>/           share/grapnel/{scenarios,robots,studies,...,schemas,docs,examples}
#   lib/grapnel/grapnel-fmu.so (what `grapnel export-fmu` puts into FMUs)
#   share/man/man1/grapnel.1.gz         share/bash-completion/completions/grapnel
#
# Files of share/grapnel find each other as they do in the source tree. The whole of it can be moved.
if(GRAPNEL_INSTALL)
  include(GNUInstallDirs)
  include(CMakePackageConfigHelpers)
  set(GRAPNEL_DATADIR ${CMAKE_INSTALL_DATADIR}/grapnel)
endif()

# grapnel_find_package(<arguments of find_package, without REQUIRED>)
#
# Finds a package that the libraries need, and has those who find Grapnel installed find it too: static libraries carry
# none of what they call. A macro, since packages set variables.
macro(grapnel_find_package)
  find_package(${ARGV} REQUIRED)
  string(REPLACE ";" " " grapnel_found "${ARGV}")
  set_property(GLOBAL APPEND PROPERTY GRAPNEL_FOUND_PACKAGES "${grapnel_found}")
endmacro()

# A library as Grapnel::<name> of the installed package.
function(grapnel_install_library target name)
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  if(GRAPNEL_INSTALL)
    install(TARGETS ${target} EXPORT GrapnelTargets COMPONENT development
            ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  endif()
endfunction()

# What find_package(Grapnel) reads. After all modules.
function(grapnel_install_targets)
  get_property(packages GLOBAL PROPERTY GRAPNEL_FOUND_PACKAGES)
  list(REMOVE_DUPLICATES packages)
  list(TRANSFORM packages REPLACE "(.+)" "find_dependency(\\1)")
  list(JOIN packages "\n" GRAPNEL_DEPENDENCIES)
  set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/Grapnel)
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/GrapnelConfig.cmake.in
    ${PROJECT_BINARY_DIR}/GrapnelConfig.cmake
    INSTALL_DESTINATION ${config_dir} PATH_VARS GRAPNEL_DATADIR)
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/GrapnelConfigVersion.cmake
    VERSION ${PROJECT_VERSION} COMPATIBILITY SameMinorVersion)  # docs/stability.md
  install(FILES ${PROJECT_BINARY_DIR}/GrapnelConfig.cmake ${PROJECT_BINARY_DIR}/GrapnelConfigVersion.cmake
          DESTINATION ${config_dir} COMPONENT development)
  install(EXPORT GrapnelTargets NAMESPACE Grapnel:: DESTINATION ${config_dir} COMPONENT development)
endfunction()

# The manual page and the shell's completions, as the program that is built prints them.
function(grapnel_install_manual)
  find_program(GRAPNEL_GZIP NAMES gzip REQUIRED DOC "gzip, for the manual page")
  mark_as_advanced(GRAPNEL_GZIP)
  set(page ${PROJECT_BINARY_DIR}/manual/grapnel.1)
  set(completion ${PROJECT_BINARY_DIR}/manual/grapnel.bash)
  file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/manual)
  add_custom_command(
    OUTPUT ${page}.gz ${completion}
    COMMAND $<TARGET_FILE:grapnel> manual > ${page}
    COMMAND ${GRAPNEL_GZIP} -9nf ${page}
    COMMAND $<TARGET_FILE:grapnel> completion bash > ${completion}
    DEPENDS grapnel
    COMMENT "Printing the manual page"
    VERBATIM)
  add_custom_target(grapnel_manual ALL DEPENDS ${page}.gz ${completion})
  install(FILES ${page}.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
  install(FILES ${completion} DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME grapnel
          COMPONENT program)
endfunction()

function(grapnel_install_data)
  foreach(folder scenarios robots targets studies meshes schemas docs)
    if(IS_DIRECTORY ${PROJECT_SOURCE_DIR}/${folder})
      install(DIRECTORY ${PROJECT_SOURCE_DIR}/${folder} DESTINATION ${GRAPNEL_DATADIR} COMPONENT program
              PATTERN "site" EXCLUDE PATTERN "Doxyfile" EXCLUDE PATTERN "__pycache__" EXCLUDE)
    endif()
  endforeach()
  install(FILES README.md CHANGELOG.md CONTRIBUTING.md CITATION.cff LICENSE DESTINATION ${GRAPNEL_DATADIR} COMPONENT program)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples DESTINATION ${GRAPNEL_DATADIR} COMPONENT development
          PATTERN "CMakeLists.txt" EXCLUDE PATTERN "*.cmake" EXCLUDE PATTERN "__pycache__" EXCLUDE)
endfunction()

function(grapnel_install_package)
  if(GRAPNEL_NATIVE)
    install(CODE "message(WARNING \"These binaries are tuned to the machine that built them (GRAPNEL_NATIVE is ON): on an older \
processor they end with 'illegal instruction', and programs that link the libraries are compiled with -march=native. For binaries \
that travel: cmake --preset package\")" ALL_COMPONENTS)
  endif()
  grapnel_install_targets()
  if(TARGET grapnel)
    grapnel_install_manual()
    grapnel_install_data()
  endif()
endfunction()
