# cmake -DSOURCE=<source> -DCOMPILER=<c++> -DEIGEN=<include folder> -DWORK=<folder> -P headers.cmake
#
# Every header of grapnel/api compiles alone, and reaches only the headers of reachable.txt: plain data, and functions
# that are part of the API. The folder has at most 20 headers, all of which grapnel.hpp includes.
cmake_minimum_required(VERSION 3.25)
file(GLOB headers RELATIVE ${SOURCE} ${SOURCE}/grapnel/api/*.hpp)
list(LENGTH headers count)
if(count EQUAL 0 OR count GREATER 20)
  message(SEND_ERROR "grapnel/api has ${count} headers")
endif()
file(STRINGS ${CMAKE_CURRENT_LIST_DIR}/reachable.txt reachable REGEX "^grapnel/")

foreach(header IN LISTS headers)
  file(WRITE ${WORK}/alone.cpp "#include \"${header}\"\n")
  execute_process(COMMAND ${COMPILER} -std=c++20 -fsyntax-only -Wall -Wextra -Werror -MMD -MF ${WORK}/alone.d
                          -I${SOURCE} -isystem ${EIGEN} ${WORK}/alone.cpp
                  RESULT_VARIABLE failed ERROR_VARIABLE errors)
  if(failed)
    message(SEND_ERROR "${header} does not compile alone:\n${errors}")
    continue()
  endif()
  file(READ ${WORK}/alone.d found)
  string(REGEX MATCHALL "grapnel/[a-z_0-9/]+\\.hp*" found "${found}")
  foreach(one IN LISTS found)
    if(NOT one MATCHES "^grapnel/api/" AND NOT one IN_LIST reachable)
      message(SEND_ERROR "${header} reaches ${one}. Cut the include; only plain data and functions of the API belong "
                         "in tests/api/reachable.txt")
    endif()
  endforeach()
  if(header STREQUAL "grapnel/api/grapnel.hpp")
    foreach(one IN LISTS headers)
      if(NOT one IN_LIST found)
        message(SEND_ERROR "grapnel/api/grapnel.hpp does not include ${one}")
      endif()
    endforeach()
  endif()
endforeach()
