# Python's module: GRAPNEL_PYTHON selects it. ON requires it, OFF omits it, AUTO builds it if Python 3.9 or later with
# its headers,
# NumPy and pybind11 are found (part of another project: OFF). Sets GRAPNEL_HAS_PYTHON.
#
# Debian's NumPy and pybind11 belong to /usr/bin/python3, so where that has NumPy it is the one that is taken; another
# one is named by -DPython3_EXECUTABLE=.
set(GRAPNEL_PYTHON ${GRAPNEL_PYTHON_DEFAULT} CACHE STRING "Build the Python module (needs pybind11 and NumPy): AUTO, ON, OFF")
set_property(CACHE GRAPNEL_PYTHON PROPERTY STRINGS AUTO ON OFF)

set(GRAPNEL_HAS_PYTHON OFF)
if(GRAPNEL_PYTHON STREQUAL "AUTO" OR GRAPNEL_PYTHON)
  if(NOT Python3_EXECUTABLE AND EXISTS /usr/bin/python3)
    execute_process(COMMAND /usr/bin/python3 -c "import numpy" RESULT_VARIABLE failed OUTPUT_QUIET ERROR_QUIET)
    if(NOT failed)
      set(Python3_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "Python for which the module is built")
    endif()
  endif()
  # Development.Module alone: the module's symbols of Python come from the interpreter that loads it.
  find_package(Python3 3.9 QUIET COMPONENTS Interpreter Development.Module NumPy)
  # pybind11 looks for Python under its newer name; it gets the one found above.
  set(PYBIND11_FINDPYTHON OFF)
  set(PYTHON_EXECUTABLE ${Python3_EXECUTABLE})
  if(Python3_FOUND)
    find_package(pybind11 2.10 QUIET CONFIG)
  endif()
  if(Python3_FOUND AND pybind11_FOUND)
    set(GRAPNEL_HAS_PYTHON ON)
    message(STATUS "Python module: for ${Python3_EXECUTABLE} ${Python3_VERSION}, NumPy ${Python3_NumPy_VERSION}, "
                   "pybind11 ${pybind11_VERSION}")
  else()
    set(reason "pybind11 (Debian: pybind11-dev) was not found")
    if(NOT Python3_FOUND)
      set(reason "Python 3.9 or later with its headers and NumPy (Debian: python3-dev python3-numpy) was not found")
    endif()
    if(NOT GRAPNEL_PYTHON STREQUAL "AUTO")
      message(FATAL_ERROR "GRAPNEL_PYTHON is ${GRAPNEL_PYTHON}, but ${reason}")
    endif()
    message(STATUS "Python module: not built, ${reason}")
  endif()
endif()
