# cmake -DOUTPUT=<regular expression> -P prints.cmake -- <program> <argument>...
# Fails unless the program ends with 0 and its output matches.
math(EXPR last "${CMAKE_ARGC} - 1")
foreach(i RANGE 5 ${last})
  list(APPEND command ${CMAKE_ARGV${i}})
endforeach()
execute_process(COMMAND ${command} RESULT_VARIABLE failed OUTPUT_VARIABLE output)
message("${output}")
if(failed OR NOT output MATCHES "${OUTPUT}")
  message(FATAL_ERROR "exit code ${failed}; expected output: ${OUTPUT}")
endif()
