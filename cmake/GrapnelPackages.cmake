# Debian packages of what GrapnelInstall.cmake installs, one per component; scripts/packages builds and tries them.
# Depends of programs are what dpkg-shlibdeps finds; those of the library, which is static, are its headers' and its
# own: the packages that scripts/setup names under `build`, except tools.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME grapnel)
set(CPACK_PACKAGE_VENDOR Grapnel)
set(CPACK_PACKAGE_CONTACT "Grapnel's maintainers <maintainers@grapnel.invalid>")
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_STRIP_FILES ON)

get_cmake_property(CPACK_COMPONENTS_ALL COMPONENTS)
list(REMOVE_ITEM CPACK_COMPONENTS_ALL Unspecified)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(grapnel_about "Grapnel simulates how a service satellite with robot arms catches a tumbling object in orbit: approach,
 impact and the motion of the joined bodies afterwards, with momentum, energy and loop closure checked in every result.")

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME grapnel)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "gnuplot-nox | gnuplot")  # grapnel figure
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "libgrapnel-dev, python3-grapnel, bash-completion")
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "capture of tumbling objects in orbit by space robots
${grapnel_about}\n This package has the program, scenarios to start from, schemas for editors and the documentation.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libgrapnel-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
string(JOIN ", " CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
  "libeigen3-dev (>= 3.4)" "libfmt-dev (>= 9)" "nlohmann-json3-dev (>= 3.11)" "libyaml-cpp-dev (>= 0.7)" "libpugixml-dev (>= 1.12)"
  libhdf5-dev libmatio-dev libzip-dev liblz4-dev libzstd-dev libbz2-dev libnlopt-dev libnlopt-cxx-dev libxsimd-dev pkg-config)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_RECOMMENDS "cmake (>= 3.25), g++ (>= 4:12)")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS grapnel)
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "library for captures by space robots
${grapnel_about}\n This package has the C++20 library, static, with headers, find_package(Grapnel) and examples.")

set(CPACK_DEBIAN_MPI_PACKAGE_NAME grapnel-mpi)
set(CPACK_DEBIAN_MPI_PACKAGE_SECTION science)
set(CPACK_DEBIAN_MPI_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_MPI_PACKAGE_RECOMMENDS "grapnel, openmpi-bin")
set(CPACK_COMPONENT_MPI_DESCRIPTION "campaigns of captures on the ranks of an MPI job
${grapnel_about}\n This package has grapnel-mpi, which computes the cases of a campaign on many machines.")

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-grapnel)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
find_package(Python3 QUIET COMPONENTS Interpreter)
if(Python3_FOUND)
  math(EXPR grapnel_next_python "${Python3_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
      "python3 (>= 3.${Python3_VERSION_MINOR}), python3 (<< 3.${grapnel_next_python}), python3-numpy (>= 1:1.24)")
endif()
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS python3-pandas)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "grapnel, python3-matplotlib")
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "Python module for captures by space robots
${grapnel_about}\n This package has the Python module.")

# What Debian wants in every package: whose work it is, and what changed. Of the report's viewer its parts' licenses
# too.
find_program(GRAPNEL_GZIP NAMES gzip REQUIRED DOC "gzip, for the manual page")
execute_process(COMMAND ${GRAPNEL_GZIP} -9nc ${PROJECT_SOURCE_DIR}/CHANGELOG.md OUTPUT_FILE ${PROJECT_BINARY_DIR}/changelog.gz)
set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/CHANGELOG.md)
file(READ ${PROJECT_SOURCE_DIR}/cmake/copyright.in grapnel_copyright)
string(CONFIGURE "${grapnel_copyright}" grapnel_copyright @ONLY)
if(GRAPNEL_HAS_VIEWER)
  grapnel_viewer_licenses(grapnel_licenses)
  string(APPEND grapnel_copyright "${grapnel_licenses}")
endif()
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/copyright CONTENT "@grapnel_copyright@" @ONLY)
foreach(component IN LISTS CPACK_COMPONENTS_ALL)
  string(TOUPPER ${component} upper)
  set(package ${CPACK_DEBIAN_${upper}_PACKAGE_NAME})
  if(NOT package)
    message(FATAL_ERROR "cmake/GrapnelPackages.cmake: component '${component}' has no package; name its CPACK_DEBIAN_${upper}_PACKAGE_NAME")
  endif()
  install(FILES ${PROJECT_BINARY_DIR}/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component})
  install(FILES ${PROJECT_BINARY_DIR}/changelog.gz DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component})
endforeach()

# Packages travel. Of a build that is tuned to one machine there are some to be tried on it, by another version's name.
set(CPACK_GRAPNEL_NATIVE ${GRAPNEL_NATIVE})
set(CPACK_PROJECT_CONFIG_FILE ${PROJECT_SOURCE_DIR}/cmake/GrapnelPackagesNative.cmake)
include(CPack)
